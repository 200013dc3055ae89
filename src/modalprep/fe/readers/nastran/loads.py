"""Nastran static loads: forces and moments at grids, pressures on faces, gravity, and their combinations."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.mesh.cells import CELLS
from modalprep.fe.mesh.face_forces import LoadedFace
from modalprep.fe.readers.loads import DeckLoad
from modalprep.fe.readers.nastran.beam_loads import add_beam_load
from modalprep.fe.readers.nastran.builder import Builder
from modalprep.fe.readers.nastran.cards import Card


def add_loads(b: Builder) -> dict[int, DeckLoad]:
    """Give the mesh each set of loads as ``load_1``, and return the sets by number; what cannot be read is noted."""
    found: dict[int, DeckLoad] = {}
    for card in (card for name in (*READ, *UNREAD, "LOAD") for card in b.tables.get(name, {}).values()):
        load = found.setdefault(card.id, DeckLoad())
        try:
            if card.name == "LOAD":
                _combine(card, load, found)
            elif card.name in READ:
                READ[card.name](b, card, load)
            else:
                load.unread.append((card.name, f"{card.file} line {card.line}"))
        except InputError as error:
            load.unread.append((card.name, str(error)))
    points = np.vstack([b.grids.points, *b.more_points])
    for number, load in found.items():
        load.gravity = load.gravity * b.units.length
        loads = load.in_si(points, b.units)
        if not loads.is_zero:
            b.loads[f"load_{number}"] = loads
    return found


def _combine(card: Card, load: DeckLoad, found: dict[int, DeckLoad]) -> None:
    """LOAD: a factor of all, then a factor and the number of each."""
    for k in range(2, len(card.fields), 2):
        if card.text(k + 1):
            part = found.get(card.integer(k + 1, "a load"))
            if part is None:
                raise card.error(f"load {card.text(k + 1)} is not in the deck")
            load.add(part, card.real(1, "S") * card.real(k, "a factor"))


def _at_grid(b: Builder, card: Card, load: DeckLoad) -> None:
    """FORCE and MOMENT: G, CID, F, N; along the axes of CID where the grid is."""
    if b.grids.is_scalar(card.integer(1, "G", lowest=1)):
        load.unread.append((f"{card.name} at a scalar point", f"{card.file} line {card.line}"))
        return
    node = b.grids.node(card, 1, "G")
    system = b.grids.system(card, card.integer(2, "CID", 0, lowest=0))
    _add(card, load, node, card.real(3, "F") * card.reals(4, 3, "N") @ system.axes_at(b.grids.points[node]))


def _by_grids(b: Builder, card: Card, load: DeckLoad) -> None:
    """FORCE1, MOMENT1 along G1 to G2; FORCE2, MOMENT2 along the product of G1 to G2 and G3 to G4."""
    node = b.grids.node(card, 1, "G")
    at = [b.grids.points[b.grids.node(card, k, f"G{k - 2}")] for k in range(3, 5 if card.name[-1] == "1" else 7)]
    along = at[1] - at[0] if len(at) == 2 else np.cross(at[1] - at[0], at[3] - at[2])
    size = np.linalg.norm(along)
    if not size > 0:
        raise card.error("its grids give no direction; correct them")
    _add(card, load, node, card.real(2, "F") * along / size)


def _add(card: Card, load: DeckLoad, node: int, vector: np.ndarray) -> None:
    first = 3 * card.name.startswith("MOMENT")
    load.terms += [(node, first + k, float(value)) for k, value in enumerate(vector)]


def _on_grids(b: Builder, card: Card, load: DeckLoad) -> None:
    """PLOAD: a pressure on the face of three or four grids, along their right-hand normal."""
    nodes = [b.grids.node(card, k, f"G{k - 1}") for k in range(2, 6) if card.text(k)]
    kind = {3: "triangle", 4: "quad"}[max(3, len(nodes))]
    load.faces.append(LoadedFace(kind, nodes, np.full(len(nodes), card.real(1, "P"))))


def _on_shells(b: Builder, card: Card, load: DeckLoad) -> None:
    """PLOAD2: a pressure on elements of shells, along their normals."""
    for number in card.numbers(2, "an element", np.array(sorted(b.places))):
        kind, nodes = _shell_or_solid(b, card, number)
        load.faces.append(LoadedFace(kind, nodes, np.full(len(CELLS[kind].corners), card.real(1, "P"))))


def _on_elements(b: Builder, card: Card, load: DeckLoad) -> None:
    """PLOAD4: pressures at the corners of a face; into solids, along the normals of shells, or along a direction."""
    if card.text(12) == "LINE":
        raise card.error("a load along the edges of elements (SORL = LINE) is not read; give forces of grids")
    numbers = [card.integer(1, "EID", lowest=1)]
    if card.text(6) == "THRU":
        last = card.integer(7, "EID2", lowest=1)
        numbers = [number for number in sorted(b.places) if numbers[0] <= number <= last]
    first = card.real(2, "P1", 0.0)
    corners = np.array([card.real(k, "P", first) for k in range(2, 6)])
    n = card.reals(9, 3, "N")
    size = np.linalg.norm(n)
    system = b.grids.system(card, card.integer(8, "CID", 0, lowest=0))
    for number in numbers:
        kind, nodes = _shell_or_solid(b, card, number)
        pressure = corners[: len(CELLS[kind].corners)]
        if CELLS[kind].dimension == 3:
            kind, nodes = _loaded_face(b, card, kind, nodes)
            pressure = np.full(len(CELLS[kind].corners), first if size else -first)
            if (corners != first).any():
                load.unread.append(("different pressures at corners of solids", f"{card.file} line {card.line}"))
        along = n / size @ system.axes_at(b.grids.points[nodes[0]]) if size else None
        load.faces.append(LoadedFace(kind, nodes, pressure, along))


def _shell_or_solid(b: Builder, card: Card, number: int) -> tuple[str, list[int]]:
    """Return the cell of an element that has a face."""
    for _, kind, row in b.places.get(number, []):
        if CELLS[kind].dimension > 1:
            return kind, b.cells[kind][row]
    raise card.error(f"element {number} is no shell and no solid of the deck")


def _loaded_face(b: Builder, card: Card, kind: str, nodes: list[int]) -> tuple[str, list[int]]:
    """Return the face of a solid by G1, and G3 diagonally opposite, or G4 of a tetrahedron beside the face."""
    first = b.grids.node(card, 6, "G1")
    other = b.grids.node(card, 7, "G3 or G4") if card.text(7) else None
    for number, corners in enumerate(CELLS[kind].faces):
        own = [nodes[k] for k in corners]
        if first not in own:
            continue
        if CELLS[kind].shape == "tetra":
            there = other not in own
        else:
            there = len(own) == 3 if other is None else other in own and abs(own.index(first) - own.index(other)) == 2
        if there:
            face, places = CELLS[kind].face(number)
            return face, [nodes[k] for k in places]
    raise card.error("G1 and G3 or G4 name no face of the element; correct them")


def _gravity(b: Builder, card: Card, load: DeckLoad) -> None:
    """GRAV: CID, A, N."""
    system = b.grids.system(card, card.integer(1, "CID", 0, lowest=0))
    load.gravity = load.gravity + card.real(2, "A") * card.reals(3, 3, "N") @ system.axes_at(np.zeros(3))


READ: dict[str, Callable[[Builder, Card, DeckLoad], None]] = {
    **dict.fromkeys(("FORCE", "MOMENT"), _at_grid),
    **dict.fromkeys(("FORCE1", "FORCE2", "MOMENT1", "MOMENT2"), _by_grids),
    "PLOAD": _on_grids,
    "PLOAD1": add_beam_load,
    "PLOAD2": _on_shells,
    "PLOAD4": _on_elements,
    "GRAV": _gravity,
}
UNREAD = ("PLOADX1", "RFORCE", "ACCEL", "ACCEL1", "SPCD", "SLOAD", "DEFORM")
LISTS = (*READ, "LOAD")
