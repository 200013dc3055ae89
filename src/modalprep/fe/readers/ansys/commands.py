"""Commands of Ansys input files, and the blocks of numbers that follow some of them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from modalprep.errors import InputError

BLOCKS = ("NBLO", "EBLO", "CMBL", "RLBL", "SECB", "ETBL")
FIRST = 4  # Ansys takes a command by its first four letters
WHOLE_LINE = ("/TITLE", "/COM", "/STITLE", "C***", "/EOF")  # whose text is no list of fields
EXPONENT = re.compile(r"([+-]?[\d.]+)([+-]\d+)")  # Fortran drops the E before an exponent of three digits


@dataclass(slots=True)
class Command:
    """One command: `fields` begin with its name, `rows` are the lines of its block with their numbers."""

    path: Path
    line: int
    fields: list[str]
    formats: list[str] = field(default_factory=list)
    rows: list[tuple[int, str]] = field(default_factory=list)

    @property
    def key(self) -> str:
        """The letters by which Ansys knows a command.

        Examples
        --------
        >>> Command(Path("a.cdb"), 1, ["KEYOPT", "1"]).key, Command(Path("a.cdb"), 1, ["/prep7"]).key
        ('KEYO', '/PREP')
        """
        name = self.fields[0].upper()
        return name[: FIRST + (name[:1] in "/*")]

    def error(self, what: str, line: int | None = None) -> InputError:
        """Return an error that names the place."""
        return InputError(f"mesh file {self.path}, line {line or self.line}: {self.fields[0].upper()}: {what}")

    def text(self, k: int) -> str:
        """Return a field in capitals, empty where there is none."""
        return self.fields[k].upper() if k < len(self.fields) else ""

    def integer(self, k: int, what: str, default: int | None = None) -> int:
        """Return a field as a whole number."""
        value = self.real(k, what, None if default is None else float(default))
        if value != int(value):
            raise self.error(f"{what} {self.text(k)!r} is not a whole number; correct it")
        return int(value)

    def real(self, k: int, what: str, default: float | None = None) -> float:
        """Return a field as a number."""
        text = self.text(k)
        if not text and default is not None:
            return default
        return number(self, text, what)

    def reals(self, first: int) -> list[float]:
        """Return the numbers from a field on; blanks are zero, those at the end are dropped."""
        texts = self.fields[first:]
        while texts and not texts[-1]:
            texts.pop()
        return [number(self, text, "value") if text else 0.0 for text in texts]


def number(command: Command, text: str, what: str, line: int | None = None) -> float:
    """Return the number that a text is, with an exponent after E, D or a sign alone.

    Examples
    --------
    >>> number(Command(Path("a.cdb"), 1, ["N"]), "2.5-101", "x")
    2.5e-101
    """
    plain = text.replace("D", "E").replace("d", "e")
    if packed := EXPONENT.fullmatch(plain):
        plain = f"{packed[1]}E{packed[2]}"
    try:
        value = float(plain)
    except ValueError:
        raise command.error(f"{what} {text!r} is not a number; export the model by CDWRITE", line) from None
    if not abs(value) < 1e300:
        raise command.error(f"{what} {text!r} is not a number of a model; correct it", line)
    return value


def commands(path: Path, text: str) -> Iterator[Command]:
    """Yield the commands of a file in turn, each with its block."""
    lines = text.splitlines()
    at = 0
    while at < len(lines):
        at += 1
        for fields in _split(lines[at - 1]):
            command = Command(path, at, fields)
            if command.key in BLOCKS:
                at = _take_block(command, lines, at)
            yield command


def _split(line: str) -> Iterator[list[str]]:
    """Yield the commands of a line, which ``$`` divides; a comment begins at ``!``."""
    if line.strip().upper().startswith(WHOLE_LINE):
        return
    for part in line.split("!")[0].split("$"):
        fields = [f.strip() for f in part.split(",")]
        if "=" in fields[0]:
            fields = ["*SET", *(f.strip() for f in part.split("=", 1))]
        if fields[0]:
            yield fields


def _take_block(command: Command, lines: list[str], at: int) -> int:
    """Take formats and rows of numbers, as far as they go, and return the line behind them."""
    while at < len(lines):
        line = lines[at].split("!")[0].rstrip()
        stripped = line.lstrip()
        if stripped.startswith("(") and not command.rows:
            command.formats.append(stripped)
        elif stripped == "-1":
            return at + 1
        elif stripped and stripped[0] in "0123456789+-.":
            command.rows.append((at + 1, line))
        elif stripped:
            return at
        at += 1
    return at
