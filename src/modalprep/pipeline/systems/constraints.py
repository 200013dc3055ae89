"""From the tables of a pipeline file to closures and couplers."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from modalprep.applies import is_given
from modalprep.multibody.model.constraints import Closure, Coupler
from modalprep.pipeline.schema.base import naming
from modalprep.pipeline.schema.reduction import rotation_matrix
from modalprep.pipeline.schema.system import ClosureTable, CouplerTable
from modalprep.pipeline.schema.time import time_function


def read_closures(
    closures: dict[str, ClosureTable], couplers: dict[str, CouplerTable], folder: Path
) -> tuple[Closure | Coupler, ...]:
    """Return the closures and couplers that a pipeline file describes.

    Examples
    --------
    >>> table = CouplerTable(factors={"pinion": 3.0, "wheel": 1.0})
    >>> read_closures({}, {"gear": table}, Path())[0].factors["pinion"]
    3.0
    """
    constraints: list[Closure | Coupler] = []
    for name, table in closures.items():
        with naming(f"closure {name!r}"):
            constraints.append(_closure(name, table, folder))
    for name, coupler in couplers.items():
        with naming(f"coupler {name!r}"):
            constraints.append(_coupler(name, coupler, folder))
    return tuple(constraints)


def _coupler(name: str, table: CouplerTable, folder: Path) -> Coupler:
    value = time_function("value", table.value, folder)
    return Coupler(name=name, factors=table.factors, value=value, active=table.active, reach=table.reach)


def _closure(name: str, table: ClosureTable, folder: Path) -> Closure:
    path = [None if law == "free" else time_function("path", law, folder) for law in table.path or ()]
    return Closure(
        name=name,
        type=table.type,
        a=table.a,
        b=table.b,
        axis=np.array(table.axis),
        second_axis=None if table.second_axis is None else np.array(table.second_axis),
        position=np.array(table.position),
        rotation=rotation_matrix(table.rotation),
        length=time_function("length", table.length, folder),
        path=path or None,
        **_friction(table),
        active=table.active,
        reach=table.reach,
    )


def _friction(table: ClosureTable) -> dict[str, float]:
    """Return the constants of friction; none where the coefficient is given as 0, as in one job of a grid."""
    if is_given(table, "friction_coefficient") and not table.friction_coefficient:
        return {}
    return {key: getattr(table, key) for key in ("friction_coefficient", "transition_velocity")}
