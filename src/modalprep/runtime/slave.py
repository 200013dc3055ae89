"""A functional mock-up unit for co-simulation, run by FMPy."""

from __future__ import annotations

import shutil
import tempfile
import weakref
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from modalprep.errors import InputError, SimulationError
from modalprep.extras import need
from modalprep.suggest import refuse_unknown

VERSIONS = ("2.0", "3.0")
REAL = ("Real", "Float64")
ROUND_OFF = 1e-12  # of the time


class Slave:
    """An FMU, and its instance in a run.

    Parameters
    ----------
    path : path
        Of the file, of FMI 2.0 or 3.0.
    what : str
        Begins the sentences about it.

    Raises
    ------
    InputError
        When it is no FMU for co-simulation on this machine.
    NotInstalledError
        Without FMPy (`pip install 'modalprep[fmpy]'`).
    """

    def __init__(self, path: Path, what: str) -> None:
        need("fmpy", "an FMU in a system")
        import fmpy

        self.path, self.what = path, what
        if not path.is_file():
            raise InputError(f"{what}: there is no file {path}")
        try:
            self.description = fmpy.read_model_description(path)
            platforms = fmpy.supported_platforms(path)
        except Exception as error:  # whatever a file that is no FMU causes
            first = (str(error).splitlines() or [type(error).__name__])[0]
            raise InputError(f"{what}: {path} cannot be read as an FMU: {first}") from None
        if self.description.fmiVersion not in VERSIONS or self.description.coSimulation is None:
            raise InputError(f"{what}: {path} is not for co-simulation of FMI 2.0 or 3.0; export it so")
        if not {fmpy.platform, fmpy.platform_tuple} & set(platforms):
            raise InputError(
                f"{what}: {path} has no library for {fmpy.platform}, but for {', '.join(platforms) or 'none'}"
            )
        self.variables = {each.name: each for each in self.description.modelVariables if each.type in REAL}
        self._fmu: Any = None
        self._finish: Any = None
        self.t = 0.0
        self.said: list[str] = []

    def __getstate__(self) -> dict[str, Any]:
        """Copies in other processes have no instance yet."""
        return {**self.__dict__, "_fmu": None, "_finish": None}

    def check(self, names: Sequence[str], causality: str, key: str) -> None:
        """Refuse names of variables that it does not have, or that are no such variables."""
        allowed = [name for name, each in self.variables.items() if each.causality in (causality, "local")]
        if causality != "output":
            allowed = [name for name, each in self.variables.items() if each.causality in (causality, "input")]
        for name in names:
            refuse_unknown(name, allowed, f"{self.what}: {key}")

    @property
    def step_size(self) -> float | None:
        """The step that it asks for, s."""
        found = getattr(self.description.defaultExperiment, "stepSize", None)
        return None if found is None else float(found)

    def begin(self, t: float, values: Mapping[str, float]) -> None:
        """Make an instance that begins at time t (s) with start values."""
        import fmpy
        from fmpy.simulation import instantiate_fmu

        self.end()
        folder = tempfile.mkdtemp()
        fmpy.extract(self.path, folder)
        self.said.clear()
        own = {"logger": self._log} if self.description.fmiVersion == "2.0" else {}
        self._fmu = self._called(
            lambda: instantiate_fmu(folder, self.description, "CoSimulation", **own), "cannot be made"
        )
        self._finish = weakref.finalize(self, _give_back, self._fmu, folder)
        self._called(lambda: self._initialise(t, values), f"cannot begin at t = {t:g} s")
        self.t = t

    def _initialise(self, t: float, values: Mapping[str, float]) -> None:
        if self.description.fmiVersion == "2.0":
            self._fmu.setupExperiment(startTime=t)
            self._fmu.enterInitializationMode()
        else:
            self._fmu.enterInitializationMode(startTime=t)
        self._set(values)
        self._fmu.exitInitializationMode()

    def put(self, values: Mapping[str, float]) -> None:
        """Set inputs."""
        self._called(lambda: self._set(values), f"does not take its inputs at t = {self.t:g} s")

    def _set(self, values: Mapping[str, float]) -> None:
        if values:
            references = [self.variables[name].valueReference for name in values]
            put = getattr(self._fmu, "setReal", None) or self._fmu.setFloat64
            put(references, list(values.values()))

    def get(self, names: Sequence[str]) -> dict[str, float]:
        """Return outputs by their names."""
        references = [self.variables[name].valueReference for name in names]
        get = getattr(self._fmu, "getReal", None) or self._fmu.getFloat64
        found = self._called(lambda: get(references), f"has no outputs at t = {self.t:g} s")
        return dict(zip(names, found, strict=True))

    def step(self, t: float) -> None:
        """Go on to a time (s), unless it is there."""
        if t - self.t <= ROUND_OFF * abs(t):
            return
        h = t - self.t
        why = f"cannot go on from t = {self.t:g} s by {h:g} s"
        done = self._called(
            lambda: self._fmu.doStep(currentCommunicationPoint=self.t, communicationStepSize=h),
            why,
        )
        if self.description.fmiVersion == "3.0" and done[1]:
            raise SimulationError(f"{self.what}: {self.path.name} {why}: it ends its run")
        self.t = t

    def end(self) -> None:
        """Give the instance back."""
        if self._finish is not None:
            self._finish()
        self._fmu = self._finish = None

    def _log(self, environment: Any, name: Any, status: int, category: Any, text: Any) -> None:
        self.said.append(text.decode(errors="replace") if isinstance(text, bytes) else str(text))

    def _called(self, call: Callable[[], Any], why: str) -> Any:
        try:
            return call()
        except Exception as error:  # of any function of FMPy
            said = self.said[-1] if self.said else str(error)
            raise SimulationError(f"{self.what}: {self.path.name} {why}: {said}") from None


def _give_back(fmu: Any, folder: str) -> None:
    """Free an instance, and remove what was unpacked for it."""
    fmu.freeInstance()
    shutil.rmtree(folder, ignore_errors=True)
