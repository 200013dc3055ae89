"""The note on what cards that are read say besides, and the model does not have: damping, parameters, superelements."""

from __future__ import annotations

from collections.abc import Iterator

from modalprep.fe.mesh.left_out import left_out
from modalprep.fe.readers.nastran.cards import Card

DAMPING = {"MAT1": 7, "MAT2": 12, "MAT8": 16, "PCOMP": 6, "PCOMPG": 6, "PELAS": 2}  # field of the structural damping GE
PARAMETERS = ("G", "W3", "W4", "ALPHA1", "ALPHA2", "K6ROT", "SNORM", "COUPMASS")
SEID = 7  # field of a grid
ADVICE = (
    "damping is given in the pipeline file, superelements are one structure here, drilling stiffness and normals of "
    "shells are those of the elements, and the mass is consistent unless mass = 'nastran'"
)


def unused(cards: list[Card]) -> tuple[str, ...]:
    """Return the note on fields and parameters that are left out; empty without any.

    Examples
    --------
    >>> unused([Card("PARAM", ["G", ".02"], "a.bdf", 3)])[0][:39]
    'left out: 1 PARAM,G (a.bdf line 3); dam'
    """
    return left_out(((what, f"{card.file} line {card.line}") for card in cards for what in _of(card)), ADVICE)


def _of(card: Card) -> Iterator[str]:
    """Yield what a card says besides."""
    if card.name in DAMPING and card.real(DAMPING[card.name], "GE", 0.0):
        yield f"GE of {card.name}"
    if card.name == "GRID" and card.text(SEID) not in ("", "0"):
        yield "SEID of GRID"
    if card.name == "PARAM" and card.text(0) in PARAMETERS and card.text(1) != _usual(card):
        yield f"PARAM,{card.text(0)}"


def _usual(card: Card) -> str:
    """Return the value that asks for what the model has: the consistent mass."""
    return "1" if card.text(0) == "COUPMASS" else ""
