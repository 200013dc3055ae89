"""Lanes where nothing is compiled: arrays of four numbers. An access beyond the end of an array is an error."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np


class Lanes(np.ndarray):
    """Four numbers, a value like a number: ``v += w`` leaves other names of v alone."""

    def __iadd__(self, other: np.ndarray | float) -> Lanes:
        return self + other


def load(a: np.ndarray, i: int) -> Lanes:
    """Four numbers ``a[i:i + 4]``."""
    return np.array(np.reshape(a[i : i + 4], 4)).view(Lanes)


def store(a: np.ndarray, i: int, v: Lanes) -> None:
    """Write four numbers to ``a[i:i + 4]``."""
    a[i : i + 4] = np.reshape(v, 4)


def spread(value: float) -> Lanes:
    """Return four times the same number."""
    return np.full(4, value).view(Lanes)


def arrangement(*places: int) -> Callable[[Lanes], Lanes]:
    """Return the function that arranges four numbers anew: those at these places, a zero for 4."""
    return lambda v: np.append(v, 0.0)[list(places)].view(Lanes)


def join(a: float, b: float, c: float, d: float) -> Lanes:
    """Return four numbers in one."""
    return np.array([a, b, c, d]).view(Lanes)


def total(v: Lanes) -> float:
    """Return the sum of four numbers."""
    return float(v.sum())


def numbers(v: Lanes) -> tuple[float, ...]:
    """Return four numbers as a tuple."""
    return tuple(v.tolist())


def sums(*each: Lanes) -> Lanes:
    """Return the sums of four lanes."""
    return np.sum(each, axis=1).view(Lanes)


def transpose(*each: Lanes) -> tuple[Lanes, ...]:
    """Return the first numbers of four lanes, then their second ones, and so on."""
    return tuple(row.view(Lanes) for row in np.transpose(each))
