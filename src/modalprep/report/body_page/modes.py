"""The modes of a body as tables: frequencies, damping, participation, effective mass; what the body recovers."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.linalg import eigh

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.mass import mass_matrix
from modalprep.body.quality.effective_mass import participation, totals
from modalprep.reduction.table import DIRECTIONS, ModeTable
from modalprep.report.body_page.table import Table
from modalprep.report.numbers import quantity

UNITS = ("kg",) * 3 + ("kg m²",) * 3
FIRST = ("mode", "name", "Hz", "free-free Hz", "damping %")
NEGLIGIBLE = 1e-6  # of the mass or inertia of the body: modes that do not move it but for the mesh


def mode_tables(body: FlexibleBody) -> list[Table]:
    """Return the modes with damping and effective mass in %, in kg, and with their participation factors.

    The participation of modes that are not those of the clamped root, or have other modal masses than 1, has no such
    meaning; the table then has frequencies and damping only. Effective masses below `NEGLIGIBLE` are zero.
    """
    damping = 100 * body.D / (2 * np.sqrt(np.where(body.K > 0, body.K, 1.0)))
    numbers = range(1, body.n + 1)
    names = body.mode_names or ("",) * body.n
    first = list(zip(numbers, names, body.frequency.tolist(), floating(body).tolist(), damping.tolist(), strict=True))
    marks = [f"mode-{mode}" for mode in numbers]
    if not (body.at_root and body.normalised):
        return [Table(name="modes", columns=FIRST, rows=first, marks=marks)]
    factor = participation(body)
    whole = totals(body)
    factor = np.where(factor**2 > NEGLIGIBLE * whole, factor, 0.0)
    short = [(row[0], row[2]) for row in first]
    return [_shares(first, factor**2, whole, marks), _masses(short, factor**2, whole), _factors(short, factor)]


def _shares(first: list[tuple], mass: np.ndarray, total: np.ndarray, marks: list[str]) -> Table:
    share = 100 * mass / np.where(total > 0, total, np.inf)
    columns = (*FIRST, *(f"{d} %" for d in DIRECTIONS))
    return Table(
        name="modes",
        columns=columns,
        rows=[(*row, *values) for row, values in zip(first, share.tolist(), strict=True)],
        total=("sum", None, None, None, None, *share.sum(axis=0).tolist()),
        forms={"damping %": ".3g"} | dict.fromkeys(columns[len(FIRST) :], ".2f"),
        marks=marks,
        caption="Effective mass of each mode in % of the body's mass (x, y, z) and of its moments of inertia about the "
        "root (rx, ry, rz), which the root alone holds. The free-free frequencies are those of the elastic modes of "
        "the floating body in their own order. The number of a mode opens it in the animated view.",
    )


def _masses(first: list[tuple], mass: np.ndarray, total: np.ndarray) -> Table:
    held = mass.sum(axis=0)
    return Table(
        name="effective-mass",
        columns=("mode", "Hz", *(f"{d} ({unit})" for d, unit in zip(DIRECTIONS, UNITS, strict=True))),
        rows=[(*row, *values) for row, values in zip(first, mass.tolist(), strict=True)],
        total=("sum", None, *held.tolist()),
        below=[("body", None, *total.tolist()), ("residual", None, *(total - held).tolist())],
        caption="The same in kg and kg m²; the residual is what the modes of the body do not move.",
    )


def _factors(first: list[tuple], factor: np.ndarray) -> Table:
    units = ("kg^½",) * 3 + ("kg^½ m",) * 3
    return Table(
        name="participation-factors",
        columns=("mode", "Hz", *(f"{d} ({unit})" for d, unit in zip(DIRECTIONS, units, strict=True))),
        rows=[(*row, *values) for row, values in zip(first, factor.tolist(), strict=True)],
        caption="Participation factors of the modes in accelerations of the root, for modal masses of 1; their squares "
        "are the effective masses.",
    )


def floating(body: FlexibleBody) -> np.ndarray:
    """Return the frequencies (Hz) of the elastic modes of the floating body, ``(n,)``; it has six rigid ones besides.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> floating(uniform_beam(modes=2)) > uniform_beam(modes=2).frequency
    array([ True,  True])
    """
    mass = mass_matrix(body, np.zeros(body.n))
    scale = 1 / np.sqrt(np.maximum(np.diag(mass), np.finfo(float).tiny))
    K = np.diag(np.append(np.zeros(6), body.K) * scale**2)
    try:
        w2 = eigh(K, mass * scale * scale[:, None], eigvals_only=True)
    except np.linalg.LinAlgError:  # of a line of points, which has no inertia about itself
        return np.full(body.n, np.nan)
    return np.sqrt(np.maximum(w2[6:], 0.0)) / (2 * np.pi)


def selection_csv(table: ModeTable) -> str:
    """Return the candidates as text of a CSV file: effective mass in kg, kg m² and %, whether kept and why."""
    units = [f"{d} ({unit})" for d, unit in zip(DIRECTIONS, UNITS, strict=True)]
    rows: list[tuple[Any, ...]] = [
        (
            k + 1,
            kind,
            float(table.frequency[k]),
            *table.effective_mass[k].tolist(),
            *(100 * table.fraction[k]).tolist(),
            bool(table.kept[k]),
            table.reason[k],
        )
        for k, kind in enumerate(table.kind)
    ]
    columns = ("no.", "kind", "Hz", *units, *(f"{d} %" for d in DIRECTIONS), "kept", "reason")
    return Table(name="mode-selection", columns=columns, rows=rows).csv()


def recovery_table(body: FlexibleBody) -> Table:
    """Return what the body recovers: kind, places, components with units, allowable."""
    rows: list[tuple[Any, ...]] = [
        (
            name,
            block.kind,
            len(block.places),
            _listed(block.places),
            _listed(block.components),
            _units(block.units),
            _allowable(block.allowable, block.units),
        )
        for name, block in body.recovery.items()
    ]
    rows += [
        (name, "stress at a point", 1, name, _listed(at.components), "Pa", "none given")
        for name, at in body.stress.items()
    ]
    return Table(
        name="recoveries",
        columns=("name", "kind", "places", "first and last", "components", "units", "allowable"),
        rows=rows,
        caption="Quantities with recovery matrices in the modal file.",
    )


def _allowable(allowable: float | None, units: tuple[str, ...]) -> str:
    return "none given" if allowable is None else quantity(allowable, units[0])


def _listed(names: tuple[str, ...]) -> str:
    return ", ".join(names) if len(names) <= 6 else f"{names[0]} ... {names[-1]}"


def _units(units: tuple[str, ...]) -> str:
    return ", ".join(dict.fromkeys(units))
