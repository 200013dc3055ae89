"""Nastran solids, shells, bars, springs and masses to cells."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from modalprep.fe.mesh.cells import CELLS, Cell
from modalprep.fe.properties.points import PointMass
from modalprep.fe.readers.nastran.builder import Builder
from modalprep.fe.readers.nastran.cards import Card
from modalprep.fe.readers.nastran.materials import made
from modalprep.fe.readers.nastran.properties import bush, rod, spring

SHELLS = {card: cell for cell in CELLS.values() for card in cell.nastran if cell.dimension == 2}
SOLIDS: dict[str, dict[int, Cell]] = {}  # by name of the card and number of grids
for _cell in CELLS.values():
    for _card in _cell.nastran if _cell.dimension == 3 else ():
        SOLIDS.setdefault(_card, {})[_cell.count] = _cell


def _solid(b: Builder, card: Card) -> None:
    if _is_fluid(b, card):
        b.fluid += 1
        return
    kinds = SOLIDS[card.name]
    count = len(card.fields) - 2
    if count not in kinds:
        raise card.error(f"it has {max(count, 0)} grids and needs {' or '.join(map(str, kinds))}; complete the card")
    cell = kinds[count]
    nodes = [b.grids.node(card, 2 + k, f"G{k + 1}") for k in range(count)]
    row = b.cell(card, cell.name, [nodes[i] for i in cell.nastran_order or range(count)], b.section(card, "solid"))
    _put_material_axes(b, card, cell.name, row, nodes)


def _put_material_axes(b: Builder, card: Card, kind: str, row: int, nodes: list[int]) -> None:
    """Give a cell the axes of its material, PSOLID's CORDM, in its middle; the basic ones need not be given."""
    section = b.tables.get("solid", {}).get(card.integer(1, "PID", card.id, lowest=1))
    number = 0 if b.bare or section is None else section.integer(2, "CORDM", 0)
    if number == 0 or b.conversion.materials[section.integer(1, "MID")].name == "MAT1":
        return
    if number < 0:
        raise section.error("CORDM = -1 (axes of the element) is not read; give a coordinate system or 0")
    axes = b.grids.system(section, number).at(b.grids.points[nodes].mean(axis=0))
    b.put("frame", kind, row, axes)


def _is_fluid(b: Builder, card: Card) -> bool:
    """Whether an element is one of acoustics: its property says so."""
    section = b.tables.get("solid", {}).get(card.integer(1, "PID", card.id, lowest=1))
    return section is not None and section.text(6) == "PFLUID"


def _shell(b: Builder, card: Card) -> None:
    cell = SHELLS[card.name]
    kind, count = cell.name, cell.count
    nodes = [b.grids.node(card, 2 + k, f"G{k + 1}") for k in range(count)]
    name = b.section(card, "shell")
    row = b.cell(card, kind, nodes, name)
    if not b.bare:
        theta, flag = {"quad8": (14, 16), "triangle6": (8, 13)}.get(kind, (2 + count, 9))
        _shell_axis(b, card, kind, row, theta)
        shell = b.properties[name]
        if offset := card.real(theta + 1, "ZOFFS", 0.0) * b.units.length:
            b.put("offset", kind, row, shell.offset + offset)
        t = np.array([card.real(10 + k, f"T{k + 1}", 0.0) for k in range(len(cell.corners))])
        t *= shell.thickness if card.text(flag) == "1" else b.units.length
        if np.any(np.abs(t - shell.thickness) > 1e-6 * shell.thickness, where=t != 0):
            if shell.plies:
                raise card.error("its corners have a thickness, but its property has plies; remove T1 to T4")
            b.put("thickness", kind, row, np.where(t == 0, shell.thickness, t))


def _shell_axis(b: Builder, card: Card, kind: str, row: int, k: int) -> None:
    if card.whole(k):
        centre = b.grids.points[b.cells[kind][row]].mean(axis=0)
        b.put("axis", kind, row, b.grids.system(card, card.integer(k, "MCID", lowest=0)).at(centre)[0])
    elif angle := card.real(k, "THETA", 0.0):
        b.put("angle", kind, row, math.radians(angle))


def _rod(b: Builder, card: Card) -> None:
    b.cell(card, "line", [b.grids.node(card, k, f"G{k - 1}") for k in (2, 3)], b.section(card, "rod"))


