"""Abaqus input files: nodes, elements, element and node sets. Sections and materials come from the pipeline file."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.mesh.cells import CELLS
from modalprep.fe.mesh.left_out import left_out
from modalprep.fe.mesh.mesh import Mesh

LABEL = re.compile(r"[0-9]{1,18}")
DEEPEST = 100  # sets of sets of sets
FLAT = "export it flat, in one file without parts and instances"
ZERO = re.compile(r"[+-]?0*\.?0*([EeDd][+-]?\d+)?")
MADE = re.compile(r"N(GEN|FILL|COPY|MAP)|EL(GEN|COPY)")
# Sections, materials and loads come from the pipeline file; these keywords say nothing else about the structure.
SKIPPED = re.compile(
    r"|HEADING|PREPRINT|(END )?(PART|INSTANCE|ASSEMBLY|STEP)|.* SECTION|MATERIAL|DENSITY|ELASTIC|PLASTIC|EXPANSION"
    r"|DAMPING|CONDUCTIVITY|SPECIFIC HEAT|ORIENTATION|DISTRIBUTION( TABLE)?|TRANSFORM|AMPLITUDE|PHYSICAL CONSTANTS"
    r"|SURFACE( INTERACTION| BEHAVIOR)?|FRICTION|RESTART|FILE FORMAT"
)
DISCRETE = re.compile("MASS|ROTARYI|SPRING[12A]|CONN3D2")  # elements whose values are in keywords that are skipped
ADVICE = (
    "give masses, springs and directions of beams as properties, rigid links as connections, supports as interfaces"
)


class _Block(NamedTuple):
    """A keyword with its options, its rows of fields with their line numbers, and its own line."""

    keyword: str
    options: dict[str, str]
    rows: list[tuple[int, list[str]]]
    line: int


@dataclass
class _Deck:
    """The content read so far; element and node numbers are those of the file."""

    path: Path
    points: dict[int, list[float]] = field(default_factory=dict)
    elements: dict[int, tuple[str, list[int]]] = field(default_factory=dict)
    elsets: dict[str, list] = field(default_factory=dict)
    nsets: dict[str, list] = field(default_factory=dict)
    resolved: dict[tuple[bool, str], list[int]] = field(default_factory=dict)
    spelled: dict[tuple[str, str], str] = field(default_factory=dict)  # by kind and capitals: the first spelling
    inside: str = ""  # PART, INSTANCE, ASSEMBLY or STEP
    seen: set[str] = field(default_factory=set)  # of these, the ones that came
    of_part: set[tuple[str, str]] = field(default_factory=set)  # kind and capitals of its sets
    discrete: list[str] = field(default_factory=list)  # notes on them
    skipped: list[tuple[str, str]] = field(default_factory=list)  # what, and where

    def refuse(self, line: int, what: str) -> None:
        raise InputError(f"mesh file {self.path}, line {line}: {what}")

    def members(self, kind: str, name: str) -> list:
        """Return the list of a set, ELSET or NSET, to add to; capitals do not count."""
        sets = self.elsets if kind == "ELSET" else self.nsets
        return sets.setdefault(self.spelled.setdefault((kind, name.upper()), name), [])

    def add(self, line: int, what: str, label: int, value: Any) -> None:
        """Add a node or an element, of which every number stands for one."""
        known = self.points if what == "node" else self.elements
        if label in known and self.inside == "ASSEMBLY":
            self.refuse(line, f"{what} {label} of the assembly has the number of a {what} of the part; {FLAT}")
        if known.setdefault(label, value) != value:
            self.refuse(line, f"{what} {label} is there twice and differs; give every {what} its own number")


def read_abaqus(path: Path, scale: float) -> Mesh:
    r"""Read ``*NODE``, ``*ELEMENT``, ``*ELSET`` and ``*NSET`` of an input file with one part and instance at most.

    Groups are the sets: element sets as cells, node sets as vertices. Sections, materials and loads are skipped; a note
    counts every other keyword, such as ``*MPC``, ``*MASS`` and ``*BOUNDARY``.

    Parameters
    ----------
    path : Path
    scale : float
        m per unit of length of the file.

    Raises
    ------
    InputError
        When a line cannot be read, an element type has no counterpart, a set names what is not there, or the nodes are
        not all listed in global axes.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "bar.inp"
    >>> _ = path.write_text("*NODE\n1, 0, 0, 0\n2, 500, 0, 0\n*ELEMENT, TYPE=T3D2, ELSET=bar\n7, 1, 2\n")
    >>> read_abaqus(path, 1e-3)
    Mesh(2 points, 1 line; groups bar)
    """
    content = path.read_bytes()
    deck = _Deck(path)
    for block in _blocks(content.decode("utf-8-sig", errors="replace")):
        _enter(deck, block)
        if block.keyword in READERS:
            _refuse_elsewhere(deck, block)
            READERS[block.keyword](deck, block)
        elif block.keyword == "BOUNDARY" or not (deck.inside == "STEP" or SKIPPED.fullmatch(block.keyword)):
            deck.skipped.append((f"*{block.keyword}", f"line {block.line}"))
    if not deck.points or not deck.elements:
        raise InputError(f"mesh file {path} holds no {'cells' if deck.points else 'nodes'}; export it again")
    return _mesh(deck, scale, hashlib.sha256(content).hexdigest())


def _blocks(text: str) -> Iterator[_Block]:
    """Yield the keywords with their rows; a keyword whose line ends in a comma may go on in the next."""
    header, block = "", _Block("", {}, [], 0)
    for number, line in enumerate(text.splitlines(), 1):
        line = line.strip()
        if line.startswith("**") or not line:
            continue
        if line.startswith("*"):
            yield block
            header, block = line, _block(line, number)
        elif header.endswith(",") and not block.rows and line[0].isalpha():
            header += line
            block = _block(header, block.line)
        else:
            block.rows.append((number, [part.strip() for part in line.split(",")]))
    yield block


def _block(header: str, line: int) -> _Block:
    name, *rest = [part.strip() for part in header[1:].split(",")]
    pairs = [part.partition("=") for part in rest if part]
    options = {key.strip().upper(): value.strip().strip('"') for key, _, value in pairs}
    return _Block(" ".join(name.upper().split()), options, [], line)


def _enter(deck: _Deck, block: _Block) -> None:
    """Follow parts, instances, the assembly and steps; refuse what makes nodes or elements that are not listed."""
    keyword = block.keyword
    if keyword == "INCLUDE" or (keyword in ("PART", "INSTANCE") and keyword in deck.seen):
        what = "*INCLUDE" if keyword == "INCLUDE" else f"several {keyword.lower()}s"
        deck.refuse(block.line, f"the deck has {what}; {FLAT}")
    if MADE.fullmatch(keyword):
        deck.refuse(block.line, f"*{keyword} makes what the file does not list; export every node and element")
    if keyword == "SYSTEM":
        _refuse_axes(deck, block)
    if keyword == "INSTANCE" and not all(ZERO.fullmatch(f) for _, fields in block.rows for f in fields):
        deck.refuse(block.line, f"the instance is moved from where its part lies; {FLAT}")
    if keyword in ("ASSEMBLY", "END INSTANCE"):
        deck.of_part = set(deck.spelled)
    if keyword in ("PART", "INSTANCE", "ASSEMBLY", "STEP"):
        deck.inside = keyword
        deck.seen.add(keyword)
    elif keyword.startswith("END "):
        deck.inside = "ASSEMBLY" if keyword == "END INSTANCE" else ""


def _refuse_axes(deck: _Deck, block: _Block) -> None:
    deck.refuse(block.line, f"*{block.keyword} gives coordinates in axes of its own; export them as global x, y, z")


def _refuse_elsewhere(deck: _Deck, block: _Block) -> None:
    """Refuse content of other files, other axes, and sets by another road than their numbers and names."""
    keyword, options = block.keyword, block.options
    if "INPUT" in options:
        deck.refuse(block.line, f"*{keyword} has INPUT={options['INPUT']}, another file; {FLAT}")
    if keyword == "NODE" and options.get("SYSTEM", "R").upper() != "R":
        _refuse_axes(deck, block)
    if keyword == "NSET" and "ELSET" in options:
        deck.refuse(block.line, f"*NSET takes the nodes of ELSET={options['ELSET']}; list their numbers")


def _nodes(deck: _Deck, block: _Block) -> None:
    for number, fields in block.rows:
        try:
            label = int(LABEL.fullmatch(fields[0])[0])
            coordinates = [float(f or 0) for f in fields[1:4]]
        except (TypeError, ValueError):
            deck.refuse(number, f"node {', '.join(fields)} is not a number and coordinates; repair the line")
        deck.add(number, "node", label, coordinates + [0.0] * (3 - len(coordinates)))
        if "NSET" in block.options:
            deck.members("NSET", block.options["NSET"]).append(label)


def _elements(deck: _Deck, block: _Block) -> None:
    given = block.options.get("TYPE", "")
    known = next((c for c in CELLS.values() if c.abaqus and re.fullmatch(c.abaqus, given.upper())), None)
    if known is None and block.rows:
        deck.refuse(block.rows[0][0], f"element type {given!r} has no counterpart here; known are S3, S4, B31, T3D2, "
                                      "C3D4, C3D6, C3D8, C3D10, C3D20, MASS and their variants")  # fmt: skip
    if DISCRETE.fullmatch(given.upper()) and block.rows:
        where = f"{len(block.rows)} of TYPE={given} in set {block.options.get('ELSET', 'no set')} (line {block.line})"
        deck.discrete.append(
            f"elements: {where} have mass or stiffness only by a property of that set, 'mass' or 'spring'"
        )
    for number, fields in _joined(block.rows, known.count + 1 if known else 0):
        label, *nodes = _numbers(deck, number, fields, known.count + 1, given)
        missing = [node for node in nodes if node not in deck.points]
        if missing:
            deck.refuse(number, f"element {label} refers to node {missing[0]}, which is not there; export it again")
        deck.add(number, "element", label, (known.name, nodes))
        if "ELSET" in block.options:
            deck.members("ELSET", block.options["ELSET"]).append(label)


def _joined(rows: list[tuple[int, list[str]]], count: int) -> list[tuple[int, list[str]]]:
    """Join the lines of each element, without blanks: one that ends in a comma goes on while nodes are missing."""
    joined, goes_on = [], False
    for number, fields in rows:
        filled = [f for f in fields if f]
        if goes_on:
            joined[-1][1].extend(filled)
        else:
            joined.append((number, filled))
        goes_on = not fields[-1] and len(joined[-1][1]) < count
    return joined


def _numbers(deck: _Deck, line: int, fields: list[str], count: int, given: str) -> list[int]:
    """Return the numbers of an element and its nodes; beams may name one of their direction, CalculiX more."""
    if len(fields) > count:
        deck.skipped.append((f"extra nodes in *ELEMENT, TYPE={given}", f"line {line}"))
    if len(fields) < count or not all(LABEL.fullmatch(f) for f in fields[:count]):
        deck.refuse(
            line, f"element {', '.join(fields)} of type {given} needs a number and {count - 1} nodes; export again"
        )
    return [int(f) for f in fields[:count]]


def _set(deck: _Deck, block: _Block) -> None:
    kind, name = block.keyword, block.options.get(block.keyword, "")
    if not name or (deck.inside == "ASSEMBLY" and (kind, name.upper()) in deck.of_part):
        what = f"*{kind} has the name {name} of a set of the part" if name else f"*{kind} has no name"
        deck.refuse(block.line, f"{what}; give the set a name of its own")
    members = deck.members(kind, name)
    for number, fields in block.rows:
        fields = [f for f in fields if f]
        if "GENERATE" not in block.options:
            members.extend(int(f) if LABEL.fullmatch(f) else f for f in fields)
            continue
        numbers = [int(f) for f in fields if LABEL.fullmatch(f)]
        if len(numbers) < len(fields) or not 2 <= len(numbers) <= 3 or numbers[2:] == [0]:
            deck.refuse(number, f"GENERATE needs first, last and step; it has {', '.join(fields)}")
        members.append(range(numbers[0], numbers[1] + 1, *numbers[2:]))


READERS = {"NODE": _nodes, "ELEMENT": _elements, "ELSET": _set, "NSET": _set}


def _members(deck: _Deck, sets: dict[str, list], name: str, inside: tuple[str, ...] = ()) -> list[int]:
    """Resolve sets that name other sets, each once."""
    key = (sets is deck.elsets, name)
    if key in deck.resolved:
        return deck.resolved[key]
    if name in inside or len(inside) > DEEPEST:
        what = "contains itself" if name in inside else f"is more than {DEEPEST} sets deep in others"
        raise InputError(f"mesh file {deck.path}: set {name!r} {what}; repair the sets")
    known, kind = (deck.elements, "ELSET") if sets is deck.elsets else (deck.points, "NSET")
    found: list[int] = []
    for member in sets[name]:
        if isinstance(member, range):  # perhaps of far more numbers than there are
            found += sorted(label for label in known if label in member)
        elif isinstance(member, int):
            found.append(member)
        elif spelled := deck.spelled.get((kind, member.upper())):
            found += _members(deck, sets, spelled, (*inside, name))
        else:
            what = f"set {name!r} names {member!r}, which is no number and no set of the file"
            raise InputError(f"mesh file {deck.path}: {what}; correct it")
    deck.resolved[key] = list(dict.fromkeys(found))
    return deck.resolved[key]


def _mesh(deck: _Deck, scale: float, sha256: str) -> Mesh:
    labels = np.array(sorted(deck.points))
    cells: dict[str, list] = {}
    place: dict[int, tuple[str, int]] = {}
    for label, (kind, nodes) in deck.elements.items():
        place[label] = (kind, len(cells.setdefault(kind, [])))
        cells[kind].append(np.searchsorted(labels, nodes))
    groups: dict[str, dict[str, list]] = {}
    for name in deck.elsets:
        for label in _members(deck, deck.elsets, name):
            if label in place:  # sets may name what another program left out
                groups.setdefault(name, {}).setdefault(place[label][0], []).append(place[label][1])
    for name in deck.nsets:
        nodes = [label for label in _members(deck, deck.nsets, name) if label in deck.points]
        vertices = cells.setdefault("vertex", []) if nodes else []
        if nodes and "vertex" not in groups.get(name, {}):
            groups.setdefault(name, {})["vertex"] = list(range(len(vertices), len(vertices) + len(nodes)))
            vertices.extend(np.searchsorted(labels, [[node] for node in nodes]))
    return Mesh(
        points=scale * np.array([deck.points[int(label)] for label in labels]),
        cells={kind: np.array(rows) for kind, rows in cells.items()},
        groups={name: {kind: np.array(rows) for kind, rows in g.items()} for name, g in groups.items()},
        labels=labels,
        source=deck.path.name,
        sha256=sha256,
        scale=scale,
        notes=(*left_out(deck.skipped, ADVICE), *deck.discrete),
    )
