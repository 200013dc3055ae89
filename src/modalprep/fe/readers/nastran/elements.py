"""Nastran solids, shells, panels, bars and bushings to cells."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np

from modalprep.fe.mesh.cells import CELLS, Cell
from modalprep.fe.mesh.mesh import Link
from modalprep.fe.properties.points import PointMass
from modalprep.fe.properties.properties import Shell
from modalprep.fe.readers.nastran.builder import Builder
from modalprep.fe.readers.nastran.cards import Card
from modalprep.fe.readers.nastran.materials import made
from modalprep.fe.readers.nastran.properties import bush, bush_mass, flange, rod, spring
from modalprep.fe.readers.systems import BASIC

NORMAL = 1e-6  # sine of the angle to the normal below which an axis has no direction in a shell
CHORDS = 16  # of the arc of a CBEND
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
    first, last = min(kinds), max(kinds)
    if not first <= count <= last:
        raise card.error(f"it has {max(count, 0)} grids and needs {' or '.join(map(str, kinds))}; complete the card")
    cell = kinds[last if count > first else first]
    kind, nodes = _nodes(b, card, cell, 3)
    row = b.cell(card, kind, nodes, b.section(card, "solid"))
    _put_material_axes(b, card, kind, row, nodes)
    if kind == "hexahedron20" and _solid_property(b, card, 3) in ("2", "TWO"):
        b.put("integration", kind, row, 1.0)


def note_integration(b: Builder) -> None:
    """Say where PSOLID asks bricks of eight grids for an integration without incompatible modes."""
    for number, card in b.tables.get("solid", {}).items():
        if "hexahedron" in b.groups.get(f"psolid_{number}", {}) and card.text(3) in ("2", "TWO", "3", "THREE"):
            b.conversion.note(
                f"PSOLID {number}: CHEXA with 8 grids have incompatible modes here, though IN = {card.text(3)} asks "
                "for none: Nastran's are then stiffer in bending"
            )


def _nodes(b: Builder, card: Card, cell: Cell, components: int) -> tuple[str, list[int]]:
    """Return the kind and the nodes of a cell, from field 2 on; mid-side grids may be missing, or all of them."""
    first = len(cell.corners)
    order = cell.nastran_order or range(cell.count)
    found = [
        b.grids.node(card, 2 + k, f"G{k + 1}") if k < first or card.text(2 + k) not in ("", "0") else None
        for k in order
    ]
    own = [row for row in found if row is not None]
    if len(own) < cell.count and not any(row is not None for row in found[first:]):
        return cell.shape, own
    return cell.name, own if len(own) == cell.count else b.completed(cell.name, found, b.grids.points, components)


def _put_material_axes(b: Builder, card: Card, kind: str, row: int, nodes: list[int]) -> None:
    """Give a cell the axes of its material, PSOLID's CORDM, in its middle; the basic ones need not be given."""
    section = b.tables.get("solid", {}).get(card.integer(1, "PID", card.id, lowest=1))
    if b.bare or section is None:
        return
    number = section.integer(2, "CORDM", 0)
    in_place = number == 0 and b.grids.systems[0] is BASIC
    if in_place or b.conversion.materials[section.integer(1, "MID")].name == "MAT1":
        return
    if number < 0:
        raise section.error("CORDM = -1 (axes of the element) is not read; give a coordinate system or 0")
    axes = b.grids.system(section, number).axes_at(b.centre(nodes, b.grids.points))
    b.put("frame", kind, row, axes)


def _is_fluid(b: Builder, card: Card) -> bool:
    """Whether an element is one of acoustics: its property says so."""
    return _solid_property(b, card, 6) == "PFLUID"


def _solid_property(b: Builder, card: Card, k: int) -> str:
    """Return a field of the PSOLID of an element, "" without one."""
    section = b.tables.get("solid", {}).get(card.integer(1, "PID", card.id, lowest=1))
    return "" if section is None else section.text(k)


