"""A proposed interface, and how numbers and names are written in a pipeline file."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from modalprep.records import Record

BARE = re.compile(r"[A-Za-z0-9_-]+")


@dataclass(frozen=True, eq=False, kw_only=True)
class Proposal(Record):
    """An interface that a pipeline file may have.

    Attributes
    ----------
    name : str
    keys : str
        Its lines of TOML.
    what : str
        Of a comment and of the table.
    nodes : (k,) int
    direction : (3,) or None
        Axis of an opening.
    place : (3,) or None
        m, the middle of an opening.
    radius : float
        m, of an opening.
    likely : bool
        Whether it is taken where there is room.
    asked : bool
        Whether the deck itself keeps its nodes, so that there is always room.
    """

    name: str
    keys: str
    what: str
    nodes: np.ndarray
    direction: np.ndarray | None = None
    place: np.ndarray | None = None
    radius: float = 0.0
    likely: bool = True
    asked: bool = False


def numbers(values: Iterable[float], size: float) -> str:
    """Return numbers as a list of TOML, rounded to 1e-8 of a size, a hundredth of what node sets distinguish.

    Examples
    --------
    >>> numbers([15.000000000001, -1e-17, 1 / 3], 80.0)
    '[15, 0, 0.333333]'
    """
    return f"[{', '.join(number(value, size) for value in values)}]"


def number(value: float, size: float) -> str:
    """Return a number rounded to 1e-8 of a size, a hundredth of what node sets distinguish."""
    digits = 8 - int(np.ceil(np.log10(max(size, 1e-300))))
    return f"{round(float(value), digits) + 0.0:.10g}"


def quoted(text: str) -> str:
    """Return a text of TOML."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


def key(name: str) -> str:
    """Return a key of TOML.

    Examples
    --------
    >>> key("bolt_a"), key("bolt a")
    ('bolt_a', '"bolt a"')
    """
    return name if BARE.fullmatch(name) else quoted(name)


def comment(text: str) -> str:
    """Return lines of a comment."""
    return "\n".join(f"# {line}" if line else "#" for line in text.splitlines())


def slug(name: str) -> str:
    """Return a name without signs that references to interfaces cannot carry.

    Examples
    --------
    >>> slug("bolt / left.1")
    'bolt_left_1'
    """
    return re.sub(r"[^A-Za-z0-9_-]+", "_", name).strip("_") or "set"
