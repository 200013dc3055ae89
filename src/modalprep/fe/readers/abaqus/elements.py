"""Element types of a deck, and the elements: listed, generated and copied."""

from __future__ import annotations

import re
from collections import Counter
from typing import NamedTuple

import numpy as np

from modalprep.fe.mesh.cells import CELLS
from modalprep.fe.mesh.tables import Table
from modalprep.fe.readers.abaqus.deck import LABEL, Deck
from modalprep.fe.readers.abaqus.geometry import label_of
from modalprep.fe.readers.abaqus.lexer import Block, Numbers, Row
from modalprep.fe.readers.abaqus.numbered import Element, ElementBlock, Key
from modalprep.fe.readers.abaqus.superelements import FAMILY, user_elements
from modalprep.fe.readers.coverage import Entry, Treatment

MOST = 1_000_000  # elements that one line may make
SHELL = "The shell is that of theory 7; CalculiX makes solids of shells."
PLANE = "With a section it is a shell of its thickness, which also bends; the supports 'plane' keep it in its plane."
SURFACE = "Without a section it is a group of surface cells, with one it is refused."
BY_MASS = "Its mass has the points of its stiffness, as in CalculiX; where the deck proves to be one of Abaqus, more."


class Type(NamedTuple):
    """What elements of a type are: a family of sections, a cell, and the types of the deck."""

    family: str
    cell: str
    names: str  # regular expression
    entry: Entry


def _type(family: str, cell: str, names: str, remark: str = "", treatment: Treatment | None = None) -> Type:
    return Type(family, cell, names, Entry(treatment or ("approximated" if remark else "read"), remark))


