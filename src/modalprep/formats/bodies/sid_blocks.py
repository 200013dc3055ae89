"""The text of a SID_FEM file: its sections, and its blocks as matrices with their derivatives."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from modalprep.errors import InputError
from modalprep.formats.sid import Taylor
from modalprep.suggest import refuse_missing

NAMED = re.compile(r"by modalprep, SI units; nodes (.*)")
ENTRY = re.compile(r"m([01])\(([\d\s,]+)\)")
SYMMETRIC, UNIT = 2, 4  # structures


class Contents(NamedTuple):
    """A file: name, mass, descriptions of its modes, nodes by label and the blocks of the body."""

    name: str
    mass: float
    modes: list[str]
    nodes: dict[str, dict[str, Taylor]]
    body: dict[str, Taylor]


@dataclass
class Section:
    """A named part of the file: its line, the text behind ``=``, ``key = value`` pairs and the parts within it."""

    name: str
    line: int
    value: str = ""
    entries: list[tuple[str, str, int]] = field(default_factory=list)
    parts: list[Section] = field(default_factory=list)

    def part(self, name: str) -> Section:
        """Return the only part of a name."""
        found = [part for part in self.parts if part.name == name]
        if len(found) != 1:
            raise InputError(f"{self.name} (line {self.line}) has {len(found)} parts {name!r} instead of one")
        return found[0]

    def integer(self, key: str, default: int | None = None) -> int:
        """Return the whole number of a key."""
        for name, text, line in self.entries:
            if name == key:
                if not re.fullmatch(r"\d{1,9}", text):
                    raise InputError(f"line {line}: {key} = {text[:40]!r} is not a whole number")
                return int(text)
        if default is None:
            raise InputError(f"{self.name} (line {self.line}) has no {key}")
        return default


def read_sections(path: Path) -> tuple[str, Section]:
    """Return the first line of a file and its section ``modal``.

    Raises
    ------
    InputError
        When the file is missing, no text of this kind, or ends within a section.
    """
    refuse_missing(path, "SID_FEM file")
    first, *lines = path.read_text(encoding="ascii", errors="replace").splitlines() or [""]
    stack = [Section("file", 1)]
    for number, text in enumerate((line.strip() for line in lines), start=2):
        if "=" in text:
            key, _, value = (part.strip() for part in text.partition("="))
            if key.startswith("new "):
                _open(stack, Section(key[4:].strip(), number, value))
            else:
                stack[-1].entries.append((key, value, number))
        elif text.startswith("end "):
            if stack.pop().name != text[4:].strip() or not stack:
                raise InputError(f"line {number}: {text[:40]!r} ends a section that has not begun")
        elif text:
            _open(stack, Section(text, number))
    if len(stack) > 1:
        raise InputError(f"it ends within {stack[-1].name[:40]!r} (line {stack[-1].line}), as a truncated file does")
    return first.strip(), stack[0].part("part").part("modal")


def _open(stack: list[Section], section: Section) -> None:
    stack[-1].parts.append(section)
    stack.append(section)


def number(text: str, line: int) -> float:
    """Return the real number of a text, with the exponent letter of FORTRAN or of C.

    Examples
    --------
    >>> number("1.25604000000D+01", 1)
    12.5604
    """
    try:
        value = float(text.replace("D", "E").replace("d", "E"))
    except ValueError:
        raise InputError(f"line {line}: {text[:40]!r} is not a number") from None
    if not np.isfinite(value):
        raise InputError(f"line {line}: {text[:40]!r} is not a finite number")
    return value


def places(block: Section) -> list[tuple[int, tuple[int, ...], float, int]]:
    """Return the entries of a block: order, indices from 0, value, line."""
    found = []
    known = set()
    for key, text, line in block.entries:
        if not (match := ENTRY.fullmatch(key)):
            continue
        order = int(match[1])
        where = tuple(int(index) - 1 for index in match[2].split(",") if index.strip())
        if len(where) != order + 2 or (order, where) in known:
            raise InputError(f"line {line}: {key} has {len(where)} indices or stands there twice")
        known.add((order, where))
        found.append((order, where, number(text, line), line))
    return found


def mode_is_last(blocks: list[Section], n: int) -> bool:
    """Say whether the mode is the third index of m1: some entry then does not fit as row, mode, column."""
    return any(
        order and (where[1] >= n or where[2] >= block.integer("ncol"))
        for block in blocks
        for order, where, _, _ in places(block)
    )


def taylor(block: Section, shapes: tuple[tuple[int, int], ...], n: int, mode_last: bool) -> Taylor:
    """Return the matrix of a block, which has one of some shapes."""
    shape = block.integer("nrow"), block.integer("ncol")
    if shape not in shapes:
        expected = " or ".join(f"{rows} x {columns}" for rows, columns in shapes)
        raise InputError(f"{block.name} (line {block.line}) is {shape[0]} x {shape[1]} instead of {expected}")
    structure = block.integer("structure", 3)
    M0 = np.eye(*shape) if structure == UNIT else np.zeros(shape)
    M1 = np.zeros((shape[0], n, shape[1]))
    filled = set()
    for order, where, value, line in places(block):
        row, *others = where
        mode, column = (others[::-1] if mode_last else others) if order else (0, others[0])
        if not (0 <= row < shape[0] and 0 <= mode < n and 0 <= column < shape[1]):
            raise InputError(f"line {line}: an entry of {block.name} lies outside its {shape[0]} x {shape[1]} numbers")
        (M1[:, mode] if order else M0)[row, column] = value
        filled.add((order, mode, row, column))
    if structure == SYMMETRIC:
        for order, mode, row, column in filled:
            if (order, mode, column, row) not in filled:
                array = M1[:, mode] if order else M0
                array[column, row] = array[row, column]
    return Taylor(M0=M0, M1=M1 if np.any(M1) else None)


def read_contents(path: Path) -> Contents:
    """Return what a file holds.

    Raises
    ------
    InputError
        When the file is missing, damaged or truncated.
    """
    first, modal = read_sections(path)
    head, frame = modal.part("refmod"), modal.part("frame")
    n = head.integer("nelastq")
    mass = [number(text, line) for key, text, line in head.entries if key == "mass"]
    if len(mass) != 1 or not mass[0] > 0:
        raise InputError("refmod has no positive mass")
    count = len(modal.part("Ke").entries)
    if not 0 < n <= count:
        raise InputError(f"nelastq is {n}, but Ke has {count} lines; the file has no modes or is damaged")
    shapes = {
        "mdCM": ((3, 1),),
        "J": ((6, 1), (3, 3)),
        "Ct": ((n, 3),),
        "Cr": ((n, 3),),
        "Me": ((n, n),),
        "Gr": ((3, 3 * n),),
        "Ge": ((n, 3 * n),),
        "Oe": ((n, 6),),
        "ksigma": ((n, 1),),
        "Ke": ((n, n),),
        "De": ((n, n),),
        "origin": ((3, 1),),
        "phi": ((3, n),),
        "psi": ((3, n),),
        "AP": ((3, 3),),
    }
    nodes = [part for part in frame.parts if part.name == "node"]
    blocks = [b for part in (modal, *nodes) for b in part.parts if b.name in shapes]
    last = mode_is_last(blocks, n)

    def read(part: Section, names: tuple[str, ...]) -> dict[str, Taylor]:
        optional = ("De", "Oe", "ksigma", "Gr", "Ge", "AP")
        present = {b.name for b in part.parts}
        return {
            name: taylor(part.part(name), shapes[name], n, last)
            if name in present or name not in optional
            else Taylor(M0=np.zeros(shapes[name][0]))
            for name in names
        }

    names = _names(first, [part.value for part in nodes])
    if len(set(names)) < len(names) or not names:
        raise InputError("it has no nodes, or two nodes of one name")
    return Contents(
        name=modal.value or path.stem,
        mass=mass[0],
        modes=[text for key, text, _ in head.entries if key.startswith("ielastq")],
        nodes={name: read(part, ("origin", "phi", "psi")) for name, part in zip(names, nodes, strict=True)},
        body=read(modal, ("mdCM", "J", "Ct", "Cr", "Me", "Oe", "ksigma", "Ke", "De")),
    )


def _names(first: str, labels: list[str]) -> list[str]:
    """Return names of nodes: those that modalprep wrote in the first line, else by their labels."""
    said = dict(pair.split(" ", 1) for pair in (NAMED.search(first) or ["", ""])[1].split(", ") if " " in pair)
    if len(said) < len(labels) and said:
        said.popitem()  # that line has an end
    return [said.get(label, f"node_{label}") for label in labels]
