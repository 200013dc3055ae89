"""Elements of a deck that are matrices: linear user elements, and matrices that are assembled into the model."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array

from modalprep.errors import InputError
from modalprep.fe.readers.abaqus.deck import Deck
from modalprep.fe.readers.abaqus.geometry import label_of
from modalprep.fe.readers.abaqus.lexer import Block, Row
from modalprep.fe.readers.abaqus.matrices import packed, read_abaqus_matrix
from modalprep.fe.readers.abaqus.numbered import Element
from modalprep.fe.readers.entries import Labelled, integers, labelled, mirrored
from modalprep.fe.readers.matrix_elements import matrix_element

FAMILY = "matrix"
KINDS = ("STIFFNESS", "MASS")
DAMPING = ("VISCOUS DAMPING", "STRUCTURAL DAMPING")
INSTEAD = "read the matrices of a body that has user elements by [matrices] or as [body] file"


class UserElement(NamedTuple):
    """A type of linear user elements: its nodes, place in the list and component (0 to 5) of each DOF, matrices."""

    nodes: int
    dofs: list[tuple[int, int]]
    full: bool
    matrices: dict[str, csr_array]


def user_element(deck: Deck, block: Block) -> None:
    """``*USER ELEMENT``: a linear one, whose matrices follow, or CalculiX' beam U1, which is known."""
    kind = block.choice("TYPE").replace(" ", "")
    if block.options.get("FILE"):
        block.refuse(
            f"reads a file of results of Abaqus ({block.options['FILE']}), which is binary; write its matrices as text "
            "by *SUBSTRUCTURE MATRIX OUTPUT, OUTPUT FILE=USER DEFINED, and give them by *MATRIX"
        )
    if "LINEAR" not in block.options:
        if kind != "U1":
            block.refuse(f"of TYPE={kind} is a subroutine, not matrices; {INSTEAD}")
        return
    if not re.fullmatch(r"U\d+", kind):
        block.refuse("has no TYPE such as U7; give it one, and list its nodes by *ELEMENT of this type")
    count = Row([block.option("NODES")], block.file, block.line).integer(0, "NODES")
    dofs = _dofs(block, count)
    deck.tables.setdefault("user element", {})["", kind] = UserElement(count, dofs, "UNSYMM" in block.options, {})


def _dofs(block: Block, count: int) -> list[tuple[int, int]]:
    """Return place of the node (from 0) and component of each DOF; a line changes them from a node on."""
    lists: dict[int, list[int]] = {}
    for k, row in enumerate(row for row in block.rows if row.text(0)):
        numbers = [row.integer(i, "a DOF") for i in range(len(row.fields)) if row.text(i)]
        node, dofs = (0, numbers) if k == 0 else (numbers[0] - 1, numbers[1:])
        if not 0 <= node < count or not dofs or min(dofs) < 1 or max(dofs) > 6:
            raise row.error(f"*USER ELEMENT has DOFs 1 to 6 of nodes 1 to {count}; correct the line")
        lists[node] = dofs
    if 0 not in lists:
        block.refuse("has no DOFs of its first node; list them in the line that follows")
    found, current = [], lists[0]
    for node in range(count):
        current = lists.get(node, current)
        found += [(node, dof - 1) for dof in current]
    return found


def matrix(deck: Deck, block: Block) -> None:
    """``*MATRIX``: stiffness or mass of the user element before it, packed row by row."""
    kind = block.choice("TYPE")
    owner = block.owner
    types = deck.tables.get("user element", {})
    own = types.get(("", owner.choice("TYPE").replace(" ", ""))) if owner else None
    if own is None or kind not in KINDS:
        block.refuse(f"of TYPE={kind} does not follow a linear *USER ELEMENT, or is not one of {', '.join(KINDS)}")
    values = [row.real(k, "an entry") for row in block.rows for k in range(len(row.fields)) if row.text(k)]
    try:
        own.matrices[kind] = packed(np.array(values), len(own.dofs), own.full)
    except ValueError as error:
        raise block.error(f"{error}; export it again") from None


def user_elements(deck: Deck, block: Block, kind: str) -> bool:
    """Read ``*ELEMENT`` of a linear user element; return whether it is one."""
    own: UserElement | None = deck.tables.get("user element", {}).get(("", kind))
    if own is None:
        return False
    for row in block.joined_by(own.nodes + 1):
        _place(deck, block, row, kind, own)
    return True