TYPES: dict[str, Type] = {
    "C3D4": _type("solid", "tetra", "C3D4H?T?"),
    "C3D5": _type("solid", "pyramid", "C3D5H?"),
    "C3D6": _type("solid", "wedge", "C3D6H?T?"),
    "C3D8": _type(
        "solid",
        "hexahedron",
        "C3D8(H|T|S|HS)?",
        "It has nine incompatible modes here, and a consistent mass, which Abaqus lumps.",
    ),
    "C3D8I": _type("solid", "hexahedron", "C3D8IH?", "Its incompatible modes are those of our hexahedron."),
    "C3D8R": _type(
        "solid",
        "hexahedron",
        "C3D8R[HT]?",
        "It has 2 x 2 x 2 points and nine incompatible modes here, and no hourglasses: it is that of C3D8I.",
    ),
    "C3D10": _type("solid", "tetra10", "C3D10(H|T|M|MH|I|HS|R|MT)?"),
    "C3D15": _type("solid", "wedge15", "C3D15H?", BY_MASS, "read"),
    "C3D20": _type("solid", "hexahedron20", "C3D20[HT]?"),
    "C3D20R": _type("solid", "hexahedron20", "C3D20R[HT]?", BY_MASS, "read"),
    "S3, S3R": _type("shell", "triangle", "S3R?S?T?|STRI3|DS3", SHELL),
    "S4, S4R, S4R5": _type("shell", "quad", "S4R?5?S?W?T?|DS4", SHELL),
    "S6, STRI65": _type("shell", "triangle6", "S6R?|STRI65|DS6", SHELL),
    "S8, S8R, S8R5": _type("shell", "quad8", "S8R?5?T?|DS8", SHELL),
    "S9R5": _type("shell", "quad9", "S9R5"),
    "B31": _type(
        "beam",
        "line",
        "B31R?H?|PIPE31H?",
        "The beam is exact in statics and its mass consistent, where Abaqus lumps it and CalculiX makes solids of it.",
    ),
    "U1": _type("beam", "line", "U1"),
    "B31OS": _type("beam", "line", "B31OSH?", "Warping of the section is left out."),
    "B32OS": _type(
        "beam", "line3", "B32OSH?", "Two straight beams through its middle node; warping of the section is left out."
    ),
    "B32": _type("beam", "line3", "B32R?H?|PIPE32H?", "Two straight beams through its middle node."),
    "B33": _type("beam", "line", "B33H?"),
    "T3D2": _type("truss", "line", "T3D2[HT]?"),
    "T3D3": _type("truss", "line3", "T3D3[HT]?", "Two straight bars through its middle node."),
    "MASS": _type("mass", "vertex", "MASS"),
    "ROTARYI": _type("rotary inertia", "vertex", "ROTARYI"),
    "SPRINGA": _type("spring", "line", "SPRINGA"),
    "SPRING1": _type("spring", "vertex", "SPRING1"),
    "SPRING2": _type(
        "spring", "line", "SPRING2", "Between distant nodes it acts through rigid arms to the middle between them."
    ),
    "DASHPOTA": _type("dashpot", "line", "DASHPOTA"),
    "DASHPOT1": _type("dashpot", "vertex", "DASHPOT1"),
    "DASHPOT2": _type(
        "dashpot", "line", "DASHPOT2", "Between distant nodes it acts through rigid arms to the middle between them."
    ),
    "DCOUP3D": _type("coupling", "", "DCOUP3D", "Its node is that of its *DISTRIBUTING COUPLING.", "read"),
    "R3D3, R3D4, RB3D2": _type("rigid", "", "R3D[34]|RB3D2", "Its nodes are those of its *RIGID BODY.", "read"),
    "CPS3": _type("plane stress", "triangle", "CPS3[HT]?", PLANE),
    "CPE3, M3D3, SFM3D3": _type("surface", "triangle", "(CPE|M3D|SFM3D|DC2D)3[HT]?", SURFACE),
    "CPS4": _type("plane stress", "quad", "CPS4[RIHT]?", PLANE),
    "CPE4, M3D4, SFM3D4": _type("surface", "quad", "(CPE|M3D|SFM3D|DC2D)4[RIHT]?", SURFACE),
    "CPS6": _type("plane stress", "triangle6", "CPS6[MHT]?", PLANE),
    "CPE6, M3D6, SFM3D6": _type("surface", "triangle6", "(CPE|M3D|SFM3D|DC2D)6[MHT]?", SURFACE),
    "CPS8": _type("plane stress", "quad8", "CPS8[RHT]?", PLANE),
    "CPE8, M3D8, SFM3D8": _type("surface", "quad8", "(CPE|M3D|SFM3D|DC2D)8[RHT]?", SURFACE),
}
WITHOUT_COUNTERPART = {  # names: what to do instead
    "CAX4": ("C?G?AX.*|S?M?AX.*", "It is axisymmetric; mesh the whole body, with C3D8 or S4."),
    "CONN3D2": ("CONN.*", "Connectors are joints; give the joint in the system."),
    "GAPUNI": ("GAP.*", "A gap is open or closed; ignore it, or tie its nodes by *MPC or *SPRING."),
    "Z1": (
        r"Z\d+",
        "It is a substructure; read its .mtx file as a body, and join the bodies by [welds], or give it as a linear "
        "*USER ELEMENT with *MATRIX.",
    ),
    "U2": (
        r"U[2-9]\d*|U1\d+|US\d",
        "Its *USER ELEMENT is not there or a subroutine; give a linear one with *MATRIX, or read the matrices of the "
        "whole body by [matrices].",
    ),
}
INCOMPATIBLE = (
    "have incompatible modes here, and no hourglasses: a plate in one layer has its first frequency 0.1 % high, where "
    "CalculiX' C3D8R has it 69 % low, in two layers 0.5 % high and 8 % low"
)
EXPANDED = (
    "are shells here: a plate of 8 x 4 has its first frequency right to 0.1 %, where CalculiX, which makes C3D8R of "
    "them, has it 35 % high"
)
STEP = 2**13  # elements whose nodes are looked for in one go
REDUCED = re.compile("C3D20R.*|C3D15.*")
COLLAPSED = {  # cells whose corners fall together: which are left, of which cell
    ("hexahedron", (0, 1, 2, 2, 4, 5, 6, 6)): ("wedge", (0, 1, 2, 4, 5, 6)),
    ("hexahedron", (0, 0, 2, 3, 4, 4, 6, 7)): ("wedge", (0, 2, 3, 4, 6, 7)),
    ("hexahedron", (0, 1, 2, 2, 4, 4, 4, 4)): ("tetra", (0, 1, 2, 4)),
    ("hexahedron", (0, 1, 2, 3, 4, 4, 4, 4)): ("pyramid", (0, 1, 2, 3, 4)),
    ("quad", (0, 1, 2, 2)): ("triangle", (0, 1, 2)),
    ("quad", (0, 1, 2, 0)): ("triangle", (0, 1, 2)),
    ("quad", (0, 0, 2, 3)): ("triangle", (0, 2, 3)),
    ("quad", (0, 1, 1, 3)): ("triangle", (0, 1, 3)),
    ("wedge", (0, 1, 2, 3, 3, 3)): ("tetra", (0, 1, 2, 3)),
}


def type_of(name: str) -> Type | None:
    """Return the record of an element type; None when it has no counterpart.

    Examples
    --------
    >>> type_of("C3D20R").cell, type_of("CONN3D2")
    ('hexahedron20', None)
    """
    text = name.upper().replace(" ", "")
    return next((one for one in TYPES.values() if re.fullmatch(one.names, text)), None)


