"""Kinds of notes: what is well, what is approximated, and what to look at before the body is used."""

from __future__ import annotations

import re
from collections.abc import Iterable

# Beginnings of words of notes that need no action, and of those that tell how exact something is. All others are
# warnings, so that a note nobody thought of is not taken for good news.
WELL = (
    r"all \d+ [\w-]+ modes below .* were found",
    r"^there are no [\w-]+ modes below",
    r"cells have no property .* and are left out; their groups name nodes only",
    r"^the second-order modal mass \(T\) is included",
    r"^mixed interfaces: ",
    r"^exact: ",
    r"^the model has \d+ [\w-]+ modes only",
)
APPROXIMATE = (
    r"^error against the full model below",
    r"^rebuilt: ",
    r"^the file does not hold ",
    r"lies? below dropped modes",
    r"truncation_vectors leaves out 'interfaces'",
    r"has no place in this format",
    r"its inertia and offset are left out$",
)
KINDS = ("notes", "approximations", "warnings")


def kind_of(note: str) -> str:
    """Return one of `KINDS`.

    Examples
    --------
    >>> kind_of("all 19 fixed-interface modes below 49162 Hz were found (a dense solver leaves none out)")
    'notes'
    >>> kind_of("rebuilt: P, H"), kind_of("its size is implausible for a body of 120 m")
    ('approximations', 'warnings')
    """
    for kind, patterns in (("notes", WELL), ("approximations", APPROXIMATE)):
        if any(re.search(pattern, note) for pattern in patterns):
            return kind
    return "warnings"


def sorted_notes(notes: Iterable[str]) -> dict[str, list[str]]:
    """Return the notes of each kind, warnings first; kinds without notes are left out.

    Examples
    --------
    >>> sorted_notes(["rebuilt: P", "its mass is implausible"])
    {'warnings': ['its mass is implausible'], 'approximations': ['rebuilt: P']}
    """
    notes = list(notes)
    found = {kind: [note for note in notes if kind_of(note) == kind] for kind in reversed(KINDS)}
    return {kind: texts for kind, texts in found.items() if texts}
