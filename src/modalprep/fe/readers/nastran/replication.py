"""Replication of Nastran cards: fields that repeat or increase those of the card before.

``=`` repeats a field, ``==`` all fields from there on, and ``*(x)`` or ``*x`` adds x to it; ``=`` as a name repeats the
name. ``=(n)`` or ``=n`` as a name makes n more cards with the same increments.
"""

from __future__ import annotations

import re

from modalprep.fe.readers.numbers import real

INCREMENT = re.compile(r"\*\(?([+-]?[\d.][\dED.+-]*)\)?")
COUNT = re.compile(r"=\(?(\d+)\)?")
TOKEN = re.compile(r"=+|\*\(?[+-]?[\d.][\dED.+-]*\)?")


def repeats(data: list[str]) -> bool:
    """Whether fields of a line refer to the card before.

    Examples
    --------
    >>> repeats(["3", "=", "*(1.)"]), repeats(["3", "1.5-6"])
    (True, False)
    """
    return any(TOKEN.fullmatch(text) for text in data)


def count(head: str) -> int | None:
    """Return n of the name ``=(n)`` or ``=n``; None of any other.

    Examples
    --------
    >>> count("=(12)"), count("=")
    (12, None)
    """
    match = COUNT.fullmatch(head)
    return int(match[1][:9]) if match else None


def replicated(data: list[str], before: list[str]) -> tuple[list[str], dict[int, str]]:
    """Return the fields of a line, and the increments by place; `before` are the fields of the line before.

    Raises
    ------
    ValueError
        When a field that is to increase is no number.

    Examples
    --------
    >>> replicated(["*1", "=", "*(.5)", "=="], ["7", "2", "1.", "3", "4"])
    (['8', '2', '1.5', '3', '4'], {0: '1', 2: '.5'})
    """
    before = before + [""] * (len(data) - len(before))
    fields = []
    steps = {}
    for k, text in enumerate(data):
        if text == "==":
            return fields + before[k:], steps
        match = INCREMENT.fullmatch(text)
        if match:
            steps[k] = match[1]
            text = increased(before[k], match[1])
        fields.append(before[k] if text == "=" else text)
    return fields, steps


def increased(text: str, step: str) -> str:
    """Return the sum of two numbers as fields; whole numbers stay whole.

    Raises
    ------
    ValueError
        When one of the two is no number.

    Examples
    --------
    >>> increased("9", "1"), increased("1.5-1", ".05")
    ('10', '0.2')
    """
    if re.fullmatch(r"[+-]?\d+", text) and re.fullmatch(r"[+-]?\d+", step):
        return str(int(text) + int(step))
    total = float(f"{_number(text) + _number(step):.15g}")
    whole = repr(total)
    return whole if "." in whole or "e" in whole or "n" in whole else whole + "."


def _number(text: str) -> float:
    value = real(text)
    if isinstance(value, str):
        raise ValueError(f"{text!r} is no number that can increase")
    return value
