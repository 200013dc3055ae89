"""The start values of a pipeline file that follow from targets."""

from __future__ import annotations

import numpy as np

from modalprep.multibody.analysis.inverse_kinematics import WHAT, Target, inverse_kinematics
from modalprep.multibody.model.system import System
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.base import Table, naming
from modalprep.pipeline.schema.inverse_kinematics import InverseKinematicsTable, TargetTable
from modalprep.pipeline.schema.reduction import RotationTable, rotation_matrix
from modalprep.report.analysis import kinematics_table


def started_at_targets(system: System, table: InverseKinematicsTable, reporter: Reporter) -> System:
    """Return the system with the start values that meet the targets, and print them.

    Raises
    ------
    InputError
        When a name is not known.
    SimulationError
        When targets cannot be met.
    """
    targets = [_target(at, each) for at, each in table.targets.items()]
    options = table.model_dump(include={"given", "free", "weights", "nearest"})
    with naming("[inverse_kinematics]"):
        found = inverse_kinematics(system, targets, **options)
    kinematics_table(found, reporter.console)
    return found.system


def _target(at: str, table: TargetTable) -> Target:
    values = {what: _value(getattr(table, what)) for what in WHAT}
    return Target(at=at, weight=table.weight, **values)


def _value(given: Table | list[float] | None) -> np.ndarray | None:
    """Return three numbers, NaN where they are free, or a rotation."""
    if given is None:
        return None
    if isinstance(given, RotationTable):
        return rotation_matrix(given)
    parts = [part for _, part in given] if isinstance(given, Table) else given
    return np.array([np.nan if part is None else part for part in parts], dtype=float)