def _shell(b: Builder, card: Card) -> None:
    cell = SHELLS[card.name]
    kind, nodes = _nodes(b, card, cell, 6)
    name = b.section(card, "shell")
    row = b.cell(card, kind, nodes, name)
    if not b.bare:
        theta, flag = {"quad8": (14, 16), "triangle6": (8, 13)}.get(cell.name, (2 + cell.count, 9))
        _shell_axis(b, card, kind, row, theta)
        shell = b.properties[name]
        assert isinstance(shell, Shell)  # its card is one of shells
        if offset := card.real(theta + 1, "ZOFFS", 0.0) * b.units.length:
            b.put("offset", kind, row, shell.offset + offset)
        t = np.array([card.real(10 + k, f"T{k + 1}", 0.0) for k in range(len(cell.corners))])
        t *= shell.thickness if card.text(flag) == "1" else b.units.length
        if np.any(np.abs(t - shell.thickness) > 1e-6 * shell.thickness, where=t != 0):
            if shell.plies:
                raise card.error("its corners have a thickness, but its property has plies; remove T1 to T4")
            b.put("thickness", kind, row, np.where(t == 0, shell.thickness, t))


def _shell_axis(b: Builder, card: Card, kind: str, row: int, k: int) -> None:
    if card.is_integer(k):
        axes = b.grids.system(card, card.integer(k, "MCID", lowest=0)).axes_at(
            b.centre(b.cells[kind][row], b.grids.points)
        )
        b.put("axis", kind, row, _in_plane(b, card, b.cells[kind][row], axes))
    elif angle := card.real(k, "THETA", 0.0):
        b.put("angle", kind, row, math.radians(angle))


