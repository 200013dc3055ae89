"""Nastran DMIG cards: matrices by name between (grid, component) pairs (theory 8.1)."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.readers.entries import Labelled, labelled, mirrored
from modalprep.fe.readers.nastran.cards import Card
from modalprep.fe.readers.nastran.reader import read_cards

SQUARE, SYMMETRIC = 1, 6  # forms IFO
REAL = (1, 2)  # types TIN


def read_dmig(path: Path, scalar: bool = False, cards: Iterable[Card] | None = None) -> dict[str, Labelled]:
    r"""Return the square and symmetric matrices of a deck or punch file by their names.

    Of a symmetric one (form 6) the file gives one triangle; the other is added. Rows of scalar points have the
    component -1; they are refused unless they are `scalar` coordinates of the caller. `cards` are those of the file
    where the caller has read them.

    Raises
    ------
    InputError
        When there is no DMIG, one is complex or rectangular, or a column has no header.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "k.pch"
    >>> _ = path.write_text("DMIG,K,0,6,2,0\nDMIG,K,7,1,,7,1,4.\nDMIG,K,7,2,,7,1,-2.,\n,7,2,5.\n")
    >>> read_dmig(path)["K"].matrix.toarray().tolist()
    [[4.0, -2.0], [-2.0, 5.0]]
    """
    forms: dict[str, int] = {}
    columns: dict[str, list[Card]] = {}
    for card in read_cards(path).cards if cards is None else cards:
        if card.name == "DMIG" and card.text(1) == "0":
            forms[card.text(0)] = _form(card)
        elif card.name == "DMIG":
            if card.text(0) not in forms:
                raise card.error("its header (a zero in the second field) does not come before it; export it again")
            columns.setdefault(card.text(0), []).append(card)
    if not columns:
        raise InputError(f"{path} holds no DMIG matrix; give a deck or punch file with DMIG cards")
    return {name: _matrix(cards, forms[name], 0 if scalar else 1) for name, cards in columns.items()}


def _form(card: Card) -> int:
    form, kind = card.integer(2, "its form"), card.integer(3, "its type")
    if kind not in REAL:
        raise card.error(f"matrix {card.text(0)} is complex (type {kind}); give real stiffness and mass")
    return form


def _matrix(cards: list[Card], form: int, lowest: int) -> Labelled:
    if form not in (SQUARE, SYMMETRIC):
        raise cards[0].error(f"matrix {cards[0].text(0)} is rectangular (form {form}); give form 1 or 6")
    rows, columns, values = [], [], []
    for card in cards:
        column = _place(card, 1, lowest)
        for k in range(4, len(card.fields), 4):
            rows.append(_place(card, k, lowest))
            columns.append(column)
            values.append(card.real(k + 2, "the value"))
    found = labelled(np.array(rows), np.array(columns), np.array(values))
    return found._replace(matrix=mirrored(found.matrix)) if form == SYMMETRIC else found


def _place(card: Card, k: int, lowest: int) -> tuple[int, int]:
    component = card.integer(k + 1, "a component", 0)
    if not lowest <= component <= 6:
        raise card.error(f"component {component} of {card.text(k)}: scalar points have no place; give grids only")
    return card.integer(k, "a grid", lowest=1), component - 1