def elements(deck: Deck, block: Block) -> None:
    """``*ELEMENT``."""
    given = block.option("TYPE").upper().replace(" ", "")
    if user_elements(deck, block, given):
        return
    known = type_of(given)
    if known is None:
        if block.rows:
            why = [text for names, text in WITHOUT_COUNTERPART.values() if re.fullmatch(names, given)]
            advice = why[0] if why else f"known are {', '.join(TYPES)}"
            raise block.row().error(f"element type {given!r} has no counterpart here; {advice[0].lower()}{advice[1:]}")
        return
    count = _count(known, given)
    if block.numbers and (keys := add_many(deck, block, block.numbers, given, known)) is not None:
        if block.options.get("ELSET"):
            deck.members("ELSET", block.scope, block.options["ELSET"]).append((block.scope, keys))
        block.numbers = None  # their memory is free
        return
    for row in block.joined_by(count + 1):
        label = _add(deck, row, block.scope, given, known, count)
        if block.options.get("ELSET"):
            deck.members("ELSET", block.scope, block.options["ELSET"]).append((block.scope, label))


def add_many(deck: Deck, block: Block, numbers: Numbers, given: str, known: Type) -> list[Key] | None:
    """Add elements whose lines are numbers, and return their keys; None where one asks for a look of its own."""
    if known.cell in ("", "line3"):
        return None
    found = _in_rows(numbers, CELLS[known.cell].count + 1)
    if found is None:
        return None
    table, height = found
    if (table < 0).any():
        return None
    nodes = np.empty((len(table), table.shape[1] - 1), dtype=int)
    for k in range(0, len(table), STEP):
        found_nodes = deck.numbered.find(block.scope, table[k : k + STEP, 1:].astype(int))
        order = np.sort(found_nodes, axis=1)
        if (order[:, 0] < 0).any() or (order[:, 1:] == order[:, :-1]).any():
            return None
        nodes[k : k + STEP] = found_nodes
    labels = table[:, 0].astype(int)
    if len(np.unique(labels)) < len(labels):
        return None
    keys = [(block.scope, label) for label in labels.tolist()]
    if any(key in deck.elements for key in keys):
        return None
    if known.cell not in deck.cells:
        deck.cells[known.cell] = Table(nodes.shape[1])
    rows = deck.cells[known.cell].extend(nodes)
    lines = numbers.first + 1 + height * np.arange(len(keys))
    deck.elements.add_block(keys, ElementBlock(given, known.family, nodes, block.file, lines, known.cell, rows))
    if REDUCED.fullmatch(given):
        value = np.asarray(1.0 if deck.spoken.dialect == "abaqus" else 2.0)
        deck.data.setdefault(("integration", known.cell), {}).update(dict.fromkeys(rows, value))
    return keys


def _in_rows(numbers: Numbers, width: int) -> tuple[np.ndarray, int] | None:
    """Return the numbers (n, width) of elements that have as many lines each, and how many; None of all others.

    Every line of an element but its last one ends in a comma.
    """
    blank = np.isnan(numbers.values)
    ends = np.cumsum(numbers.counts)
    open_ = blank[ends - 1]
    filled = numbers.counts - open_
    total = np.cumsum(filled)
    height = int(np.searchsorted(total, width)) + 1
    if not blank.any() and (numbers.counts == width).all():
        return numbers.values.reshape(-1, width), 1
    if np.count_nonzero(blank) > np.count_nonzero(open_) or len(filled) % height:
        return None
    if (filled.reshape(-1, height).sum(axis=1) != width).any() or not open_.reshape(-1, height)[:, :-1].all():
        return None
    return numbers.values[~blank].reshape(-1, width), height


def _count(known: Type, given: str) -> int:
    if known.family == "rigid":
        return int(given[-1])
    if known.family == "coupling":
        return 1
    return CELLS[known.cell].count


def _add(deck: Deck, row: Row, scope: str, given: str, known: Type, count: int) -> int:
    label = label_of(row, 0, "element")
    if len(row.fields) < count + 1:
        raise row.error(
            f"element {', '.join(row.fields)} of type {given} needs a number and {count} nodes; export again"
        )
    own = row.fields[1 : count + 1]
    more = row.fields[count + 1 :]
    found = [deck.nodes.get((scope, int(text))) if text.isdecimal() else None for text in own]
    nodes = [_node(deck, row, scope, label, own[k]) if node is None else node for k, node in enumerate(found)]
    extra = [_node(deck, row, scope, label, text) for text in more[:1]] if known.family == "beam" else []
    if more[len(extra) :]:
        deck.skipped.append((f"extra nodes in *ELEMENT, TYPE={given}", f"line {row.line}"))
    element = Element(given, known.family, tuple(nodes), row, (), tuple(extra))
    place(deck, row, scope, label, element, known.cell)
    return label


