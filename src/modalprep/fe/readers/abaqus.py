"""Abaqus input files: nodes, elements, element and node sets. Sections and materials come from the pipeline file."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.mesh.cells import CELLS
from modalprep.fe.mesh.mesh import Mesh

LABEL = re.compile(r"[0-9]{1,18}")
DEEPEST = 100  # sets of sets of sets


@dataclass
class _Deck:
    """The content read so far; element and node numbers are those of the file."""

    path: Path
    points: dict[int, list[float]] = field(default_factory=dict)
    elements: dict[int, tuple[str, list[int]]] = field(default_factory=dict)
    elsets: dict[str, list] = field(default_factory=dict)
    nsets: dict[str, list] = field(default_factory=dict)
    resolved: dict[tuple[bool, str], list[int]] = field(default_factory=dict)

    def refuse(self, line: int, what: str) -> None:
        raise InputError(f"mesh file {self.path}, line {line}: {what}")


def read_abaqus(path: Path, scale: float) -> Mesh:
    r"""Read ``*NODE``, ``*ELEMENT``, ``*ELSET`` and ``*NSET`` of an input file without parts and instances.

    Groups are the sets: element sets as cells, node sets as vertices. Other keywords are skipped.

    Parameters
    ----------
    path : Path
    scale : float
        m per unit of length of the file.

    Raises
    ------
    InputError
        When a line cannot be read, an element type has no counterpart, or a set names what is not there.

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
    parts = 0
    for keyword, options, rows in _blocks(content.decode("utf-8-sig", errors="replace")):
        parts += keyword == "PART"
        if keyword == "INCLUDE" or parts > 1:
            what = "*INCLUDE" if keyword == "INCLUDE" else "several parts"
            raise InputError(f"mesh file {path} has {what}; export it flat, in one file without parts and instances")
        if keyword in READERS:
            READERS[keyword](deck, options, rows)
    if not deck.points or not deck.elements:
        raise InputError(f"mesh file {path} holds no {'cells' if deck.points else 'nodes'}; export it again")
    return _mesh(deck, scale, hashlib.sha256(content).hexdigest())


def _blocks(text: str) -> Iterator[tuple[str, dict[str, str], list[tuple[int, list[str]]]]]:
    """Yield (keyword, options, rows of fields with their line numbers); a line that ends in a comma goes on."""
    keyword, options, rows, open_row = "", {}, [], False
    for number, line in enumerate(text.splitlines(), 1):
        line = line.strip()
        if line.startswith("**") or not line:
            continue
        if line.startswith("*"):
            yield keyword, options, rows
            keyword, options = _keyword(line)
            rows, open_row = [], False
            continue
        fields = [part.strip() for part in line.rstrip(",").split(",")]
        if open_row and keyword == "ELEMENT":
            rows[-1][1].extend(fields)
        else:
            rows.append((number, fields))
        open_row = line.endswith(",")
    yield keyword, options, rows


def _keyword(line: str) -> tuple[str, dict[str, str]]:
    name, *rest = [part.strip() for part in line[1:].split(",")]
    pairs = [part.partition("=") for part in rest if part]
    return name.upper(), {key.strip().upper(): value.strip().strip('"') for key, _, value in pairs}


def _nodes(deck: _Deck, options: dict[str, str], rows: list) -> None:
    for number, fields in rows:
        try:
            label = int(LABEL.fullmatch(fields[0])[0])
            coordinates = [float(f or 0) for f in fields[1:4]]
        except (TypeError, ValueError):
            deck.refuse(number, f"node {', '.join(fields)} is not a number and coordinates; repair the line")
        deck.points[label] = coordinates + [0.0] * (3 - len(coordinates))
        deck.nsets.setdefault(options["NSET"], []).append(label) if "NSET" in options else None


def _elements(deck: _Deck, options: dict[str, str], rows: list) -> None:
    given = options.get("TYPE", "")
    known = next((c for c in CELLS.values() if c.abaqus and re.fullmatch(c.abaqus, given.upper())), None)
    for number, fields in rows:
        if known is None:
            deck.refuse(number, f"element type {given!r} has no counterpart here; known are S3, S4, B31, T3D2, C3D4, "
                                "C3D6, C3D8, C3D10, C3D20, MASS and their variants")  # fmt: skip
        kind, n = known.name, known.count
        fields = [f for f in fields if f]
        if len(fields) < n + 1 or not all(LABEL.fullmatch(f) for f in fields[: n + 1]):
            deck.refuse(
                number, f"element {', '.join(fields)} of type {given} needs a number and {n} nodes; export again"
            )
        label, *nodes = (int(f) for f in fields[: n + 1])
        missing = [node for node in nodes if node not in deck.points]
        if missing:
            deck.refuse(number, f"element {label} refers to node {missing[0]}, which is not there; export it again")
        deck.elements[label] = (kind, nodes)
        if "ELSET" in options:
            deck.elsets.setdefault(options["ELSET"], []).append(label)


def _set(kind: str):
    def read(deck: _Deck, options: dict[str, str], rows: list) -> None:
        sets = deck.elsets if kind == "ELSET" else deck.nsets
        members = sets.setdefault(options.get(kind, ""), [])
        for number, fields in rows:
            fields = [f for f in fields if f]
            if "GENERATE" not in options:
                members.extend(int(f) if LABEL.fullmatch(f) else f for f in fields)
                continue
            numbers = [int(f) for f in fields if LABEL.fullmatch(f)]
            if len(numbers) < len(fields) or not 2 <= len(numbers) <= 3 or numbers[2:] == [0]:
                deck.refuse(number, f"GENERATE needs first, last and step; it has {', '.join(fields)}")
            members.append(range(numbers[0], numbers[1] + 1, *numbers[2:]))

    return read


READERS = {"NODE": _nodes, "ELEMENT": _elements, "ELSET": _set("ELSET"), "NSET": _set("NSET")}


def _members(deck: _Deck, sets: dict[str, list], name: str, inside: tuple[str, ...] = ()) -> list[int]:
    """Resolve sets that name other sets, each once."""
    key = (sets is deck.elsets, name)
    if key in deck.resolved:
        return deck.resolved[key]
    if name in inside or len(inside) > DEEPEST:
        what = "contains itself" if name in inside else f"is more than {DEEPEST} sets deep in others"
        raise InputError(f"mesh file {deck.path}: set {name!r} {what}; repair the sets")
    known = deck.elements if sets is deck.elsets else deck.points
    found: list[int] = []
    for member in sets.get(name, ()):
        if isinstance(member, range):  # perhaps of far more numbers than there are
            found += sorted(label for label in known if label in member)
        else:
            found += [member] if isinstance(member, int) else _members(deck, sets, member, (*inside, name))
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
    )
