"""The keyword blocks of Abaqus and CalculiX input files, with those that they include."""

from __future__ import annotations

import hashlib
import math
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.readers.text import Lines

LONG = {"NODE", "ELEMENT", "NSET", "ELSET"}  # keywords with many lines
STAR = ord("*")
FILES = ("STIFFNESSFILE", "MASSFILE")  # options that name files of matrices
DEEPEST = 20  # files that include files
MOST = 1000  # included files
PIECES = re.compile(r'(?:[^,"]|"[^"]*"?)+|(?<=,)(?=,)|^(?=,)|(?<=,)$')  # between commas outside quotes


class Row(NamedTuple):
    """A data line: its fields without blanks around them, and where it is."""

    fields: list[str]
    file: str
    line: int

    def error(self, what: str) -> InputError:
        """Return the error that names file and line."""
        return InputError(f"mesh file {self.file}, line {self.line}: {what}")

    def text(self, k: int) -> str:
        """Return field `k`, empty when there is none."""
        return self.fields[k] if k < len(self.fields) else ""

    def real(self, k: int, what: str, default: float | None = None) -> float:
        """Return the number in field `k`; Fortran's exponent D is one too."""
        text = self.text(k)
        if not text and default is not None:
            return default
        try:
            value = float(text.upper().replace("D", "E"))
        except ValueError:
            raise self.error(f"{what} is {text[:60]!r}, which is no number; correct field {k + 1}") from None
        if not math.isfinite(value):
            raise self.error(f"{what} = {text[:60]} is not finite; correct field {k + 1}")
        return value

    def reals(self, first: int, count: int, what: str) -> list[float]:
        """Return `count` numbers; blank fields are zero."""
        return [self.real(first + k, what, 0.0) for k in range(count)]

    def integer(self, k: int, what: str, default: int | None = None) -> int:
        """Return the whole number in field `k`."""
        value = self.real(k, what, default)
        if value != int(value) or abs(value) > 1e15:
            raise self.error(f"{what} = {self.text(k)[:60]} is no whole number; correct field {k + 1}")
        return int(value)


class Options(dict[str, str]):
    """The options of a keyword, and those of them that a reader has asked for.

    Examples
    --------
    >>> options = Options(NAME="t", ADJUST="NO")
    >>> options.get("ADJUST"), options.unread
    ('NO', ['NAME'])
    """

    def __init__(self, *given: Any, **more: str) -> None:
        super().__init__(*given, **more)
        self._read: set[str] = set()

    def __getitem__(self, name: str) -> str:
        self._read.add(name)
        return super().__getitem__(name)

    def __contains__(self, name: object) -> bool:
        self._read.add(str(name))
        return super().__contains__(name)

    def get(self, name: str, default: Any = None) -> Any:
        """Return an option, or the default."""
        return self[name] if name in self else default

    def peek(self, name: str) -> str:
        """Return an option without asking for it, empty when there is none."""
        return dict.get(self, name, "")

    @property
    def unread(self) -> list[str]:
        """The options that nothing has asked for."""
        return [name for name in self if name not in self._read]


class Numbers(NamedTuple):
    """The numbers of the data lines from `first` on (from 0), NaN of blank fields, and how many each line has."""

    lines: Lines
    first: int
    values: np.ndarray
    counts: np.ndarray

    def rows(self, file: str) -> list[Row]:
        """Return the data lines one by one."""
        places = range(self.first, self.first + len(self.counts))
        return [Row(_fields(line), file, k + 1) for k in places if (line := self.lines[k].strip())]


@dataclass(slots=True)
class Block:
    """A keyword with its options and its data lines.

    Attributes
    ----------
    keyword : str
        Capitals, one blank between words.
    options : Options
        Values as the file spells them, names in capitals.
    scope : str
        Name of the instance that it belongs to, in capitals; empty outside.
    step : int
        Number of the step that it stands in; 0 before the first.
    owner : Block or None
        The section or coupling that a keyword which stands behind it belongs to.
    numbers : Numbers or None
        Of data lines that are nothing but plain numbers, which are many.
    """

    keyword: str
    options: Options
    file: str
    line: int
    listed: list[Row] = field(default_factory=list)
    scope: str = ""
    step: int = 0
    owner: Block | None = None
    numbers: Numbers | None = None

    @property
    def rows(self) -> list[Row]:
        """The data lines, one by one from now on where they are numbers."""
        if self.numbers is not None:
            self.listed = self.numbers.rows(self.file)
            self.numbers = None
        return self.listed

    def refuse(self, what: str) -> NoReturn:
        """Raise the error that names file, line and keyword."""
        raise self.error(what)

    def error(self, what: str) -> InputError:
        """Return the error that names file, line and keyword."""
        return InputError(f"mesh file {self.file}, line {self.line}: *{self.keyword} {what}")

    def option(self, name: str) -> str:
        """Return an option that the keyword must have."""
        if not self.options.get(name):
            self.refuse(f"has no {name}; add {name}=")
        return self.options[name]

    def choice(self, name: str, default: str = "") -> str:
        """Return the value of an option in capitals with single blanks."""
        return " ".join(self.options.get(name, default).upper().split())

    def row(self, k: int = 0) -> Row:
        """Return data line `k`, without fields when there is none."""
        return self.rows[k] if k < len(self.rows) else Row([], self.file, self.line)

    def joined(self, first: int = 0) -> Row:
        """Return the data lines from `first` on as one; a comma at the end of a line adds no field."""
        fields = []
        for row in self.rows[first:]:
            fields += row.fields[:-1] if row.fields and not row.fields[-1] else row.fields
        return Row(fields, self.file, self.row(first).line)

    def joined_by(self, count: int) -> list[Row]:
        """Return the data lines of each entry as one, without blanks.

        One that ends in a comma goes on while it has less than `count` fields.
        """
        joined: list[Row] = []
        goes_on = False
        for row in self.rows:
            filled = [f for f in row.fields if f]
            if goes_on:
                joined[-1].fields.extend(filled)
            else:
                joined.append(Row(filled, row.file, row.line))
            goes_on = not row.fields[-1] and len(joined[-1].fields) < count
        return joined

    def made(self, kind: Any, **values: Any) -> Any:
        """Return ``kind(**values)``; a value that it refuses is refused by this keyword."""
        try:
            return kind(**values)
        except (InputError, ArithmeticError) as error:
            raise self.error(f"{error} (converted to SI)") from None


