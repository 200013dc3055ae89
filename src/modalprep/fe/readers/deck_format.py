"""Whose input deck a file is: by its ending, or by its first lines where several programs use the ending."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Literal

DeckFormat = Literal["abaqus", "ansys", "nastran"]

BY_ENDING: dict[str, DeckFormat | None] = {
    **dict.fromkeys((".bdf", ".nas", ".blk", ".dat"), "nastran"),
    ".inp": "abaqus",
    **dict.fromkeys((".cdb", ".ans"), "ansys"),
    ".txt": None,
}
SHARED = (".dat", ".inp", ".ans", ".txt")  # endings that several programs use
BEGINNING = 65536  # bytes
SIGNS: dict[DeckFormat, re.Pattern[str]] = {
    "ansys": re.compile(r"\s*(/(PREP7|BATCH|COM|TITLE|NOPR|UNITS|WB|CONFIG|CLEAR)\b|[NE]BLOCK\s*,|ET\s*,\s*\d)", re.I),
    "abaqus": re.compile(
        r"\s*\*\s*(HEADING|NODE|ELEMENT|PART|INCLUDE|PREPRINT|PARAMETER|MATERIAL|ASSEMBLY|SYSTEM|[NE]\s?SET|SURFACE)\b",
        re.I,
    ),
    "nastran": re.compile(
        r"\s*(SOL\s+\d|CEND\b|BEGIN\s+(BULK|SUPER)|NASTRAN\s|GRID[*,\s]|C(BAR|BEAM|ROD|QUAD4|TRIA3|HEXA|TETRA)[*,\s])",
        re.I,
    ),
}


def deck_format(path: Path) -> DeckFormat | None:
    r"""Return the program whose deck a file is; None of a file that is no deck.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "ds.dat"
    >>> _ = path.write_text("/batch\n/prep7\n")
    >>> deck_format(path), deck_format(Path("arm.bdf")), deck_format(Path("arm.msh"))
    ('ansys', 'nastran', None)
    """
    ending = path.suffix.lower()
    if ending in SHARED and path.is_file():
        with path.open("rb") as file:
            lines = file.read(BEGINNING).decode("utf-8-sig", errors="replace").splitlines()
        for line in lines:
            for name, sign in SIGNS.items():
                if sign.match(line):
                    return name
    return BY_ENDING.get(ending)
