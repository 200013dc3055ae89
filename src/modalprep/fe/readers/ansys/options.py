"""KEYOPTs of the elements of a deck: which are used, which change nothing, which are refused and which are said."""

from __future__ import annotations

from collections.abc import Collection, Iterable

from modalprep.fe.readers.ansys.deck import Deck, Element

MEMBRANE = frozenset({1})
USED: dict[str, Collection[int]] = {  # by the number of the element, those that its handler reads
    "14": {2, 3},
    "21": {1, 3},
    "27": {2, 3},
    **dict.fromkeys(("63", "181", "281"), MEMBRANE),
    "95": {11},
    "184": {1},
    "185": {2},
    "186": {2},
}
_IDLE = {  # of output, storage and large strains, and of shapes and integration that are those of the elements here
    "4": {2, 6, 7, 9, 10},
    "8 180": {2, 12},
    "45 95": {1, 2, 4, 5, 6},
    "92 187 285": {5, 15, 16},
    "185 186": {15, 16, 17},
    "63": {2, 3, 5, 6, 7, 8, 9, 11},
    "181 281": {3, 5, 8, 9, 10},
    "188 189": {2, 3, 4, 6, 7, 9, 11, 12, 13, 15},
    "288 289": {2, 3, 4, 5, 6, 7, 8, 9, 11, 12, 13, 15},
    "154 200": set(range(20)),
    "27": {4},
}
IDLE = {number: options for numbers, options in _IDLE.items() for number in numbers.split()}
REFUSED = {  # element, KEYOPT, value: what it makes of the element
    ("63", 1, 2): "has bending stiffness alone",
    ("181", 1, 2): "has no stiffness, and stress alone",
    ("281", 1, 2): "has no stiffness, and stress alone",
    ("185", 3, 1): "is layered",
    ("186", 3, 1): "is layered",
    ("14", 1, 1): "is nonlinear",
}


def check_options(deck: Deck, first: dict[int, Element], ignored: Iterable[str], name_of: dict[str, str]) -> None:
    """Refuse KEYOPTs that make another element of one, and say those that are not used.

    Parameters
    ----------
    deck : Deck
    first : {type: Element}
        An element of each type that the deck uses.
    ignored : names of elements that are left out
    name_of : {number: name}
        Names in Ansys' library.

    Raises
    ------
    InputError
        Which names the first element of the type.
    """
    for number, element in first.items():
        kind = deck.types.get(number)
        if kind is None or not {kind.name, name_of.get(kind.name, kind.name)}.isdisjoint(ignored):
            continue
        name = name_of.get(kind.name, kind.name)
        for option, value in sorted(kind.options.items()):
            if (kind.name, option, value) in REFUSED:
                what = REFUSED[kind.name, option, value]
                raise deck.error(element, f"{name} with KEYOPT({option}) = {value} {what}; name {name} in 'ignore'")
            known = {*USED.get(kind.name, ()), *IDLE.get(kind.name, ())}
            if value and option not in known:
                deck.note(f"KEYOPT({option}) = {value} of {name} (type {number}) is not used")
