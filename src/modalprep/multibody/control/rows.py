"""Rows and columns of linear systems by names of states, inputs and outputs, with a weight or a density of each."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody.analysis.state_space import LinearSystem
from modalprep.multibody.control.truncation import ReducedSystem
from modalprep.suggest import suggestion


class Rows(NamedTuple):
    """Quantities ``C z + D i`` (k, nz) and (k, ni), and a number for each (k,)."""

    C: np.ndarray
    D: np.ndarray
    numbers: np.ndarray


def rows(linear: LinearSystem, given: Mapping[str, float], what: str) -> Rows:
    """Return named outputs and states as rows, with the numbers given.

    Raises
    ------
    InputError
        When a name is unknown, or a number is negative or not finite; `what` begins the sentence.

    Examples
    --------
    >>> one = LinearSystem(A=np.zeros((1, 1)), B=np.ones((1, 1)), C=np.full((1, 1), 2.0), D=np.zeros((1, 1)),
    ...                    states=("v",), inputs=("f",), outputs=("o",))
    >>> rows(one, {"o": 3.0, "v": 1.0}, "lqr: weight").C.ravel().tolist()
    [2.0, 1.0]
    """
    numbers = positive(given, what)
    found = [_row(linear, name, what) for name in given]
    C = np.array([row for row, _ in found]).reshape(len(found), len(linear.A))
    return Rows(C, np.array([row for _, row in found]).reshape(len(found), len(linear.inputs)), numbers)


def positive(given: Mapping[str, float], what: str, *, least: float = 0.0) -> np.ndarray:
    """Return the numbers of a mapping; those below `least`, negative or not finite are refused.

    Examples
    --------
    >>> positive({"hinge": 2.0}, "lqr: input")
    array([2.])
    """
    for name, number in given.items():
        if not isinstance(number, int | float | np.number) or not least <= number < float("inf"):
            raise InputError(f"{what} {name!r}: {number} is no positive number")
    return np.array(list(given.values()), dtype=float)


def places(given: Iterable[str], known: tuple[str, ...], what: str) -> list[int]:
    """Return where names are in a list of known ones.

    Raises
    ------
    InputError
        When one is not there.

    Examples
    --------
    >>> places(["b"], ("a", "b"), "kalman: input")
    [1]
    """
    for name in given:
        if name not in known:
            raise InputError(f"{what} {name!r} is not known; {suggestion(name, known, 'there are')}")
    return [known.index(name) for name in given]


def _row(linear: LinearSystem, name: str, what: str) -> tuple[np.ndarray, np.ndarray]:
    whole = linear.full if isinstance(linear, ReducedSystem) else linear
    if name in linear.outputs:
        k = linear.outputs.index(name)
        return linear.C[k], linear.D[k]
    (k,) = places([name], (*whole.states, *linear.outputs), what)
    row = linear.V[k] if isinstance(linear, ReducedSystem) else np.eye(len(linear.A))[k]
    return row, np.zeros(len(linear.inputs))
