"""Section of the page on mass: inertia, principal axes, where the effective mass is, reactions under 1 g."""

from __future__ import annotations

from typing import Any

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.reduction.table import DIRECTIONS
from modalprep.report.body_page.modes import UNITS, participation, totals
from modalprep.report.body_page.reactions import G, gravity_reactions
from modalprep.report.body_page.section import Section, paragraph
from modalprep.report.body_page.table import Table

NOISE = 5e-6  # of the largest number of a row: round-off of the mesh
MESH = 1e-4  # of the weight and the largest moment: reactions that the mesh alone makes
SMALL = 1e-2  # kg m²: below, inertia is in kg mm²
INERTIA = (
    "In the axes of the body. The products of inertia are those of the tensor, such as xy = -∫xy dm. The principal "
    "moments are those about the centre of mass; each principal axis is a unit vector."
)
HELD = (
    "Effective mass of the modes of the body with its root held, in kg and in % of the body. What sits on the held "
    "root and supports is moved by no mode; the rest belongs to modes that were left out."
)
ALONE = "Without the mesh it is not known how much of the rest sits on the held root, which no mode moves."
REACTIONS = (
    f"Forces and moments with which the interfaces carry the body at rest under gravity of 1 g = {G} m/s² along each "
    "axis; moments are about the interface. The sum is that of forces, and of moments about the root; it is the weight."
)


def mass_section(body: FlexibleBody) -> Section:
    """Return the section: inertia about root and centre of mass, balance of the effective mass, reactions.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> mass_section(uniform_beam(modes=2)).title
    'Mass and reactions'
    """
    html = inertia_table(body).html()
    if body.n and body.at_root and body.normalised:
        html += mass_balance(body).html() + (paragraph(ALONE) if body.modes.held_mass is None else "")
    try:
        html += reaction_table(body).html()
    except InputError as why:
        html += paragraph(f"Reactions under 1 g: {why}.")
    return Section(title="Mass and reactions", anchor="mass-and-reactions", html=html)


def inertia_tensor(E0: np.ndarray) -> np.ndarray:
    """Return the inertia tensor of second moments of mass (3, 3), kg m^2."""
    return np.trace(E0) * np.eye(3) - E0


def central_inertia(body: FlexibleBody) -> np.ndarray:
    """Return the inertia tensor (3, 3) of a body about its centre of mass, kg m^2, in the axes of the body.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> central_inertia(uniform_beam(modes=1))[2, 2].round(6)  # 12 kg of 10 m
    np.float64(100.0)
    """
    centre = body.s0 / body.m
    return inertia_tensor(body.E0 - body.m * np.outer(centre, centre))


def inertia_table(body: FlexibleBody) -> Table:
    """Return mass, centre of mass, inertia about the origin and the centre of mass, principal moments and axes.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> inertia_table(uniform_beam(modes=1)).rows[0]
    ('mass', 'kg', 12.0, None, None)
    """
    centre = body.s0 / body.m
    about_root = inertia_tensor(body.E0)
    central = central_inertia(body)
    moments, axes = np.linalg.eigh(central)
    axes = axes * np.where(axes[np.abs(axes).argmax(axis=0), range(3)] < 0, -1, 1)
    factor, unit = (1.0, "kg m²") if about_root.max() > SMALL else (1e6, "kg mm²")
    rows: list[tuple[Any, ...]] = [("mass", "kg", body.m, None, None), ("centre of mass", "m", *_clean(centre))]
    for place, J in (("origin", about_root), ("centre of mass", central)):
        products = without_noise(J)[[0, 1, 2], [1, 2, 0]]
        rows.append((f"inertia about the {place}: xx, yy, zz", unit, *(factor * np.diag(J)).tolist()))
        rows.append((f"inertia about the {place}: xy, yz, zx", unit, *(factor * products).tolist()))
    rows += [(f"principal axis {k}", "", *_clean(axes[:, k - 1])) for k in (1, 2, 3)]
    rows.insert(-3, ("principal moments of inertia", unit, *(factor * np.maximum(moments, 0.0)).tolist()))
    columns = ("quantity", "unit", "x or first", "y or second", "z or third")
    return Table(name="mass-properties", columns=columns, rows=rows, caption=INERTIA)


def without_noise(array: np.ndarray) -> np.ndarray:
    """Return an array with zeros where its numbers are round-off of the mesh."""
    return np.where(np.abs(array) > NOISE * np.abs(array).max(), array, 0.0)


def _clean(vector: np.ndarray) -> list[float]:
    return without_noise(vector).tolist()


def mass_balance(body: FlexibleBody) -> Table:
    """Return the effective mass of the modes, what the held root has, and what is left, up to the mass of the body."""
    whole = totals(body)
    moved = (participation(body) ** 2).sum(axis=0)
    held = body.modes.held_mass
    parts = {"modes of the body": moved}
    if held is None:
        parts["not in the modes"] = whole - moved
    else:
        parts |= {"held at the root": held, "modes left out": whole - moved - held}
    share = {name: 100 * value / np.where(whole > 0, whole, np.inf) for name, value in parts.items()}
    return Table(
        name="mass-balance",
        columns=("part", *(f"{d} ({unit})" for d, unit in zip(DIRECTIONS, UNITS, strict=True))),
        rows=[(name, *_without_noise(value, whole)) for name, value in parts.items()],
        total=("body", *whole.tolist()),
        below=[(f"{name}, %", *np.round(value, 2).tolist()) for name, value in share.items()],
        caption=HELD,
    )


def _without_noise(value: np.ndarray, total: np.ndarray) -> list[float]:
    return np.where(np.abs(value) > NOISE * total, value, 0.0).tolist()


def reaction_table(body: FlexibleBody) -> Table:
    """Return the reactions of the root alone, and of the root with the further held interfaces, under 1 g.

    Raises
    ------
    InputError
        When the body has no static reactions.
    """
    others = [name for name in body.modes.held_interfaces if name in body.interface_name]
    rows: list[tuple[Any, ...]] = []
    for held in ([], others) if others else ([],):
        found = gravity_reactions(body, held)
        for axis, own in zip("xyz", found, strict=True):
            rows += _rows(body, axis, held, own)
    columns = ("held", "gravity along", "interface", "Fx (N)", "Fy (N)", "Fz (N)", "Mx (N m)", "My (N m)", "Mz (N m)")
    return Table(name="reactions", columns=columns, rows=rows, caption=REACTIONS)


def _rows(body: FlexibleBody, axis: str, supported: list[str], reactions: np.ndarray) -> list[tuple[Any, ...]]:
    names = [body.interface_name[0], *supported]
    arms = body.interface_position[[body.interface_name.index(name) for name in names]]
    total = reactions.sum(axis=0) + np.append(np.zeros(3), np.cross(arms, reactions[:, :3]).sum(axis=0))
    least = np.append(np.full(3, MESH * G * body.m), np.full(3, MESH * max(np.abs(reactions[:, 3:]).max(), 1e-300)))
    said = ", ".join(names)
    rows = [*zip(names, reactions, strict=True), *([("sum", total)] if supported else [])]
    return [(said, axis, name, *np.where(np.abs(row) > least, row, 0.0).tolist()) for name, row in rows]
