"""A command of an Ansys input file, with the block of numbers that follows it."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.readers.text import Lines

FIRST = 4  # Ansys takes a command by its first four letters
EXPONENT = re.compile(r"([+-]?[\d.]+)([+-]\d+)")  # Fortran drops the E before an exponent of three digits


@dataclass(slots=True)
class Command:
    """One command: `fields` begin with its name; a block that is regular is a `table` of numbers in its columns."""

    path: Path
    line: int
    fields: list[str]
    formats: list[str] = field(default_factory=list)
    listed: list[tuple[int, str]] = field(default_factory=list)
    table: np.ndarray | None = None
    first: int = 0  # line of the table, from 0 on
    lines: Lines | None = None

    @property
    def rows(self) -> list[tuple[int, str]]:
        """The lines of its block with their numbers."""
        if self.lines is None or self.table is None:
            return self.listed
        places = range(self.first, self.first + len(self.table))
        return [(k + 1, self.lines[k].split("!")[0].rstrip()) for k in places]

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
