"""The unit of length of IGES files."""

from __future__ import annotations

import re
from pathlib import Path

UNITS = {  # flag of the global section: OpenCASCADE's name, m
    1: ("INCH", 0.0254),
    2: ("MM", 1e-3),
    4: ("FT", 0.3048),
    5: ("MI", 1609.344),
    6: ("M", 1.0),
    7: ("KM", 1e3),
    8: ("MIL", 2.54e-5),
    9: ("UM", 1e-6),
    10: ("CM", 1e-2),
    11: ("UIN", 2.54e-8),
}
NAMES = {"IN": 1, "INCH": 1} | {name: flag for flag, (name, _) in UNITS.items()}
GLOBAL = re.compile(r"^(.{0,72}?)G *\d{1,7}\s*$", re.MULTILINE)
NAMED = 3  # the flag of a unit that the next field names
FLAG = 13  # which field it is, counted from 0


def iges_unit(path: Path) -> tuple[str, float]:
    """Return OpenCASCADE's name of the unit of an IGES file, and the unit in m; millimetres where it says none.

    References
    ----------
    IGES 5.3 (1996), 2.2.4.3, fields 14 and 15 of the global section.
    """
    text = path.read_bytes().decode("latin-1")
    fields = _fields("".join(GLOBAL.findall(text)))
    try:
        flag = int(fields[FLAG] or 1)
        return UNITS[NAMES[fields[FLAG + 1].upper()] if flag == NAMED else flag]
    except (IndexError, ValueError, KeyError):
        return UNITS[2]


def _fields(text: str) -> list[str]:
    """Split a global section at its own delimiters; texts are ``nH`` and n characters.

    Examples
    --------
    >>> _fields("1H,,1H;,4Ha,b;,2HMM;")
    [',', ';', 'a,b;', 'MM']
    """
    separator = ","
    end = ";"
    found = []
    at = 0
    while at < len(text):
        mark = re.compile(r"\s*(\d+)H").match(text, at)
        if mark:
            stop = mark.end() + int(mark[1])
            found.append(text[mark.end() : stop])
        else:
            stop = next((k for k in range(at, len(text)) if text[k] in separator + end), len(text))
            found.append(text[at:stop].strip())
        if len(found) == 1 and found[0]:
            separator = found[0]
        if len(found) == 2 and found[1]:
            end = found[1]
        if stop >= len(text) or text[stop] == end:
            break
        at = stop + 1
    return found
