"""Whether a deck is one of Abaqus or of CalculiX: what only one of the two programs has says which.

Both read the same keywords, but a few of them mean something else: ``SECTION=CIRC`` has a radius in Abaqus and one or
two diameters in CalculiX.

References
----------
G. Dhondt, CalculiX CrunchiX User's Manual, version 2.20, ``*BEAM SECTION``. Abaqus Analysis User's Guide, Beam
cross-section library.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Literal, NamedTuple, get_args

from modalprep.fe.readers.abaqus.lexer import Block
from modalprep.suggest import refuse_unknown

Dialect = Literal["abaqus", "calculix"]

KEYWORDS: dict[Dialect, str] = {
    "abaqus": (
        "PART|INSTANCE|ASSEMBLY|PREPRINT|NGEN|NFILL|NCOPY|ELGEN|ELCOPY|SYSTEM|ROTARY INERTIA|BEAM GENERAL SECTION|"
        "SHELL GENERAL SECTION|TRANSVERSE SHEAR STIFFNESS|DISTRIBUTION TABLE|SECTION CONTROLS|SECTION POINTS|"
        "CONNECTOR .*|FRAME SECTION|HOURGLASS STIFFNESS|PARAMETER|FASTENER|DISPLAY BODY|NONSTRUCTURAL MASS"
    ),
    "calculix": "VALUES AT INFINITY|USER SECTION|DESIGN VARIABLES|SENSITIVITY|NO ANALYSIS|REFINE MESH|TRANSFORMF",
}
ELEMENTS: dict[Dialect, str] = {
    "abaqus": (
        r"B33.*|B3[123]H|B3[12]OS.*|PIPE.*|S4R5|S8R5|S9R5|STRI3|STRI65|C3D\w*H|C3D5|ROTARYI|R3D[34]|RB3D2|CONN3D2"
    ),
    "calculix": "B3[12]R|S6|S8|U1",
}
SECTIONS: dict[Dialect, str] = {"abaqus": "I|L|T|TRAPEZOID|ARBITRARY|HEX|THICK ?PIPE", "calculix": "GENERAL"}
OPTIONS: dict[Dialect, set[tuple[str, str]]] = {
    "abaqus": {("OUTPUT", "FIELD"), ("OUTPUT", "HISTORY")},
    "calculix": {
        ("BEAM SECTION", "OFFSET1"),
        ("BEAM SECTION", "OFFSET2"),
        ("BEAM SECTION", "NODAL THICKNESS"),
        ("RIGID BODY", "ROT NODE"),
        ("FREQUENCY", "STORAGE"),
    },
}
SOLVERS = "SPOOLES|PASTIX|PARDISO|ITERATIVE.*|MATRIXSTORAGE|TAUCS|SGI"  # of CalculiX, in SOLVER=


class Spoken(NamedTuple):
    """The dialect of a deck, None where nothing tells it, and what does."""

    dialect: Dialect | None
    proof: str

    def asked(self, block: Block, what: str) -> Dialect:
        """Return the dialect for a keyword that means something else in either."""
        if self.dialect is None:
            block.refuse(
                f"{what}, and the deck does not tell which of them wrote it{self.proof and f' ({self.proof})'}; "
                'give dialect = "abaqus" or "calculix" in [mesh], or --dialect'
            )
        return self.dialect


def spoken(blocks: list[Block], given: str | None) -> Spoken:
    """Return the dialect that is given, or that the blocks of a deck prove.

    Examples
    --------
    >>> from modalprep.fe.readers.abaqus.lexer import Options
    >>> beam = Block("ELEMENT", Options(TYPE="B32R"), "a.inp", 7)
    >>> spoken([beam], None)
    Spoken(dialect='calculix', proof='TYPE=B32R in line 7')
    """
    if (dialect := dialect_of(given)) is not None:
        return Spoken(dialect, "as given")
    found: dict[Dialect, str] = {}
    for block in blocks:
        for dialect, proof in _proofs(block):
            found.setdefault(dialect, f"{proof} in line {block.line}")
    if len(found) == 1:
        return Spoken(*found.popitem())
    return Spoken(None, f"{found['abaqus']} is of Abaqus, {found['calculix']} of CalculiX" if found else "")


def dialect_of(name: str | None) -> Dialect | None:
    """Return the dialect of a name.

    Raises
    ------
    InputError
        When there is none of this name.

    Examples
    --------
    >>> dialect_of("calculix")
    'calculix'
    """
    if name is not None:
        refuse_unknown(name, get_args(Dialect), "dialect of a deck:")
    return next((dialect for dialect in get_args(Dialect) if dialect == name), None)


def _proofs(block: Block) -> Iterator[tuple[Dialect, str]]:
    """Yield the dialects that alone have what a block says, and that."""
    kind = block.choice("TYPE").replace(" ", "") if block.keyword == "ELEMENT" else ""
    section = block.choice("SECTION") if block.keyword == "BEAM SECTION" else ""
    for dialect in get_args(Dialect):
        if re.fullmatch(KEYWORDS[dialect], block.keyword):
            yield dialect, f"*{block.keyword}"
        if re.fullmatch(ELEMENTS[dialect], kind):
            yield dialect, f"TYPE={kind}"
        if re.fullmatch(SECTIONS[dialect], section):
            yield dialect, f"SECTION={section}"
        for name in block.options:
            if (block.keyword, name) in OPTIONS[dialect]:
                yield dialect, f"*{block.keyword}, {name}"
    if re.fullmatch(SOLVERS, block.choice("SOLVER")):
        yield "calculix", f"SOLVER={block.options['SOLVER']}"
    if section == "CIRC" and block.row().text(1):
        yield "calculix", "SECTION=CIRC with two diameters"
