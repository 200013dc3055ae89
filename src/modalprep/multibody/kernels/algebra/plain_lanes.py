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


def larger(a: Lanes, b: Lanes) -> Lanes:
    """Return the larger of two numbers in each of four lanes."""
    return np.where(a > b, a, b).view(Lanes)


def largest(v: Lanes) -> float:
    """Return the largest of four numbers."""
    return float(v.max())


def first_at_least(v: Lanes, value: float) -> int:
    """Return which of four numbers is the first that is not less than a value; beyond them if none is."""
    return int(np.argmax(v >= value)) if (v >= value).any() else 64


def above(v: Lanes, bounds: Lanes, other: float) -> Lanes:
    """Return four numbers, the other one in place of those that are not larger than their bounds."""
    return np.where(v > bounds, v, other).view(Lanes)


def with_lane(v: Lanes, k: int, value: float) -> Lanes:
    """Return four numbers, a value in place of number k; all as they are where there is none."""
    return np.where(np.arange(4) == k, value, v).view(Lanes)


def earlier(v: Lanes) -> Lanes:
    """Return the last three of four numbers, then any."""
    return np.roll(v, -1)


def after_third(u: Lanes, v: Lanes) -> Lanes:
    """Return the third number of u, then the first three of v."""
    return np.concatenate([u[2:3], v[:3]]).view(Lanes)
