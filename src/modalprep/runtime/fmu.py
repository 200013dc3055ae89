"""Functional mock-up units: a system for other programs, by the compiled kernels, without Python."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from platform import machine
from typing import Any
from zipfile import ZIP_DEFLATED, ZipFile

from modalprep.atomic import atomic_path
from modalprep.errors import InputError
from modalprep.multibody.analysis.state_space import LinearSystem
from modalprep.multibody.model.system import System
from modalprep.runtime.description import CO_SIMULATION, MODEL_EXCHANGE, description
from modalprep.runtime.libraries import PLATFORMS, library, linear_library
from modalprep.runtime.linear import linear_model
from modalprep.runtime.model import Model, model_of
from modalprep.runtime.terminals import terminals
from modalprep.suggest import refuse_other, refuse_unknown

VERSIONS = ("2", "3")
KINDS = {"me": (MODEL_EXCHANGE,), "cs": (CO_SIMULATION,), "both": (MODEL_EXCHANGE, CO_SIMULATION)}


def write_fmu(
    system: System,
    path: str | Path,
    *,
    fmi: str = "2",
    kind: str = "both",
    platforms: Sequence[str] = (),
    say: Callable[[str], None] = lambda text: None,
    **options: Any,
) -> Model:
    """Write a system as a functional mock-up unit (FMU); return what it holds.

    Derivatives, outputs and the steps of co-simulation are those of `simulate`: the same compiled kernels. An FMU for
    model exchange leaves the steps to the program that imports it; quaternions and closed loops are put right at each
    evaluation. Events that are expressions, limits of joints and straps that become slack are event indicators, and an
    event that ends a run ends that of the FMU.

    Parameters
    ----------
    fmi : {"2", "3"}
        Version of FMI: 2.0 or 3.0.
    kind : {"me", "cs", "both"}
        Model exchange, co-simulation, or both.
    platforms : sequence of str
        For which it has a library, among `libraries.PLATFORMS`; by default that of this machine.
    say : callable
        Told what takes long.
    options
        ``t_end`` (s), ``output_step``, ``rtol``, ``atol``, ``method``, ``max_step``, ``step``, ``shortest_event``,
        ``start``, ``period`` and ``events`` of `simulate`.

    Raises
    ------
    InputError
        When the system has what an FMU cannot carry: loads in Python, control laws, events that change closures.
    NotInstalledError
        When there is no library for a platform and no compiler (`pip install 'modalprep[fmu]'`).

    References
    ----------
    Functional Mock-up Interface, versions 2.0.4 and 3.0, https://fmi-standard.org.

    Examples
    --------
    >>> import tempfile
    >>> from modalprep.examples import small_systems
    >>> rod = small_systems()["rigid bodies in trees"]
    >>> write_fmu(rod, Path(tempfile.mkdtemp()) / "rod.txt", t_end=1.0)
    Traceback (most recent call last):
    modalprep.errors.InputError: an FMU has the suffix .fmu, not '.txt'
    """
    refuse_other("write_fmu: the system", System, system)
    _refuse_wrong(path, fmi, kind, platforms)
    model = model_of(system, **options)
    files = {each: library(model.kind, each, say) for each in _chosen(platforms)}
    names = {each.name for each in model.variables}
    _write(model, path, fmi, kind, files, terminals(system, names) if fmi == "3" else b"")
    return model


def write_linear_fmu(
    linear: LinearSystem,
    path: str | Path,
    *,
    t_end: float,
    output_step: float = 0.01,
    fmi: str = "2",
    kind: str = "both",
    platforms: Sequence[str] = (),
    start: Mapping[str, float] | None = None,
    say: Callable[[str], None] = lambda text: None,
) -> Model:
    """Write linear equations as a functional mock-up unit; return what it holds.

    States, inputs and outputs have the names of the equations; an output that is a state is that state. Steps of
    co-simulation are exact for inputs that are held, by the exponential of the matrix; directional derivatives are the
    matrices.

    Parameters
    ----------
    linear : LinearSystem
        Of `linearise`, `balanced_truncation` and others.
    t_end, output_step : float
        s, of the default experiment.
    fmi, kind, platforms, say
        As of `write_fmu`.
    start : {state or input: float}
        Values at the begin that are not zero.

    Raises
    ------
    InputError
        When a name is unknown or stands twice.
    NotInstalledError
        When there is no library for a platform and no compiler (`pip install 'modalprep[fmu]'`).

    Examples
    --------
    >>> import tempfile
    >>> from modalprep.multibody.analysis.linearise import linearise
    >>> from modalprep.examples import small_systems
    >>> rod = linearise(small_systems()["rigid bodies in trees"], inputs=["hinge"])
    >>> write_linear_fmu(rod, Path(tempfile.mkdtemp()) / "rod.fmu", t_end=1.0, start={"hinge.rat": 1.0})
    Traceback (most recent call last):
    modalprep.errors.InputError: start value 'hinge.rat' does not exist; did you mean 'hinge.rate'? known are
    hinge.angle, hinge.rate, hinge
    """
    refuse_other("write_linear_fmu: the equations", LinearSystem, linear)
    _refuse_wrong(path, fmi, kind, platforms)
    model = linear_model(linear, t_end, output_step, start or {})
    _write(model, path, fmi, kind, {each: linear_library(each, say) for each in _chosen(platforms)}, b"")
    return model


def _refuse_wrong(path: str | Path, fmi: str, kind: str, platforms: Sequence[str]) -> None:
    refuse_unknown(fmi, VERSIONS, "version of FMI")
    refuse_unknown(kind, KINDS, "kind of FMU")
    if Path(path).suffix != ".fmu":
        raise InputError(f"an FMU has the suffix .fmu, not {Path(path).suffix!r}")
    for each in platforms:
        refuse_unknown(each, PLATFORMS, "platform")


def _chosen(platforms: Sequence[str]) -> list[str]:
    return list(dict.fromkeys(platforms)) or [own_platform()]


def _write(model: Model, path: str | Path, fmi: str, kind: str, files: Mapping[str, Path], icons: bytes) -> None:
    """Write the archive; `files` are the libraries of the platforms."""
    name = re.sub(r"\W", "_", Path(path).stem, flags=re.ASCII)
    name = name if name[:1].isalpha() else f"fmu_{name}"
    with atomic_path(Path(path)) as temporary, ZipFile(temporary, "w", ZIP_DEFLATED) as archive:
        archive.writestr("modelDescription.xml", description(model, name, fmi, KINDS[kind]))
        archive.writestr("resources/model.bin", model.content)
        if icons:
            archive.writestr("terminalsAndIcons/terminalsAndIcons.xml", icons)
        for each, file in files.items():
            platform = PLATFORMS[each]
            folder = platform.fmi2 if fmi == "2" else platform.fmi3
            archive.write(file, f"binaries/{folder}/{name}{platform.target.suffix}")


def own_platform() -> str:
    """Return the platform of this machine.

    Raises
    ------
    InputError
        When there are no libraries for it.
    """
    system = {"linux": "linux", "win32": "windows", "darwin": "macos"}.get(sys.platform, sys.platform)
    name = f"{system}-{ {'AMD64': 'x86_64', 'ARM64': 'arm64'}.get(machine(), machine()) }"
    if name not in PLATFORMS:
        raise InputError(f"there is no FMU for this machine, {name}; give platforms: {', '.join(PLATFORMS)}")
    return name
