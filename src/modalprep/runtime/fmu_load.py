"""An FMU of another program as a load of a system: explicit co-simulation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody.evaluation.expressions import channel_expression
from modalprep.multibody.evaluation.state import State
from modalprep.multibody.model.loads import SampledLoad
from modalprep.runtime.slave import Slave


def fmu_load(
    name: str,
    path: str | Path,
    at: str,
    outputs: Sequence[str | float],
    *,
    inputs: Mapping[str, str | float],
    step: float | None = None,
    start: Mapping[str, float] | None = None,
    axes: Literal["inertial", "body"] = "inertial",
) -> SampledLoad:
    """Return an FMU for co-simulation as a load: a controller, an actuator, a force of another program.

    It runs beside the system. At the begin of a run and at each multiple of `step` it gets its inputs, which it holds,
    and gives its outputs, which are held as forces up to the next one: errors fall with the first power of the step.
    `Result.stats` has the work that the forces do (``exchange.NAME.work``, J), and the work that they would have done
    beyond it had they gone on in straight lines between the steps (``exchange.NAME.error``); `Result.notes` say where
    that is more than 1 % of the energy that was exchanged.

    Each run begins with a new instance, also one that goes on from the end of another.

    Parameters
    ----------
    name, path : str, path
        Of the load and of the file, of FMI 2.0 or 3.0.
    at : str
        ``body.interface``, on which three outputs are a force (N) and six a force and a torque (N m); or a joint, with
        an output for each of its speeds.
    outputs : sequence of str or float
        Names of outputs, with a minus where they count the other way (``"-torque"``), or numbers.
    inputs : {input: expression}
        Expressions of ``t`` and of channels, as of `feedback`.
    step : float or None
        s; by default that which the FMU asks for.
    start : {variable: float}
        Parameters and start values.
    axes : {"inertial", "body"}
        Of a force and a torque; body axes turn with the interface.

    Raises
    ------
    InputError
        When the file is no FMU for co-simulation on this machine, or has no such variables; expressions are read when
        a run begins.
    NotInstalledError
        Without FMPy (`pip install 'modalprep[fmpy]'`).

    References
    ----------
    Functional Mock-up Interface, versions 2.0.4 and 3.0, https://fmi-standard.org. Sadjina, Kyllingstad, Skjong,
    Pedersen (2017), Energy conservation and power bonds in co-simulations, Engineering with Computers 33.

    Examples
    --------
    >>> fmu_load("servo", "servo.fmu", "hinge", ["torque"], inputs={"angle": "hinge.angle"})
    Traceback (most recent call last):
    modalprep.errors.InputError: FMU 'servo': there is no file servo.fmu
    """
    what = f"FMU {name!r}"
    slave = Slave(Path(path), what)
    found = [_output(each) for each in outputs]
    slave.check([own for own, _ in found if own], "output", "output")
    slave.check(list(inputs), "input", "input")
    slave.check(list(start or {}), "parameter", "start value")
    if axes not in ("inertial", "body"):
        raise InputError(f"{what}: axes {axes!r} is neither 'inertial' nor 'body'")
    if axes == "body" and len(found) not in (3, 6):
        raise InputError(f"{what}: body axes need a force (3), or a force and a torque (6) on an interface")
    period = step or slave.step_size
    if period is None:
        raise InputError(f"{what}: {path} does not say its step; give one")
    exchange = Exchange(slave, at, found, inputs, axes)
    begin = partial(slave.begin, values=dict(start or {}))
    return SampledLoad(name=name, sample=exchange, period=period, begin=begin, balanced=True)


def _output(given: str | float) -> tuple[str, float]:
    """Return the name of an output and its factor; of a number no name and its value."""
    if isinstance(given, str):
        return given.removeprefix("-"), -1.0 if given.startswith("-") else 1.0
    return "", float(given)


class Exchange:
    """What an FMU does at a communication point: ``(t, state) -> {where: load}``."""

    def __init__(
        self, slave: Slave, at: str, outputs: list[tuple[str, float]], inputs: Mapping[str, str | float], axes: str
    ) -> None:
        self.slave, self.at, self.outputs = slave, at, outputs
        self.inputs, self.axes = dict(inputs), axes
        self._laws: dict[str, Any] = {}
        self._packed: Any = None

    def __getstate__(self) -> dict[str, Any]:
        """Copies in other processes have not been called yet."""
        return {**self.__dict__, "_laws": {}, "_packed": None}

    def __call__(self, t: float, state: State) -> dict[str, np.ndarray]:
        """Return the load from t (s) on."""
        if self._packed is not state.packed:  # the first call of a run
            self._packed = state.packed
            self._laws = {
                name: channel_expression(state.system, state.packed, str(text), f"{self.slave.what}: input {name!r}")
                for name, text in self.inputs.items()
            }
        self.slave.step(t)
        self.slave.put({name: law(t, state) for name, law in self._laws.items()})
        values = self.slave.get([name for name, _ in self.outputs if name])
        load = np.array([factor * values[name] if name else factor for name, factor in self.outputs])
        if self.axes == "body":
            load = (load.reshape(-1, 3) @ state[self.at].rotation.T).ravel()
        return {self.at: load}
