"""Nastran scalar springs, dampers and concentrated masses to cells."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from modalprep.fe.properties.points import PointMass
from modalprep.fe.readers.nastran.builder import Builder
from modalprep.fe.readers.nastran.cards import Card
from modalprep.fe.readers.nastran.materials import made
from modalprep.fe.readers.nastran.properties import spring
from modalprep.vectors import skew

DIAGONAL_FIRST = [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]  # xx, yy, zz, xy, xz, yz


def _scalar_element(b: Builder, card: Card) -> None:
    """CELAS1, 2 and CDAMP1, 2: one component of one or two grids, along the axes of their displacement system."""
    ends = [(k, card.integer(k + 1, "C", 0)) for k in (2, 4) if card.text(k) not in ("", "0")]
    nodes = [b.grids.node(card, k, f"G{k // 2}") for k, _ in ends]
    components = {c for _, c in ends}
    if len(components) != 1 or not components <= set(range(1, 7)):
        raise card.error("it joins no grid or unlike components; use one component from 1 to 6 for both ends")
    frame = b.grids.displacement(nodes[0])
    if any(not np.allclose(b.grids.displacement(i), frame, atol=1e-9) for i in nodes):
        raise card.error("its grids have displacement systems CD of different axes; use CBUSH with its CID")
    c = components.pop() - 1
    along = np.abs(frame @ (b.grids.points[nodes[-1]] - b.grids.points[nodes[0]]))
    along[along < 1e-9 * along.max()] = 0.0
    if np.delete(along, c % 3).any() or (c > 2 and along.any()):
        b.conversion.note(
            f"{card.name[:-1]} between distant grids acts through rigid arms to the middle, so that it is free of "
            "rotation"
        )
    kind = ("vertex", "line")[len(nodes) - 1]
    name = f"{card.name.lower()}_{card.id}"
    values = {family: [0.0] * 6 for family in ("elas", "damp")}
    family = card.name[1:5].lower()
    values[family][c] = _scalar(b, card, family, "K" if family == "elas" else "B")
    if values[family][c]:
        b.put("frame", kind, b.cell(card, kind, nodes, name), frame)
        b.properties[name] = spring(b.conversion, card, values["elas"], c=values["damp"])


def _visc(b: Builder, card: Card) -> None:
    """CVISC: a damper along and about the line between two grids."""
    nodes = [b.grids.node(card, k, f"G{k - 1}") for k in (2, 3)]
    source = _property(b, card, "visc")
    c = [source.real(1, "CE", 0.0), 0.0, 0.0, source.real(2, "CR", 0.0), 0.0, 0.0]
    if any(c):
        name = f"pvisc_{source.id}"
        _refuse_no_line(b, card, nodes)
        b.cell(card, "line", nodes, name)
        b.properties[name] = spring(b.conversion, source, [0.0] * 6, c=c)


def _bush1d(b: Builder, card: Card) -> None:
    """CBUSH1D: a spring and damper along the line between two grids, or along x of CID."""
    nodes = [b.grids.node(card, k, end) for k, end in ((2, "GA"), (3, "GB")) if card.text(k) or k == 2]
    source = _property(b, card, "bush1d")
    if source.real(3, "M", 0.0):
        raise source.error("its mass M is not read; give it by CONM2 at both ends")
    if any(source.fields[8:]):
        b.conversion.note(f"PBUSH1D {source.id}: its laws of force and damping are left out; K and C act")
    k, c = ([source.real(place, name, 0.0), 0.0, 0.0, 0.0, 0.0, 0.0] for place, name in ((1, "K"), (2, "C")))
    if not (any(k) or any(c)):
        return
    kind = ("vertex", "line")[len(nodes) - 1]
    name = f"pbush1d_{source.id}"
    if card.text(4):
        axes = b.grids.system(card, card.integer(4, "CID")).axes_at(b.grids.points[nodes[0]])
        b.put("frame", kind, b.cell(card, kind, nodes, name), axes)
    else:
        _refuse_no_line(b, card, nodes)
        b.cell(card, kind, nodes, name)
    b.properties[name] = spring(b.conversion, source, k, c=c)


def _refuse_no_line(b: Builder, card: Card, nodes: list[int]) -> None:
    if not np.ptp(b.grids.points[nodes], axis=0).any():
        raise card.error("it has no line, as its grids coincide or one is missing; use CBUSH with its CID")


def _apart(b: Builder, card: Card) -> None:
    """CELAS, CDAMP and CMASS 3 and 4: they act on scalar points, which are apart unless an equation joins them."""
    points = [card.integer(k, "a scalar point", lowest=1) for k in (2, 3) if card.text(k) not in ("", "0")]
    for point in points:
        if not b.grids.is_scalar(point) and point in b.grids.row:
            raise card.error(f"{point} is a grid, of which it names no component; use {card.name[:-1]}1 or 2")
    b.apart.append((card, points))


def _scalar(b: Builder, card: Card, family: str, name: str) -> float:
    """Return the value of a scalar element: its own (CELAS2, CDAMP2, CMASS2), or that of its property."""
    if card.name.endswith("2"):
        return card.real(1, name)
    return _property(b, card, family).real(1, name)


def _property(b: Builder, card: Card, family: str) -> Card:
    """Return the property of an element."""
    number = card.integer(1, "PID", card.id, lowest=1)
    if number not in b.tables.get(family, {}):
        raise card.error(f"property {number} is not in the deck; add its P{family.upper()} card")
    return b.tables[family][number]


def _mass(b: Builder, card: Card) -> None:
    node = b.grids.node(card, 1, "G")
    cid = card.integer(2, "CID", 0)
    point = b.grids.points[node]
    offset = card.reals(4, 3, "X")
    I11, I21, I22, I31, I32, I33 = card.reals(8, 6, "inertia ")
    tensor = np.array([[I11, -I21, -I31], [-I21, I22, -I32], [-I31, -I32, I33]])
    axes = b.grids.system(card, max(cid, 0)).axes_at(point)
    offset = offset - point if cid == -1 else offset @ axes
    tensor = axes.T @ tensor @ axes * b.units.inertial * b.units.length**2
    name = f"conm2_{card.id}"
    b.cell(card, "vertex", [node], name)
    b.properties[name] = made(
        card,
        PointMass,
        mass=card.real(3, "M") * b.units.inertial,
        inertia=tuple(tensor[DIAGONAL_FIRST].tolist()),
        offset=tuple((offset * b.units.length).tolist()),
    )


def _conm1(b: Builder, card: Card) -> None:
    """A mass matrix (6, 6) that is one of a rigid body: its mass, offset and inertia."""
    node = b.grids.node(card, 1, "G")
    axes = b.grids.system(card, card.integer(2, "CID", 0, lowest=0)).axes_at(b.grids.points[node])
    M = np.zeros((6, 6))
    M[np.tril_indices(6)] = card.reals(3, 21, "M")
    M += np.tril(M, -1).T
    m = M[0, 0]
    coupling = M[:3, 3:]
    offset = np.array([coupling[1, 2], coupling[2, 0], coupling[0, 1]]) / m if m else np.zeros(3)
    arm = skew(offset)
    rigid = np.block([[m * np.eye(3), -m * arm], [m * arm, M[3:, 3:]]])
    if not np.allclose(rigid, M, rtol=0, atol=1e-6 * np.abs(M).max()):
        raise card.error("its matrix is not that of a rigid body; give mass, offset and inertia as CONM2")
    inertia = axes.T @ (M[3:, 3:] + m * arm @ arm) @ axes * b.units.inertial * b.units.length**2
    name = f"conm1_{card.id}"
    b.cell(card, "vertex", [node], name)
    b.properties[name] = made(
        card,
        PointMass,
        mass=m * b.units.inertial,
        inertia=tuple(inertia[DIAGONAL_FIRST].tolist()),
        offset=tuple((offset @ axes * b.units.length).tolist()),
    )


def _scalar_mass(b: Builder, card: Card) -> None:
    """CMASS1 and CMASS2 of one grid; those of one grid are joined when all are read."""
    ends = [(k, card.integer(k + 1, "C", 0)) for k in (2, 4) if card.text(k) not in ("", "0")]
    if len(ends) != 1 or ends[0][1] not in range(1, 7):
        raise card.error("it joins two grids, or none; give one grid and a component from 1 to 6, or name it in ignore")
    node = b.grids.node(card, ends[0][0], "G")
    _, sums = b.scalar_masses.setdefault(node, (card, np.zeros(6)))
    sums[ends[0][1] - 1] += _scalar(b, card, "mass", "M")


def add_scalar_masses(b: Builder) -> None:
    """Add the masses of CMASS1 and CMASS2: a body that moves has the same mass in every direction."""
    for node, (card, sums) in b.scalar_masses.items():
        if np.ptp(sums[:3]) > 1e-9 * np.abs(sums).max():
            raise card.error(
                "its mass acts in some directions only, and a body that moves has one mass; give components 1, 2 and 3 "
                f"of the grid the same mass, use CONM2, or ignore = ['{card.name}']"
            )
        axes = b.grids.displacement(node)
        inertia = axes.T @ np.diag(sums[3:]) @ axes * b.units.inertial * b.units.length**2
        name = f"cmass_{b.grids.ids[node]}"
        b.cell(card, "vertex", [node], name)
        b.properties[name] = made(
            card, PointMass, mass=sums[0] * b.units.inertial, inertia=tuple(inertia[DIAGONAL_FIRST].tolist())
        )


HANDLERS: dict[str, Callable[[Builder, Card], None]] = {
    **dict.fromkeys(("CELAS1", "CELAS2", "CDAMP1", "CDAMP2"), _scalar_element),
    **{"CVISC": _visc, "CBUSH1D": _bush1d, "CONM2": _mass, "CONM1": _conm1},
    **{"CMASS1": _scalar_mass, "CMASS2": _scalar_mass},
    **dict.fromkeys(("CELAS3", "CELAS4", "CDAMP3", "CDAMP4", "CMASS3", "CMASS4"), _apart),
}