def _place(deck: Deck, block: Block, row: Row, kind: str, own: UserElement) -> None:
    label = label_of(row, 0, "element")
    if len(row.fields) != own.nodes + 1:
        raise row.error(f"element {label} of type {kind} has {len(row.fields) - 1} nodes, not {own.nodes}; correct it")
    nodes = tuple(deck.node(row, block.scope, text) for text in row.fields[1:])
    cells = tuple(deck.cell("vertex", [node]) for node in nodes)
    if not deck.add_element(row, block.scope, label, Element(kind, FAMILY, nodes, row, cells)):
        return
    if block.options.get("ELSET"):
        deck.members("ELSET", block.scope, block.options["ELSET"]).append((block.scope, label))
    if not own.matrices:
        raise row.error(f"element {label} of type {kind} has no *MATRIX; add its stiffness or mass")
    rows = np.array([(nodes[place], component) for place, component in own.dofs])
    if block.scope:
        _refuse_turned_part(deck, block)
    K, M = (_in_order(own.matrices.get(which), rows) for which in KINDS)
    _add(deck, row, K, M, f"user element {label} ({kind})")


def _refuse_turned_part(deck: Deck, block: Block) -> None:
    turn, _ = deck.parts.moves.get(block.scope, (np.eye(3), None))
    if not np.allclose(turn, np.eye(3), atol=1e-9):
        block.refuse("of a linear user element stands in an instance that is turned; put it into the assembly")


def _in_order(A: csr_array | None, rows: np.ndarray) -> Labelled | None:
    """Return a matrix by nodes and components; a node that stands twice in the element has one row."""
    if A is None:
        return None
    at = A.tocoo()
    return labelled(rows[at.row], rows[at.col], at.data) if at.nnz else None


def matrix_input(deck: Deck, block: Block) -> None:
    """``*MATRIX INPUT``: entries ``node, dof, node, dof, value`` of one triangle, or of both."""
    name = block.option("NAME").upper()
    if block.options.get("MATRIX"):
        block.refuse("reads a .sim file, which is binary; write the matrix as text by *MATRIX OUTPUT")
    if block.choice("TYPE", "SYMMETRIC") != "SYMMETRIC":
        block.refuse("is not symmetric; give a symmetric stiffness or mass")
    factor = Row([block.options.get("SCALE FACTOR", "1")], block.file, block.line).real(0, "SCALE FACTOR")
    table = np.array([[row.real(k, "an entry") for k in range(5)] for row in block.rows]).reshape(-1, 5)
    try:
        place = integers(table[:, :4])
    except ValueError as error:
        raise block.error(f"{error}; give node, dof, node, dof, value in each line") from None
    found = labelled(place[:, :2] - [0, 1], place[:, 2:] - [0, 1], factor * table[:, 4])
    own = found._replace(matrix=mirrored(found.matrix))
    if deck.tables.setdefault("matrix", {}).setdefault(("", name), own) is not own:
        block.refuse(f"has the NAME {name} of another one; give each its own")


def matrix_assemble(deck: Deck, block: Block) -> None:
    """``*MATRIX ASSEMBLE``: matrices by name (Abaqus), or files of them (CalculiX)."""
    if block.options.get("STIFFNESS FILE") or block.options.get("STIFFNESSFILE"):
        K, M = (_from_file(deck, block, kind) for kind in KINDS)
        _add(deck, block.row(), K, M, f"substructure {block.options.get('NAME', '')}")
        return
    K, M = (_named(deck, block, kind) for kind in KINDS)
    for kind in DAMPING:
        if block.options.get(kind):
            deck.skipped.append((f"{kind} of *MATRIX ASSEMBLE", f"line {block.line}"))
    if K is None and M is None:
        block.refuse("names neither STIFFNESS nor MASS, or they are empty; give the name of a *MATRIX INPUT")
    names = ", ".join(f"{kind}={block.options[kind]}" for kind in KINDS if kind in block.options)
    numbers = np.unique(np.concatenate([A.rows[:, 0] for A in (K, M) if A is not None and A.rows is not None]))
    nodes = _remapped(deck, block, numbers) if block.options.get("NSET") else _unique(deck, block, numbers)
    place = dict(zip(numbers.tolist(), nodes, strict=True))
    _add(deck, block.row(), _renumbered(K, place), _renumbered(M, place), f"*MATRIX ASSEMBLE, {names}")


