"""EXTRN cards: the points and components that the rows of the matrices of an external superelement belong to."""

from __future__ import annotations

from collections.abc import Iterable

from modalprep.fe.readers.nastran.cards import Card

LONGEST = 10**6  # rows of a table or a range


def boundary_points(cards: Iterable[Card]) -> dict[int, str]:
    """Return the points of EXTRN cards with their components, in order; ``7 THRU 9 0`` is a range.

    Returns
    -------
    {id: components}
        As ``"123456"``, of scalar points ``""``.

    Raises
    ------
    InputError
        When a point stands there twice, or its components are none.

    Examples
    --------
    >>> boundary_points([Card("EXTRN", ["3", "123456", "7", "THRU", "9", "0"], "a.pch", 2)])
    {3: '123456', 7: '', 8: '', 9: ''}
    """
    found: dict[int, str] = {}
    for card in cards:
        words = [text for text in card.fields if text]
        while words:
            span = 4 if words[1:2] == ["THRU"] else 2
            part = Card(card.name, words[:span], card.file, card.line)
            words = words[span:]
            first = part.integer(0, "a grid", lowest=1)
            last = part.integer(2, "the last grid", lowest=first) if span == 4 else first
            components = _components(part, span - 1)
            refuse_long(part, last - first)
            for number in range(first, last + 1):
                if number in found:
                    raise card.error(f"point {number} stands there twice; export it again")
                found[number] = components
    return found


def _components(card: Card, k: int) -> str:
    text = card.text(k)
    components = "" if text == "0" else "".join(sorted(text))
    if not text or set(components) - set("123456") or len(set(components)) < len(components):
        raise card.error(f"the components {text!r} are not of 1 to 6, or 0 for a scalar point; export it again")
    return components


def refuse_long(card: Card, count: int) -> None:
    """Refuse a range of more points than any boundary has.

    Examples
    --------
    >>> refuse_long(Card("EXTRN", ["7", "THRU", "9", "0"], "a.pch", 2), 3)
    """
    if count > LONGEST:
        raise card.error(f"a range of {count} points is too long; export it again")
