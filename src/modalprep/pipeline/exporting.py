"""The system of a pipeline file in the file of another program."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import NamedTuple

from modalprep.errors import InputError
from modalprep.multibody.deploying.system import DeployingSystem
from modalprep.pipeline.building.build import made_bodies
from modalprep.pipeline.building.sources import needed_files, refuse_overwriting
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.load import load
from modalprep.pipeline.systems.outline import refuse_before_work
from modalprep.pipeline.systems.read import read_system


class SystemExport(NamedTuple):
    """A format of systems: suffix of its file, ``module.function`` of its writer and of what it loses."""

    suffix: str
    writer: str
    lost: str
    runs: bool = False  # whether it holds the span of the run too


SYSTEM_EXPORTS = {
    "urdf": SystemExport(".urdf", "robots.write.write_urdf", "robots.write.lost_in_urdf"),
    "mjcf": SystemExport(".xml", "robots.mjcf_write.write_mjcf", "robots.mjcf_write.lost_in_mjcf"),
    "exudyn": SystemExport(".py", "decks.exudyn.write_exudyn_script", "decks.exudyn.lost_in_exudyn_script", runs=True),
    "mbdyn": SystemExport(".mbd", "decks.mbdyn.write_mbdyn_deck", "decks.mbdyn.lost_in_mbdyn_deck", runs=True),
}


def export_system(
    path: Path, to: str, output: Path | None, reporter: Reporter, *, target: Path | None = None
) -> list[str]:
    """Write the system of a pipeline file in a format of `SYSTEM_EXPORTS`; return what the file does not hold.

    Raises
    ------
    InputError
        When the file describes no system, or one with what the format cannot hold nor leave out.
    """
    export = SYSTEM_EXPORTS[to]
    if path.suffix != ".toml":
        raise InputError(f"{to} is of a system: give its pipeline file (TOML), not {path}")
    source = load(path)
    target = target or path.with_suffix(export.suffix)
    refuse_overwriting([target], [*needed_files(source), *made_bodies(source, output)])
    if not source.pipeline.joints:
        raise InputError(f"{path} has no joints, so that it describes no system")
    refuse_before_work(source)
    system = read_system(source, output, reporter)
    if isinstance(system, DeployingSystem):
        raise InputError(f"{path}: {to} cannot carry [deployments]; export the system without them")
    table = source.pipeline.simulation
    span = {"t_end": table.t_end, "output_step": table.output_step} if export.runs and table else {}
    _function(export.writer)(system, target, **span)
    reporter.wrote(target)
    return [*system.notes, *_function(export.lost)(system)]


def _function(name: str):
    module, _, function = name.rpartition(".")
    return getattr(import_module(f"modalprep.formats.{module}"), function)
