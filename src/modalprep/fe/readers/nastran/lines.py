"""One line of Nastran bulk data: its name, its fields and its continuation marker."""

from __future__ import annotations

from typing import NamedTuple

from modalprep.fe.readers.numbers import REAL


class Line(NamedTuple):
    """The first field, the fields after it (padded to 8 small or 4 large ones), and the marker in the tenth."""

    head: str
    data: list[str]
    marker: str

    @property
    def continues(self) -> bool:
        """Whether the line goes on with a card."""
        return not self.head or self.head[0] in "+*"


def split(line: str) -> Line | None:
    """Return the fields of a line; None where a marker stands before more fields.

    In free field commas and blanks separate; a line of more than ten fields goes on without a marker, and a number
    without a sign is none.

    Examples
    --------
    >>> split("GRID    7               1.      .5")
    Line(head='GRID', data=['7', '', '1.', '.5', '', '', '', ''], marker='')
    >>> split("PBAR, 1  1  1.-4, 2.-8,,,,, +A").marker, len(split("SPC1,1,3,1,2,3,4,5,6,7,8").data)
    ('+A', 10)
    """
    return _free(line) if "," in line else _fixed(line)


def _free(line: str) -> Line | None:
    head, *data = (word for part in line.split(",") for word in part.split() or [""])
    width = _width(head)
    more = any(data[width + 1 :])
    tenth = data[width] if len(data) > width else ""
    if _is_marker(tenth, more):
        return None if more else Line(head, data[:width], tenth)
    if not more and not tenth:
        data = data[:width]
    return Line(head, data + [""] * (width - len(data)), "")


def _is_marker(text: str, more: bool) -> bool:
    """Whether the tenth field is a marker: begins with + or *, or is no number at the end of its line."""
    if text[:1] in ("+", "*"):
        return True
    return bool(text) and not more and text != "THRU" and not REAL.fullmatch(text)


def _fixed(line: str) -> Line:
    line = line.expandtabs(8)
    head = line[:8].strip()
    width = _width(head)
    step = 64 // width
    data = [line[i : i + step].strip() for i in range(8, min(len(line), 72), step)]
    return Line(head.split()[0] if head else "", data + [""] * (width - len(data)), line[72:80].strip())


def _width(head: str) -> int:
    return 4 if "*" in (head[:1], head[-1:]) else 8
