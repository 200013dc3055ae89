"""Node sets, element sets and surfaces."""

from __future__ import annotations

import numpy as np

from modalprep.fe.mesh.cells import CELLS
from modalprep.fe.mesh.facets import boundary, corners, of_dimension
from modalprep.fe.readers.abaqus.deck import LABEL, Deck, Surface
from modalprep.fe.readers.abaqus.lexer import Block, Row

# Position in the table of faces of a cell (fe/mesh/cells.py) of the faces S1, S2, ... of the deck's elements.
FACES = {
    "tetra": (0, 1, 2, 3),
    "pyramid": (0, 1, 2, 3, 4),
    "wedge": (0, 1, 2, 3, 4),
    "hexahedron": (4, 5, 2, 1, 3, 0),
}


def node_or_element_set(deck: Deck, block: Block) -> None:
    """``*NSET`` and ``*ELSET``; with INSTANCE the numbers are those of the instance."""
    kind = block.keyword
    name = block.option(kind)
    scope = block.options.get("INSTANCE", "").upper()
    if scope and scope not in deck.parts.moves:
        block.refuse(f"names the instance {block.options['INSTANCE']}, which is not in the deck; correct it")
    members = deck.members(kind, block.scope, name)
    scope = scope or block.scope
    if "INTERNAL" in block.options:
        deck.internal.add((kind, (block.scope, name.upper())))
    if kind == "NSET" and block.options.get("ELSET"):
        members.append((scope, (block.options["ELSET"],)))
    if block.numbers and "GENERATE" not in block.options and not (block.numbers.values < 0).any():
        values = block.numbers.values
        members.append((scope, values[~np.isnan(values)].astype(int)))
        block.numbers = None  # their memory is free
        return
    for row in block.rows:
        fields = [f for f in row.fields if f]
        if "GENERATE" in block.options:
            members.append((scope, _range(row, fields)))
        else:
            members += [(scope, int(f) if LABEL.fullmatch(f) else f) for f in fields]


def _range(row: Row, fields: list[str]) -> range:
    numbers = [int(f) for f in fields if LABEL.fullmatch(f)]
    if len(numbers) < len(fields) or not 2 <= len(numbers) <= 3 or numbers[2:] == [0]:
        raise row.error(f"GENERATE needs first, last and step; it has {', '.join(fields)}")
    return range(numbers[0], numbers[1] + 1, *numbers[2:])


def surface(deck: Deck, block: Block) -> None:
    """``*SURFACE``: kept until a constraint names it."""
    deck.surfaces.setdefault((block.scope, block.option("NAME").upper()), []).append(block)


def surface_of(deck: Deck, block: Block, name: str) -> Surface:
    """Return the faces and nodes of a surface, or of a node or an element set of that name."""
    key = deck.find(deck.surfaces, block.scope, name)
    if key is None and deck.find(deck.sets["NSET"], block.scope, name):
        return Surface([], deck.nodes_of(block, block.scope, name))
    if key is None and deck.find(deck.sets["ELSET"], block.scope, name):
        return Surface([(one, "") for one in deck.elements_of(block, block.scope, name)], [])
    if key is None:
        block.refuse(f"names the surface {name!r}, which is not in the deck; correct the name")
    found = Surface([], [])
    for own in deck.surfaces[key]:
        kind = own.choice("TYPE", "ELEMENT")
        if kind not in ("ELEMENT", "NODE") or "COMBINE" in own.options:
            own.refuse(f"of TYPE={kind} or with COMBINE is not read; give faces of elements or nodes")
        for row in own.rows:
            if kind == "NODE":
                found.nodes.extend(deck.nodes_of(row, own.scope, row.text(0)))
            else:
                of = deck.elements_of(row, own.scope, row.text(0)) if row.text(0) else list(deck.elements)
                found.faces.extend((one, row.text(1).upper()) for one in of)
    return found


def surface_nodes(deck: Deck, block: Block, name: str) -> list[int]:
    """Return the indices of the nodes of a surface, each once."""
    found = surface_of(deck, block, name)
    nodes = [node for corners in faces_of(deck, block, found) for node in corners[1]]
    return list(dict.fromkeys([*found.nodes, *nodes]))


def faces_of(deck: Deck, block: Block, surface: Surface) -> list[tuple[str, list[int]]]:
    """Return the faces of a surface as cells: their kind and their nodes."""
    found = []
    for key, side in surface.faces:
        for kind, row in deck.elements[key].cells:
            cell = CELLS[kind]
            nodes = deck.cells[kind][row]
            if cell.dimension < 3:
                if side not in ("", "SPOS", "SNEG", "S1", "S2") and cell.dimension == 2:
                    block.refuse(f"uses the edge {side} of element {key[1]}; give faces or nodes")
                found.append((kind, nodes))
            elif side:
                found.append(face_of(block, kind, nodes, side, key[1]))
            else:
                found += _outer(deck, key, kind, nodes)
    return found


def face_of(block: Block, kind: str, nodes: list[int], side: str, label: int) -> tuple[str, list[int]]:
    """Return the cell and the nodes of the face of a solid that the deck calls S1, S2, ..."""
    cell = CELLS[kind]
    order = FACES.get(cell.shape, ())
    number = int(side[1:]) if side[:1] == "S" and side[1:].isdigit() else 0
    if not 1 <= number <= len(order):
        block.refuse(f"uses the face {side} of element {label}, which has S1 to S{len(order)}; correct the surface")
    return face_cell(kind, nodes, order[number - 1])


def face_cell(kind: str, nodes: list[int], number: int) -> tuple[str, list[int]]:
    """Return the cell and the nodes of face `number` of a volume, with the middles of its edges."""
    name, own = CELLS[kind].face(number)
    return name, [nodes[k] for k in own]


def _outer(deck: Deck, key, kind: str, nodes: list[int]) -> list[tuple[str, list[int]]]:
    """Return the faces of a volume that no other volume has."""
    if "outer" not in deck.current:
        cells = {other: np.array(conn) for other, conn in deck.cells.items()}
        skin = corners(boundary(of_dimension(cells, 3)).items())
        deck.current["outer"] = set(map(frozenset, skin.tolist()))
    numbers = [k for k, face in enumerate(CELLS[kind].faces) if {nodes[c] for c in face} in deck.current["outer"]]
    return [face_cell(kind, nodes, k) for k in numbers]
