"""The files that the file management section of a Nastran deck assigns: ASSIGN INPUTT4."""

from __future__ import annotations

import re
from pathlib import Path

ASSIGN = re.compile(r"ASSIGN\s+INPUTT4\s*=\s*(?:'([^']*)'|([^\s,]+))[\s,]([^=]*)UNIT\s*=\s*(\d+)", re.IGNORECASE)
BEGIN = re.compile(r"^\s*BEGIN\b(?!\s+SUPER)", re.IGNORECASE)


def assigned(path: Path) -> dict[int, Path]:
    r"""Return the files of OUTPUT4 by their units, whether they are there or not.

    Examples
    --------
    >>> import tempfile
    >>> deck = Path(tempfile.mkdtemp()) / "a.bdf"
    >>> _ = deck.write_text("ASSIGN INPUTT4='part.op4',\n UNIT=31\nCEND\nBEGIN BULK\n")
    >>> {unit: file.name for unit, file in assigned(deck).items()}
    {31: 'part.op4'}
    """
    lines = []
    with path.open(encoding="latin-1") as file:
        for line in file:
            if BEGIN.match(line):
                break
            lines.append(line.split("$", 1)[0])
        else:
            return {}
    found = ASSIGN.finditer("\n".join(lines))
    return {int(match[4]): path.parent / (match[1] or match[2]).strip() for match in found}