class _Reading:
    """Files read so far, in the order of their lines."""

    def __init__(self, path: Path) -> None:
        self.folder = path.parent
        self.digest = hashlib.sha256()
        self.files = 0
        self.blocks = [Block("", Options(), str(path), 0)]

    def read(self, path: Path, inside: tuple[Path, ...] = ()) -> None:
        """Append the blocks of a file; its first lines may go on with the block before."""
        content = path.read_bytes()
        self.digest.update(content)
        self.files += 1
        header = ""
        lines = Lines(content)
        stars = np.append(np.flatnonzero(lines.beginnings(0, len(lines)) == STAR), len(lines))
        at = 0
        while at < len(lines):
            at += 1
            number = at
            line = lines[at - 1].strip().strip("\x1a\0")
            if not line or line.startswith("**"):
                continue
            if line.startswith("*"):
                header = line
                self.add(_block(line, str(path), number), path, inside)
                at = self.take_numbers(lines, at, int(stars[np.searchsorted(stars, at)]))
            elif header.endswith(",") and not self.blocks[-1].rows and line[0].isalpha():
                header += line
                self.again(_block(header, str(path), self.blocks[-1].line), path, inside)
            else:
                header = ""
                self.blocks[-1].rows.append(Row(_fields(line), str(path), number))

    def take_numbers(self, lines: Lines, first: int, last: int) -> int:
        """Give the last block the lines up to `last` where they are all it has, and numbers; return what follows."""
        block = self.blocks[-1]
        if block.keyword not in LONG or last - first < lines.least or block.options.peek("INPUT"):
            return first
        behind = last
        while behind < len(lines) and (lines[behind].startswith("**") or not lines[behind].strip()):
            behind += 1
        if behind < len(lines) and not lines[behind].startswith("*"):
            return first
        found = lines.free(first, last, reals=block.keyword == "NODE")
        if found is None:
            return first
        block.numbers = Numbers(lines, first, *found)
        return behind

    def add(self, block: Block, path: Path, inside: tuple[Path, ...]) -> None:
        """Append a block; ``*INCLUDE`` is replaced by the file, INPUT= adds the file's lines."""
        if block.keyword != "INCLUDE":
            self.blocks.append(block)
        if block.options.get("INPUT"):
            self.include(block, path, inside)
        for name in (option for option in block.options if option.replace(" ", "") in FILES):
            file = path.parent / block.options.peek(name)
            self.digest.update(file.read_bytes() if _is_file(file) else b"")

    def again(self, block: Block, path: Path, inside: tuple[Path, ...]) -> None:
        """Replace the last block by itself with the options of the line that goes on."""
        if block.keyword != "INCLUDE":
            self.blocks.pop()
        self.add(block, path, inside)

    def include(self, block: Block, path: Path, inside: tuple[Path, ...]) -> None:
        name = block.options["INPUT"]
        found = next((f for f in (path.parent / name, self.folder / name) if _is_file(f)), None)
        if found is None:
            block.refuse(f"names the file {name}, which is not there; give it beside {path.name}")
        chain = (*inside, path.resolve())
        if found.resolve() in chain:
            block.refuse(f"includes {name}, which includes itself; repair the files")
        if len(chain) > DEEPEST or self.files > MOST:
            block.refuse(f"is more than {DEEPEST} files deep or one of more than {MOST} files; join them")
        self.read(found, chain)


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):  # names that no file can have
        return False


def read_blocks(path: Path) -> tuple[list[Block], str]:
    r"""Return the keyword blocks of a deck, with its included files, and the SHA-256 of all its bytes.

    Lines that begin with ``**`` and empty ones do not count; a keyword line that ends in a comma goes on in the next.

    Raises
    ------
    InputError
        When an included file is not there, or includes itself.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "a.inp"
    >>> _ = path.write_text("*Node, nset=all\n1, 0., 0., 2.D3\n** end\n")
    >>> block = read_blocks(path)[0][0]
    >>> block.keyword, block.options, block.rows[0].real(3, "z")
    ('NODE', {'NSET': 'all'}, 2000.0)
    """
    reading = _Reading(path)
    reading.read(path)
    return [block for block in reading.blocks if block.keyword or block.rows], reading.digest.hexdigest()


def _block(header: str, file: str, line: int) -> Block:
    name, *rest = _fields(header[1:])
    pairs = [part.partition("=") for part in rest if part]
    options = {" ".join(key.upper().split()): value.strip().strip('"') for key, _, value in pairs}
    return Block(" ".join(name.upper().split()), Options(options), file, line)


def _fields(line: str) -> list[str]:
    if '"' not in line:
        return [part.strip() for part in line.split(",")]
    return [part.strip().strip('"') for part in PIECES.findall(line)]
