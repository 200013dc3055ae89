"""The system of a pipeline file as a functional mock-up unit."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from modalprep.errors import InputError
from modalprep.multibody.deploying.system import DeployingSystem
from modalprep.pipeline.building.build import made_bodies
from modalprep.pipeline.building.sources import needed_files, refuse_overwriting
from modalprep.pipeline.console import Reporter, says_compiling
from modalprep.pipeline.schema.base import naming
from modalprep.pipeline.schema.changing import read_events
from modalprep.pipeline.schema.load import Loaded, load
from modalprep.pipeline.schema.system import SimulationTable
from modalprep.pipeline.systems.outline import refuse_before_work
from modalprep.pipeline.systems.read import in_theory, read_system
from modalprep.pipeline.systems.start import read_start
from modalprep.runtime.fmu import write_fmu
from modalprep.runtime.model import Model


@says_compiling
def fmu_of_pipeline(
    path: str | Path | Loaded,
    output: Path | None,
    reporter: Reporter,
    *,
    target: Path,
    fmi: str = "2",
    kind: str = "both",
    platforms: Sequence[str] = (),
    step: float | None = None,
) -> Model:
    """Write the system of a pipeline file as an FMU, with the span and the tolerances of its [simulation].

    Parameters
    ----------
    fmi, kind, platforms
        As `write_fmu`.
    step : float or None
        s, fixed, in place of the tolerances.

    Raises
    ------
    InputError
        When the file has no [simulation], or the system has what an FMU cannot carry.
    """
    source = load(path)
    table = _simulation(source)
    refuse_overwriting([target], [*needed_files(source), *made_bodies(source, output)])
    refuse_before_work(source)
    system = read_system(source, output, reporter)
    assert not isinstance(system, DeployingSystem)  # by `_simulation`
    system = in_theory(system, table.chosen_theory)
    start = read_start(table, source.folder, system)
    begin = {"start": start, "period": table.period, "events": read_events(source.pipeline.events)}
    with naming(source.path):
        own = {"fmi": fmi, "kind": kind, "platforms": platforms, "say": reporter.say, "step": step}
        model = write_fmu(system, target, **own, **table.steps, **begin)
    reporter.wrote(target)
    reporter.notes([*_left_out(source, table), *model.notes])
    return model


def _simulation(source: Loaded) -> SimulationTable:
    """Return the table with the span; refuse what is no system of joints."""
    table = source.pipeline.simulation
    if table is None:
        raise InputError(f"{source.path} has no [simulation]: add one with t_end, up to which functions of time go")
    if source.pipeline.deployments:
        raise InputError(f"{source.path}: an FMU cannot carry [deployments]; export the system without them")
    if table.variables != "joint":
        raise InputError(f"{source.path}: an FMU has no variables = {table.variables!r}; leave it out of [simulation]")
    return table


def _left_out(source: Loaded, table: SimulationTable) -> list[str]:
    """Return what of the file is not of the system."""
    said = []
    if source.pipeline.ensemble is not None:
        said.append("the FMU is of the nominal system; [ensemble] belongs to runs here")
    if table.compare_conventional:
        said.append("the FMU is of the main run; compare_conventional belongs to runs here")
    return said