def _conrod(b: Builder, card: Card) -> None:
    name = f"conrod_{card.id}"
    b.cell(card, "line", [b.grids.node(card, k, f"G{k}") for k in (1, 2)], name)
    b.properties[name] = rod(b.conversion, card, first=3)


def _bar(b: Builder, card: Card) -> None:
    family = card.name[1:].lower()
    nodes = [b.grids.node(card, k, end) for k, end in ((2, "GA"), (3, "GB"))]
    defaults = list(b.tables.get(f"{family.upper()}OR", {}).values())[-1:]
    name = b.section(card, family, defaults[0].integer(1, "PID", card.id, lowest=1) if defaults else None)
    row = b.cell(card, "line", nodes, name)
    if b.bare:
        return
    flags = card.text(7) or (defaults[0].text(7) if defaults else "") or "GGG"
    ends = _ends(b, card, nodes, flags)
    axis = np.diff(b.grids.points[nodes] + ends, axis=0)[0]
    up = _up(b, card, nodes, flags, defaults)
    b.put("up", "line", row, _turned(card, axis, up, b.twist.get(name, 0.0)))
    if ends.any():
        b.put("ends", "line", row, ends * b.units.length)
    if any(card.text(k) not in ("", "0") for k in (8, 9)):
        b.conversion.note("pin flags PA, PB of bars are left out: the bars hold all six components at both ends")


def _up(b: Builder, card: Card, nodes: list[int], flags: str, defaults: list[Card]) -> np.ndarray:
    """Return the orientation vector in basic coordinates, from X1-X3 or from grid G0."""
    source = card if any(card.fields[4:7]) or not defaults else defaults[0]
    if not any(source.fields[4:7]):
        raise card.error("its orientation is missing; give X1, X2, X3 or a grid G0")
    if source.whole(4) and not any(source.fields[5:7]):
        return b.grids.points[b.grids.node(source, 4, "G0")] - b.grids.points[nodes[0]]
    axes = np.eye(3) if flags[:1] == "B" else b.grids.displacement(nodes[0])
    return source.reals(4, 3, "X") @ axes


def _ends(b: Builder, card: Card, nodes: list[int], flags: str) -> np.ndarray:
    """Return the offsets WA, WB in basic coordinates, deck units."""
    offsets = card.reals(10, 6, "W").reshape(2, 3)
    if not offsets.any():
        return offsets
    if "O" in flags[1:3] or "E" in flags[1:3]:
        raise card.error(f"OFFT = {flags} gives offsets in the element's axes; give them in the grids' (GGG)")
    return np.array([offset @ b.grids.displacement(i) for offset, i in zip(offsets, nodes, strict=True)])


def _turned(card: Card, axis: np.ndarray, up: np.ndarray, angle: float) -> np.ndarray:
    """Return the direction of the element's y axis turned by `angle` towards its z axis."""
    z = np.cross(axis, up)
    if not np.linalg.norm(z) > 1e-9 * np.linalg.norm(axis) * np.linalg.norm(up):
        raise card.error("it has no length, or its orientation is parallel to it; give another X1, X2, X3 or G0")
    if not angle:
        return up / np.linalg.norm(up)
    y = np.cross(z, axis)
    return math.cos(angle) * y / np.linalg.norm(y) + math.sin(angle) * z / np.linalg.norm(z)


def _bush(b: Builder, card: Card) -> None:
    if any(card.real(k, "S1, S2, S3", 0.0) for k in (10, 11, 12)):
        raise card.error("its elastic centre S1, S2, S3 lies off the line; give the location S instead")
    nodes = [b.grids.node(card, 2, "GA")] + ([b.grids.node(card, 3, "GB")] if card.text(3) else [])
    location = card.real(8, "S", 0.5)
    number = card.integer(1, "PID", card.id, lowest=1)
    name = f"pbush_{number}" + (f"_s{location:g}" if location != 0.5 else "")
    if name not in b.properties and not b.bare:
        source = b.tables.get("bush", {}).get(number)
        if source is None:
            raise card.error(f"property {number} is not in the deck; add its PBUSH card")
        b.properties[name] = bush(b.conversion, source, location)
    kind = ("vertex", "line")[len(nodes) - 1]
    b.put("frame", kind, b.cell(card, kind, nodes, name), _bush_axes(b, card, nodes))