def _in_plane(b: Builder, card: Card, nodes: list[int], axes: np.ndarray) -> np.ndarray:
    """Return x of a material's system, or y where x is normal to the shell."""
    p = b.grids.points[nodes[:4] if len(nodes) in (4, 8, 9) else nodes[:3]]
    normal = np.cross(p[2] - p[0], p[-1] - p[1])
    if np.linalg.norm(np.cross(normal, axes[0])) > NORMAL * np.linalg.norm(normal):
        return axes[0]
    b.normal.append(card)
    return axes[1]


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
    up = _up(b, card, nodes, flags, defaults)
    ends = _ends(b, card, nodes, flags, up)
    axis = np.diff(b.grids.points[nodes] + ends, axis=0)[0]
    b.put("up", "line", row, _turned(card, axis, up, b.twist.get(name, 0.0)))
    if ends.any():
        b.put("ends", "line", row, ends * b.units.length)
    if pins := [6 * end + int(c) - 1 for end in (0, 1) for c in _pin_flags(card, 8 + end)]:
        across = [{pin % 6 % 3 for pin in pins if pin // 3 == part} for part in range(4)]
        if b.twist.get(name) and any(len(some & {1, 2}) == 1 for some in across):
            raise card.error("its pin flags act along axes that I12 turns; release both directions across the bar")
        b.put("pins", "line", row, np.isin(np.arange(12), [_ours(pin) for pin in pins]).astype(float))


def _pin_flags(card: Card, k: int) -> str:
    """Return the components that an end of a bar releases, in its own axes."""
    flags = card.text(k) if card.text(k) != "0" else ""
    if set(flags) - set("123456"):
        raise card.error(f"pin flags {flags} are not made of the digits 1 to 6; give such as 456")
    return flags


def _ours(pin: int) -> int:
    """Return the DOF in our axes of a bar: along y of Nastran is e3, along z is -e2."""
    return pin + (0, 1, -1)[pin % 3]


def _up(b: Builder, card: Card, nodes: list[int], flags: str, defaults: list[Card]) -> np.ndarray:
    """Return the orientation vector in basic coordinates, from X1-X3 or from grid G0."""
    source = card if any(card.fields[4:7]) or not defaults else defaults[0]
    if not any(source.fields[4:7]):
        raise card.error("its orientation is missing; give X1, X2, X3 or a grid G0")
    if source.is_integer(4) and not any(source.fields[5:7]):
        return b.grids.points[b.grids.node(source, 4, "G0")] - b.grids.points[nodes[0]]
    axes = b.grids.systems[0].axes if flags[:1] == "B" else b.grids.displacement(nodes[0])
    return source.reals(4, 3, "X") @ axes


def _ends(b: Builder, card: Card, nodes: list[int], flags: str, up: np.ndarray) -> np.ndarray:
    """Return the offsets WA, WB in basic coordinates, deck units; flag O gives them along GA-GB and the orientation."""
    offsets = card.reals(10, 6, "W").reshape(2, 3)
    found = np.zeros((2, 3))
    for end in np.flatnonzero(offsets.any(axis=1)):
        axes = b.grids.displacement(nodes[end])
        if flags[1 + end : 2 + end] in ("O", "E"):
            x = np.diff(b.grids.points[nodes], axis=0)[0]
            y = _turned(card, x, up, 0.0)
            z = np.cross(x, y) / np.linalg.norm(np.cross(x, y))
            axes = np.array([x / np.linalg.norm(x), np.cross(z, x) / np.linalg.norm(x), z])
        found[end] = offsets[end] @ axes
    return found


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
    nodes = [b.grids.node(card, 2, "GA")] + ([b.grids.node(card, 3, "GB")] if card.text(3) else [])
    location = card.real(8, "S", 0.5)
    number = card.integer(1, "PID", card.id, lowest=1)
    name = f"pbush_{number}" + (f"_s{location:g}" if location != 0.5 else "")
    source = b.tables.get("bush", {}).get(number)
    if name not in b.properties and not b.bare:
        if source is None:
            raise card.error(f"property {number} is not in the deck; add its PBUSH card")
        b.properties[name] = bush(b.conversion, source, location)
    kind = ("vertex", "line")[len(nodes) - 1]
    frame = _bush_axes(b, card, nodes)
    ends = _bush_ends(b, card, nodes)
    b.put("frame", kind, b.cell(card, kind, ends, name), frame)
    if source is not None and (mass := bush_mass(source)):
        b.properties[f"{name}_mass"] = made(source, PointMass, mass=mass * b.units.inertial / len(nodes))
        for node in nodes:
            b.cell(card, "vertex", [node], f"{name}_mass")


def _gap(b: Builder, card: Card) -> None:
    """CGAP: a spring with the stiffnesses of PGAP for a gap that is open or closed."""
    if b.gaps is None:
        raise card.error(
            "a gap is open or closed: write gaps = 'closed' or gaps = 'open' in [mesh] (read_mesh(gaps=...)), or leave "
            "it out by ignore = ['CGAP']"
        )
    nodes = [b.grids.node(card, k, end) for k, end in ((2, "GA"), (3, "GB"))]
    number = card.integer(1, "PID", card.id, lowest=1)
    name = f"pgap_{number}"
    source = b.tables.get("gap", {}).get(number)
    if source is None:
        raise card.error(f"property {number} is not in the deck; add its PGAP card")
    closed = source.real(3, "KA", 0.0)
    across = source.real(5, "KT", source.real(6, "MU1", 0.0) * closed)
    k = [closed, across, across] if b.gaps == "closed" else [source.real(4, "KB", 0.0), 0.0, 0.0]
    b.conversion.note(f"gaps (CGAP) are {b.gaps}, as asked")
    if any(k):
        b.properties[name] = spring(b.conversion, source, [*k, 0.0, 0.0, 0.0])
        b.put("frame", "line", b.cell(card, "line", nodes, name), _bush_axes(b, card, nodes))


def _bush_ends(b: Builder, card: Card, nodes: list[int]) -> list[int]:
    """Return the ends of the springs: new nodes on rigid arms where S1, S2, S3 of OCID place the elastic centre."""
    system = card.integer(9, "OCID", -1)
    if system < 0 or b.bare:
        return nodes
    [place] = b.grids.system(card, system).to_basic(card.reals(10, 3, "S")[None])
    ends = [b.point(place) for _ in nodes]
    for node, end in zip(nodes, ends, strict=True):
        b.links.append(Link(kind="rbe2", node=node, nodes=np.array([end])))
    return ends


def _bush_axes(b: Builder, card: Card, nodes: list[int]) -> np.ndarray:
    points = b.grids.points
    if card.text(7):
        return b.grids.system(card, card.integer(7, "CID", lowest=0)).axes_at(points[nodes[0]])
    axis = points[nodes[-1]] - points[nodes[0]]
    if not axis.any():
        raise card.error("its grids coincide or GB is blank and CID is missing; give CID, 0 for the basic system")
    if any(card.fields[4:7]):
        up = _up(b, card, nodes, "GGG", [])
        _turned(card, axis, up, 0.0)
    else:
        up = np.eye(3)[np.argmin(np.abs(axis))]
        b.conversion.note(f"{card.name} without CID or orientation: the axes across the line are chosen by the reader")
    z = np.cross(axis, up)
    frame = np.array([axis, np.cross(z, axis), z])
    return frame / np.linalg.norm(frame, axis=1, keepdims=True)


def _tube(b: Builder, card: Card) -> None:
    b.cell(card, "line", [b.grids.node(card, k, f"G{k - 1}") for k in (2, 3)], b.section(card, "tube"))


def _panel(b: Builder, card: Card) -> None:
    """CSHEAR: a sheet for the shear, and rods along its edges where PSHEAR has F1 or F2."""
    nodes = [b.grids.node(card, 2 + k, f"G{k + 1}") for k in range(4)]
    b.cell(card, "quad", nodes, b.section(card, "shear"))
    if b.bare:
        return
    source = b.tables["shear"][card.integer(1, "PID", card.id, lowest=1)]
    x = b.grids.points[nodes]
    sides = np.linalg.norm(np.roll(x, -1, axis=0) - x, axis=1)
    for k in (0, 1):  # F1 of the sides 1-2 and 3-4, F2 of the others
        if factor := source.real(4 + k, f"F{k + 1}", 0.0):
            name = f"cshear_{card.id}_f{k + 1}"
            b.properties[name] = flange(b.conversion, source, factor, (sides[1 - k] + sides[3 - k]) / 2)
            for i in (k, k + 2):
                b.cell(card, "line", [nodes[i], nodes[(i + 1) % 4]], name)


def _bend(b: Builder, card: Card) -> None:
    """CBEND: its arc is followed by short straight beams between new grids."""
    nodes = [b.grids.node(card, k, end) for k, end in ((2, "GA"), (3, "GB"))]
    name = b.section(card, "bend")
    if b.bare:
        raise card.error("its property is not in the deck; add its PBEND card")
    start, end = b.grids.points[nodes]
    centre, angle = _arc(b, card, start, end, _up(b, card, nodes, "GGG", []))
    first = start - centre
    ahead = np.cross(np.cross(first, end - centre) * np.sign(math.pi - angle), first)
    ahead *= np.linalg.norm(first) / np.linalg.norm(ahead)
    steps = angle * np.arange(CHORDS + 1) / CHORDS
    at = centre + np.cos(steps)[:, None] * first + np.sin(steps)[:, None] * ahead
    rows = [nodes[0], *(b.point(x) for x in at[1:-1]), nodes[1]]
    for k, pair in enumerate(pairwise(rows)):
        row = b.cell(card, "line", list(pair), name)
        up = at[k] + at[k + 1] - 2 * centre
        b.put("up", "line", row, up / np.linalg.norm(up))
    b.conversion.note(f"CBEND: the arc is followed by {CHORDS} straight beams between new grids")


def _arc(b: Builder, card: Card, start: np.ndarray, end: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, float]:
    """Return centre and angle of the arc by GEOM: v points to the centre (1), along the arc (2), or away (3, 4)."""
    geometry = card.integer(7, "GEOM", lowest=1)
    chord = end - start
    source = b.tables["bend"][card.integer(1, "PID")]
    half = np.linalg.norm(chord) / 2
    across = v - chord * (v @ chord) / (chord @ chord)
    if geometry > 4 or not np.linalg.norm(across) > 1e-9 * np.linalg.norm(v):
        raise card.error("GEOM is not 1 to 4, or the orientation lies along GA-GB; correct them")
    if geometry == 1:
        centre = start + v * (chord @ chord) / (2 * (v @ chord))
    elif geometry == 2:
        normal = chord - v * (v @ chord) / (v @ v)
        centre = start + normal * (chord @ chord) / (2 * (normal @ chord))
    elif geometry == 3:
        radius = source.real(6, "RB")
        if radius < half:
            raise card.error(f"RB = {radius:g} is less than half of the distance between its grids; correct it")
        centre = start + chord / 2 - across / np.linalg.norm(across) * math.sqrt(radius**2 - half**2)
    else:
        angle = math.radians(source.real(7, "THETAB"))
        if not 0 < angle < 2 * math.pi - 1e-6 or abs(angle - math.pi) < 1e-6:
            raise card.error("THETAB is not between 0 and 360, or 180; correct it")
        return start + chord / 2 - across / np.linalg.norm(across) * half / math.tan(angle / 2), angle
    return centre, 2 * math.asin(min(1.0, half / np.linalg.norm(start - centre)))


HANDLERS: dict[str, Callable[[Builder, Card], None]] = {
    **dict.fromkeys(SOLIDS, _solid),
    **dict.fromkeys(SHELLS, _shell),
    **{"CBAR": _bar, "CBEAM": _bar, "CROD": _rod, "CONROD": _conrod, "CTUBE": _tube, "CSHEAR": _panel},
    **{"CGAP": _gap, "CBUSH": _bush, "CBEND": _bend},
}