def _node(deck: Deck, row: Row, scope: str, label: int, text: str) -> int:
    of, name = deck.split(scope, text)
    if not LABEL.fullmatch(name):
        raise row.error(f"element {label} has the node {text!r}, which is no number; repair the line")
    if (of, int(name)) not in deck.nodes:
        raise row.error(f"element {label} refers to node {text}, which is not there; export it again")
    return deck.nodes[of, int(name)]


def place(deck: Deck, row: Row, scope: str, label: int, element: Element, cell: str) -> None:
    """Add an element with its cells; one with nodes that fall together becomes the cell that is left."""
    if not deck.add_element(row, scope, label, element) or not cell:
        return
    nodes = list(element.nodes)
    if cell == "line3":  # Abaqus lists the middle node second
        cells = [("line", nodes[:2]), ("line", nodes[1:])]
    elif len(set(nodes)) < len(nodes):
        pattern = tuple(nodes.index(node) for node in nodes)
        if (cell, pattern) not in COLLAPSED:
            raise row.error(f"element {label} names a node twice; give every corner its own node")
        kind, left = COLLAPSED[cell, pattern]
        cells = [(kind, [nodes[k] for k in left])]
    else:
        cells = [(cell, nodes)]
    made = tuple(deck.cell(kind, own) for kind, own in cells)
    if REDUCED.fullmatch(element.type):
        deck.put("integration", made[0], 1.0 if deck.spoken.dialect == "abaqus" else 2.0)
    deck.elements[scope, label] = element._replace(cells=made)


def note_others(deck: Deck) -> None:
    """Say which elements differ much from those of the deck's program: frequencies of clamped plates."""
    count: Counter[str] = Counter()
    for name, number in deck.elements.types():
        count[name] += number
    if count["C3D8R"]:
        deck.note(f"{count['C3D8R']} elements of C3D8R {INCOMPATIBLE}")
    if count["S4R"] and deck.spoken.dialect == "calculix":
        deck.note(f"{count['S4R']} elements of S4R {EXPANDED}")


def elgen(deck: Deck, block: Block) -> None:
    """``*ELGEN``: rows, columns and layers of elements like a first one."""
    scope = block.scope
    for row in block.rows:
        label = label_of(row, 0, "element")
        if (scope, label) not in deck.elements:
            raise row.error(f"element {label} is not there; list it before it is repeated")
        master = deck.elements[scope, label]
        sizes = [
            (
                row.integer(k, "a number of elements", 1) or 1,
                row.integer(k + 1, "a step", 1) or 1,
                row.integer(k + 2, "a step", 1) or 1,
            )
            for k in (1, 4, 7)
        ]
        counts = [count for count, _, _ in sizes]
        if min(counts) < 1 or counts[0] * counts[1] * counts[2] > MOST:
            raise row.error(f"{' x '.join(map(str, counts))} elements cannot be made; correct the numbers")
        for i in range(counts[0]):
            for j in range(counts[1]):
                for k in range(counts[2]):
                    nodes, own = (sum(n * size[m] for n, size in zip((i, j, k), sizes, strict=True)) for m in (1, 2))
                    _repeat(deck, row, scope, (label, master), nodes, own)
                    if block.options.get("ELSET"):
                        deck.members("ELSET", scope, block.options["ELSET"]).append((scope, label + own))


def elcopy(deck: Deck, block: Block) -> None:
    """``*ELCOPY``: copies of a set on nodes whose numbers are shifted."""
    if "REFLECT" in block.options:
        block.refuse("with REFLECT is not read; list the elements")
    shifts = []
    for name in ("SHIFT NODES", "ELEMENT SHIFT"):
        shifts.append(Row([block.option(name)], block.file, block.line).integer(0, name))
    row = Row([], block.file, block.line)
    for scope, label in deck.elements_of(block, block.scope, block.option("OLD SET")):
        _repeat(deck, row, scope, (label, deck.elements[scope, label]), *shifts)
        if block.options.get("NEW SET"):
            deck.members("ELSET", scope, block.options["NEW SET"]).append((scope, label + shifts[1]))


def _repeat(deck: Deck, row: Row, scope: str, source: tuple[int, Element], nodes: int, own: int) -> None:
    label, master = source
    if not own:
        return
    if master.family == FAMILY:
        raise row.error(f"element {label} is one of matrices, which are not repeated; list its copies")
    moved = []
    for node in (*master.nodes, *master.extra):
        of, number = deck.keys[node]
        if (of, number + nodes) not in deck.nodes:
            raise row.error(f"element {label + own} needs node {number + nodes}, which is not there; add the node")
        moved.append(deck.nodes[of, number + nodes])
    count = len(master.nodes)
    known = type_of(master.type)
    element = Element(master.type, master.family, tuple(moved[:count]), row, (), tuple(moved[count:]))
    place(deck, row, scope, label + own, element, known.cell if known else "")
