"""The start of the runs of a pipeline file."""

from __future__ import annotations

from pathlib import Path

from modalprep.errors import InputError
from modalprep.formats.resultfile import read_result
from modalprep.formats.statefile import read_state
from modalprep.multibody.deploying.system import DeployingSystem
from modalprep.multibody.evaluation.system_state import SystemState
from modalprep.multibody.model.system import System
from modalprep.multibody.starts import Given, named_state, state_at
from modalprep.pipeline.schema.base import FileName, naming
from modalprep.pipeline.schema.system import SimulationTable


def read_start(table: SimulationTable, folder: Path, system: System | DeployingSystem) -> Given:
    """Return the start of the runs of a pipeline file in `folder`, as `simulate` takes it.

    Raises
    ------
    InputError
        When the file of a state is missing or is one of another system.
    """
    start = table.start
    with naming("[simulation] start"):
        if isinstance(system, DeployingSystem):
            return _at_rest(start)
        if isinstance(start, FileName):
            return _of_file(table, folder / start, system)
        if isinstance(start, dict):
            return named_state(system, start)
    return start


def _at_rest(start: str | dict) -> Given:
    if start != "rest":
        raise InputError("[deployments] start at rest; leave it out")
    return "rest"


def _of_file(table: SimulationTable, file: Path, system: System) -> SystemState:
    state = read_state(file) if table.start_time is None else state_at(system, read_result(file), table.start_time)
    state.vector(system)  # which refuses that of another system
    return state
