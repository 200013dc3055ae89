"""Read an Ansys input file."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Collection
from pathlib import Path

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.mesh.left_out import left_out
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.readers.ansys.alike import add_alike
from modalprep.fe.readers.ansys.analysis import add_case
from modalprep.fe.readers.ansys.builder import Builder
from modalprep.fe.readers.ansys.commands import Command
from modalprep.fe.readers.ansys.constraints import add_constraints
from modalprep.fe.readers.ansys.deck import Deck, Element, ElementBlock
from modalprep.fe.readers.ansys.elements import BY_NUMBER, ELEMENTS
from modalprep.fe.readers.ansys.lexer import commands
from modalprep.fe.readers.ansys.options import check_options
from modalprep.fe.readers.ansys.registry import BY_LETTERS, COMMANDS
from modalprep.fe.readers.units import Units
from modalprep.suggest import suggestion

# first letters of commands that make geometry or a mesh of it
MAKING = set(
    "K L A V LARC CIRC BLOC BLC4 BLC5 CYLI CYL4 CYL5 CONE CON4 SPHE SPH4 RECT PCIR RPR4 VROT VEXT VDRA VADD VSBV AMES "
    "VMES LMES VSWE KMES IGES PARA".split()
)
ADVICE = "if they carry stiffness, mass or constraints, model them in the pipeline file"


def read_ansys(path: Path, length: float, mass: float, ignore: Collection[str] = ()) -> Mesh:
    r"""Read nodes, elements, materials, real constants, sections, components and supports of a .cdb or .ans file.

    A group stands for each combination of element type and attributes, such as ``type1_mat2`` and ``type3_mat1_sec4``;
    components keep their names. Elements and commands that cannot be read are refused unless `ignore` names them.

    Parameters
    ----------
    path : Path
    length, mass : float
        m and kg per unit of the file, which with seconds are its consistent units.
    ignore : collection of str
        Commands and elements, such as ``CERIG`` and ``CONTA174``.

    Raises
    ------
    InputError
        When a line cannot be read, or an element or a command has no counterpart.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "bar.cdb"
    >>> lines = ["ET,1,180", "MP,EX,1,2e11", "MP,DENS,1,7800", "R,1,1e-4", "N,1", "N,2,3", "E,1,2"]
    >>> _ = path.write_text("\n".join(lines))
    >>> read_ansys(path, 1.0, 1.0).properties["type1_mat1_real1"].A
    0.0001
    """
    content = path.read_bytes()
    ignored = {name.upper() for name in ignore}
    sha256 = hashlib.sha256(content).hexdigest()
    deck = _deck(path, content, ignored)
    del content
    if not deck.points or not deck.elements:
        what = "elements" if deck.points else "nodes"
        raise InputError(f"mesh file {path} holds no {what}; export the model by CDWRITE")
    check_options(deck, _first_of_types(deck), ignored, BY_NUMBER)
    builder = Builder(deck, Units(length=length, mass=mass))
    for part in deck.elements.parts:
        _build_part(builder, part, ignored)
    add_constraints(builder)
    add_case(builder)
    _refuse_absent(deck, ignored)
    mesh = builder.mesh(sha256)
    return mesh.with_(notes=(*left_out(deck.skipped, ADVICE), *deck.notes))


def _first_of_types(deck: Deck) -> dict[int, Element]:
    """Return an element of each type that the deck uses."""
    found: dict[int, Element] = {}
    for part in deck.elements.parts:
        if isinstance(part, dict):
            for element in part.values():
                found.setdefault(element.type, element)
            continue
        for kind, k in zip(*np.unique(part.attributes[:, 0], return_index=True), strict=True):
            found.setdefault(int(kind), part.element(int(k)))
    return found


def _refuse_absent(deck: Deck, ignored: set[str]) -> None:
    """Refuse names to ignore that the deck does not have."""
    numbers = {kind.name for kind in deck.types.values()}
    present = {name for name, _ in deck.skipped} | numbers | {BY_NUMBER.get(number, number) for number in numbers}
    for name in sorted(ignored - present):
        raise InputError(f"mesh file {deck.path} has no {name!r} to ignore; {suggestion(name, present, 'it has')}")


def turned_nodes(path: Path) -> list[int]:
    """Return the numbers of the nodes whose displacements have axes of their own."""
    return sorted(_deck(path, path.read_bytes(), set()).angles)


def _deck(path: Path, content: bytes, ignored: set[str]) -> Deck:
    deck = Deck(path)
    listed = list(commands(path, content))
    _refuse_bare_commands(path, listed)
    for command in listed:
        _obey(deck, command, ignored)
    return deck


def _refuse_bare_commands(path: Path, listed: list[Command]) -> None:
    """Refuse a file that makes its model by commands and lists no node."""
    first = next((command for command in listed if command.key in MAKING), None)
    if first is not None and not any(command.key in ("NBLO", "N") for command in listed):
        raise InputError(
            f"mesh file {path} makes its model by commands, {first.fields[0].upper()} in line {first.line} first, and "
            "lists no nodes; run it in Ansys and write the model by CDWRITE"
        )


def _obey(deck: Deck, command: Command, ignored: set[str]) -> None:
    name = BY_LETTERS.get(command.key)
    if name is None or name in ignored:
        deck.skipped.append((name or command.fields[0].upper(), f"line {command.line}"))
        return
    entry = COMMANDS[name]
    if entry.treatment == "refused":
        raise command.error(f"{entry.remark[:1].lower()}{entry.remark[1:].rstrip('.')}; or name {name} in 'ignore'")
    if entry.handle is not None:
        entry.handle(deck, command)


def _build_part(builder: Builder, part: ElementBlock | dict[int, Element], ignored: set[str]) -> None:
    """Add elements: those of a block together where they are alike and regular."""
    if isinstance(part, dict):
        for element in part.values():
            _build(builder, element, ignored)
        return
    for alike in part.uniform():
        names = _names(builder.deck, alike.element(0))
        if not (names and ignored.isdisjoint(names) and add_alike(builder, names[0], alike)):
            for k in range(len(alike.labels)):
                _build(builder, alike.element(k), ignored)


def _names(deck: Deck, element: Element) -> tuple[str, ...]:
    """Return the name of an element in Ansys' library, and its number there; nothing without a type."""
    number = deck.types[element.type].name if element.type in deck.types else ""
    return (BY_NUMBER.get(number, number), number) if number else ()


def _build(builder: Builder, element: Element, ignored: set[str]) -> None:
    """Add an element by the handler of its type."""
    deck = builder.deck
    if element.type not in deck.types:
        raise deck.error(element, f"its type {element.type} is not in the deck; add its ET")
    name, number = _names(deck, element)
    if name in ignored or number in ignored:
        deck.skipped.append((f"elements {name}", f"line {element.line}"))
        return
    if name not in ELEMENTS:
        raise deck.error(
            element, f"element type {number} has no counterpart here; name {number} in 'ignore' to leave it out"
        )
    entry = ELEMENTS[name]
    if entry.treatment == "refused":
        count = Counter(e.type for e in deck.elements)[element.type]
        raise deck.error(
            element, f"{name} cannot be read ({count} elements): {entry.remark.rstrip('.')}; or name {name} in 'ignore'"
        )
    if entry.handle is None:
        deck.skipped.append((f"elements {name}", f"line {element.line}"))
    else:
        entry.handle(builder, element)
