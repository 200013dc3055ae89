"""The case control of a Nastran deck: what each subcase selects."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

from modalprep.fe.readers.nastran.assign import BEGIN

ENTRY = re.compile(r"\s*([A-Z][A-Z0-9]*)\s*(?:\([^)]*\)\s*)?(?:=\s*|\s+(?=\d))(\S.*?)\s*", re.IGNORECASE)
LETTERS = 4  # of a command that count


class Subcase(NamedTuple):
    """Number of a subcase, 0 where there is none, and what it selects by the first letters of each command."""

    number: int
    entries: dict[str, str]

    def selected(self, command: str) -> int | None:
        """Return the number of the set that a command selects; None without one.

        Examples
        --------
        >>> Subcase(1, {"METH": "5"}).selected("METHOD")
        5
        """
        text = self.entries.get(command[:LETTERS], "")
        return int(text) if text.isdigit() else None


def case_control(path: Path) -> list[Subcase] | None:
    r"""Return the subcases before BEGIN BULK, one without a number where none is; None in a deck of bulk data alone.

    What stands before the first subcase holds in each that says nothing else.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "a.bdf"
    >>> _ = path.write_text("CEND\nSPC = 3\nSUBCASE 7\n METHOD=5 $ modes\nBEGIN BULK\n")
    >>> case_control(path)
    [Subcase(number=7, entries={'SPC': '3', 'METH': '5'})]
    """
    lines = []
    with path.open(encoding="latin-1") as file:
        for line in file:
            if BEGIN.match(line):
                break
            lines.append(line.split("$", 1)[0].rstrip())
        else:
            return None
    if not any(lines):
        return None
    common: dict[str, str] = {}
    found: list[Subcase] = []
    for match in filter(None, map(ENTRY.fullmatch, lines)):
        name, value = match[1].upper()[:LETTERS], match[2]
        if name == "SUBC" and value.isdigit():
            found.append(Subcase(int(value), dict(common)))
        else:
            (found[-1].entries if found else common)[name] = value
    return found or [Subcase(0, common)]