def _named(deck: Deck, block: Block, kind: str) -> Labelled | None:
    name = block.options.get(kind, "")
    known = deck.tables.get("matrix", {})
    if name and ("", name.upper()) not in known:
        block.refuse(f"names the matrix {name}, which no *MATRIX INPUT gives; add it")
    deck.current.setdefault("assembled", set()).add(name.upper())
    return known["", name.upper()] if name else None


def refuse_turned_nodes(deck: Deck) -> None:
    """Refuse matrices at nodes whose components have axes of their own."""
    for own in deck.matrices:
        for node in [node for node in own.nodes.tolist() if node in deck.axes]:
            raise InputError(
                f"mesh file {deck.path}: {own.name} joins node {deck.label(node)}, which has axes of its own "
                "(*TRANSFORM); give matrices and node in global axes"
            )


def note_idle_matrices(deck: Deck) -> None:
    """Say which matrices no *MATRIX ASSEMBLE names."""
    idle = [name for _, name in deck.tables.get("matrix", {}) if name not in deck.current.get("assembled", set())]
    if idle:
        deck.note(f"*MATRIX INPUT {', '.join(idle)}: no *MATRIX ASSEMBLE adds it to the model")


def _from_file(deck: Deck, block: Block, kind: str) -> Labelled | None:
    """Return the matrix of a file of CalculiX, by rows of nodes."""
    name = block.options.get(f"{kind} FILE") or block.options.get(f"{kind}FILE")
    if not name:
        return None
    path = Path(block.file).parent / name
    if not path.is_file():
        block.refuse(f"names the file {name}, which is not there; give it beside {Path(block.file).name}")
    try:
        found = read_abaqus_matrix(path).get("")
    except InputError as error:
        raise block.error(f"names a file that cannot be read: {error}") from None
    if found is None or found.rows is None:
        block.refuse(f"names {name}, whose lines are not node, dof, node, dof, value; write them so")
    numbers = np.unique(found.rows[:, 0])
    return _renumbered(found, dict(zip(numbers.tolist(), _unique(deck, block, numbers), strict=True)))


def _unique(deck: Deck, block: Block, numbers: np.ndarray) -> list[int]:
    """Return the nodes of numbers: of the assembly, or of the one instance that has them."""
    scopes = ["", *deck.parts.moves]
    found = []
    for number in numbers.tolist():
        own = [deck.nodes[scope, number] for scope in scopes if (scope, number) in deck.nodes]
        if len(own) != 1:
            there = "is not in the deck" if not own else "is in several instances"
            block.refuse(f"has node {number}, which {there}; name its nodes by NSET, or by numbers of their own")
        found.append(own[0])
    return found


def _remapped(deck: Deck, block: Block, numbers: np.ndarray) -> list[int]:
    """Return the nodes of the set NSET, in its order."""
    key = deck.find(deck.sets["NSET"], block.scope, block.options["NSET"])
    if key is None:
        block.refuse(f"names the node set {block.options['NSET']}, which is not in the deck; add it")
    nodes = deck.resolve("NSET", key)
    if len(nodes) != len(numbers):
        block.refuse(f"has {len(numbers)} nodes and its NSET has {len(nodes)}; give as many")
    return nodes


def _renumbered(A: Labelled | None, place: dict[int, int]) -> Labelled | None:
    """Return a matrix whose rows are named by indices of nodes instead of numbers."""
    if A is None or A.rows is None:
        return A
    return A._replace(rows=np.array([[place[number], component] for number, component in A.rows.tolist()]))


def _add(deck: Deck, row: Row, K: Labelled | None, M: Labelled | None, name: str) -> None:
    """Add a matrix element whose rows are indices of nodes."""
    given = [A.rows for A in (K, M) if A is not None and A.rows is not None]
    if not given:
        raise row.error(f"{name} has no entry; give its stiffness or mass")
    rows = np.concatenate(given)
    if rows[:, 1].max() > 5:
        raise row.error(f"{name} has the DOF {rows[:, 1].max() + 1}; a node has 1 to 6 here")
    where = f"{name} ({Path(row.file).name} line {row.line})"
    deck.matrices.append(matrix_element(K, M, lambda node: node, deck.units, where))


def uel_property(deck: Deck, block: Block) -> None:
    """``*UEL PROPERTY``: a linear user element has damping alone, which is left out."""
    block.option("ELSET")
