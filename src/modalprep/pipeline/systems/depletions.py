"""From the tables of a pipeline file to depletions and jets."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.levels import with_density_factor
from modalprep.errors import InputError
from modalprep.formats.modalfile import read_body
from modalprep.multibody.model.depletion import Depletion, ExpelledGas, deplete
from modalprep.multibody.model.time_function import TimeFunction
from modalprep.pipeline.building.build import read_rigid
from modalprep.pipeline.schema.base import naming
from modalprep.pipeline.schema.changing import DepletionTable, JetTable, LevelTable
from modalprep.pipeline.schema.pipeline import Pipeline
from modalprep.pipeline.schema.system import BodyTable
from modalprep.pipeline.schema.time import pieces, time_function
from modalprep.suggest import refuse_unknown


def read_depletions(
    pipeline: Pipeline, bodies: dict[str, FlexibleBody], folder: Path
) -> tuple[tuple[Depletion, ...], tuple[ExpelledGas, ...]]:
    """Return the depletions and jets of a pipeline file; its files are relative to `folder`.

    Raises
    ------
    InputError
        When a body or a depletion is unknown, or a fill level does not suit its body.
    """
    depletions: dict[str, Depletion] = {}
    for name, table in pipeline.depletions.items():
        with naming(f"depletion {name!r}"):
            refuse_unknown(table.body, bodies, "body")
            depletions[name] = _depletion(name, table, bodies[table.body], pipeline.bodies.get(table.body), folder)
    return tuple(depletions.values()), tuple(_jet(name, table, depletions) for name, table in pipeline.jets.items())


def _depletion(
    name: str, table: DepletionTable, body: FlexibleBody, source: BodyTable | None, folder: Path
) -> Depletion:
    levels = tuple(_level(level, body, source, folder) for level in (table.empty, *table.intermediate))
    for level in levels[1:]:
        if not levels[0].m < level.m < body.m:
            raise InputError(
                f"an intermediate level has {level.m:g} kg; it must lie between the empty body's {levels[0].m:g} kg "
                f"and the full one's {body.m:g} kg"
            )
    mass = _mass(table, body.m, levels[0].m, folder)
    return Depletion(name=name, body=table.body, levels=levels, mass=mass)


def _level(table: LevelTable, body: FlexibleBody, source: BodyTable | None, folder: Path) -> FlexibleBody:
    if table.density_factor is not None:
        return with_density_factor(body, table.density_factor)
    if table.file is not None:
        return read_body(folder / table.file)
    if table.mass is None or source is None or source.mass is None:
        raise InputError(
            "a fill level with a 'mass' is for rigid bodies; give a 'density_factor' or a 'file' with the same modes"
        )
    return read_rigid(body.name, table.mass, table, source.interfaces)


def _mass(table: DepletionTable, full: float, empty: float, folder: Path) -> TimeFunction:
    if table.mass is not None:
        return time_function("mass", table.mass, folder)
    assert table.rate is not None  # by the check of the table
    return deplete(full, empty, pieces(table.rate) if isinstance(table.rate, list) else table.rate)


def _jet(name: str, table: JetTable, depletions: dict[str, Depletion]) -> ExpelledGas:
    refuse_unknown(table.depletion, depletions, f"jet {name!r}: depletion")
    values = table.model_dump(exclude={"depletion", "axis"})
    return ExpelledGas(name=name, source=depletions[table.depletion].mass, axis=np.array(table.axis), **values)