def _bush_axes(b: Builder, card: Card, nodes: list[int]) -> np.ndarray:
    points = b.grids.points
    if card.text(7):
        return b.grids.system(card, card.integer(7, "CID", lowest=0)).at(points[nodes[0]])
    axis = points[nodes[-1]] - points[nodes[0]]
    if not axis.any():
        raise card.error("its grids coincide or GB is blank and CID is missing; give CID, 0 for the basic system")
    if any(card.fields[4:7]):
        up = _up(b, card, nodes, "GGG", [])
        _turned(card, axis, up, 0.0)
    else:
        up = np.eye(3)[np.argmin(np.abs(axis))]
        b.conversion.note("CBUSH without CID or orientation: the axes across the line are chosen by the reader")
    z = np.cross(axis, up)
    frame = np.array([axis, np.cross(z, axis), z])
    return frame / np.linalg.norm(frame, axis=1, keepdims=True)


def _elas(b: Builder, card: Card) -> None:
    """CELAS1 and CELAS2: one component of one or two grids, in basic axes."""
    ends = [(k, card.integer(k + 1, "C", 0)) for k in (2, 4) if card.text(k) not in ("", "0")]
    nodes = [b.grids.node(card, k, f"G{k // 2}") for k, _ in ends]
    components = {c for _, c in ends}
    if len(components) != 1 or not components <= set(range(1, 7)):
        raise card.error("it joins no grid or unlike components; use one component from 1 to 6 for both ends")
    if any(not np.allclose(b.grids.displacement(i), np.eye(3), atol=1e-9) for i in nodes):
        raise card.error("its grids have a displacement system CD; use CBUSH with its CID")
    c = components.pop() - 1
    along = np.ptp(b.grids.points[nodes], axis=0)
    if np.delete(along, c % 3).any() or (c > 2 and along.any()):
        b.conversion.note(
            "CELAS between distant grids acts through rigid arms to the middle, so that it is free of rotation"
        )
    kind, name = ("vertex", "line")[len(nodes) - 1], f"{card.name.lower()}_{card.id}"
    k = [0.0] * 6
    k[c] = _stiffness(b, card)
    if k[c]:
        b.put("frame", kind, b.cell(card, kind, nodes, name), np.eye(3))
        b.properties[name] = spring(b.conversion, card, k)


def _stiffness(b: Builder, card: Card) -> float:
    if card.name == "CELAS2":
        return card.real(1, "K")
    number = card.integer(1, "PID", card.id, lowest=1)
    if number not in b.tables.get("elas", {}):
        raise card.error(f"property {number} is not in the deck; add its PELAS card")
    return b.tables["elas"][number].real(1, "K")


def _mass(b: Builder, card: Card) -> None:
    node, cid = b.grids.node(card, 1, "G"), card.integer(2, "CID", 0)
    point, offset = b.grids.points[node], card.reals(4, 3, "X")
    I11, I21, I22, I31, I32, I33 = card.reals(8, 6, "inertia ")
    tensor = np.array([[I11, -I21, -I31], [-I21, I22, -I32], [-I31, -I32, I33]])
    axes = b.grids.system(card, max(cid, 0)).at(point)
    offset = offset - point if cid == -1 else offset @ axes
    tensor = axes.T @ tensor @ axes * b.units.inertial * b.units.length**2
    name = f"conm2_{card.id}"
    b.cell(card, "vertex", [node], name)
    b.properties[name] = made(
        card,
        PointMass,
        mass=card.real(3, "M") * b.units.inertial,
        inertia=tuple(tensor[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]].tolist()),
        offset=tuple((offset * b.units.length).tolist()),
    )


def _conm1(b: Builder, card: Card) -> None:
    raise card.error("a full mass matrix has no counterpart here; give mass, offset and inertia as CONM2")


HANDLERS: dict[str, Callable[[Builder, Card], None]] = {
    **dict.fromkeys(SOLIDS, _solid),
    **dict.fromkeys(SHELLS, _shell),
    **{"CBAR": _bar, "CBEAM": _bar, "CROD": _rod, "CONROD": _conrod, "CBUSH": _bush},
    **{"CELAS1": _elas, "CELAS2": _elas, "CONM2": _mass, "CONM1": _conm1},
}
