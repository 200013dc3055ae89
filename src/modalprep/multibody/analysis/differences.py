"""Jacobians by central differences with Richardson extrapolation, each entry with an estimate of its error.

`scipy.differentiate.jacobian` calls a smooth function more often, loses a digit or two where the function has
round-off, and gives up where it is not finite at the first step.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

LEVELS = 9  # steps of a column: h, h/2, ... h/256
SHORTER = 9  # trials of the largest step, each an eighth of the previous one
GOOD = 1e-13  # error relative to the largest entry of a column, at which no smaller step is tried
FAIR = 1e-9  # where half a step does not halve such an error, it is round-off, which smaller steps only enlarge


def jacobian(function: Callable, steps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the derivative of ``function(z) (m,)`` at z = 0, and its estimated error, both (m, len(steps)).

    Ridders (1982): the differences of successively halved steps are extrapolated to zero; each entry is the value of
    the extrapolation table that differs least from its neighbours. Exact up to round-off where the function is
    quadratic. Steps are shorter where it is not finite; the error is infinite where it never is.

    Parameters
    ----------
    steps : (n,)
        Largest step of each variable.

    Examples
    --------
    >>> J, error = jacobian(lambda z: np.array([np.sin(z[0]), np.exp(2 * z[0])]), np.array([0.1]))
    >>> bool(np.abs(J[:, 0] - [1, 2]).max() < 1e-12), bool(error.max() < 1e-11)
    (True, True)
    >>> J, error = jacobian(lambda z: z**3 + z if abs(z[0]) < 0.02 else z + np.nan, np.array([0.1]))
    >>> J.round(12), bool(error.max() < 1e-12)
    (array([[1.]]), True)
    """
    columns = [_column(function, step * unit, step) for step, unit in zip(steps, np.eye(len(steps)), strict=True)]
    if not columns:
        none = np.zeros((len(function(np.zeros(0))), 0))
        return none, none
    return np.column_stack([c[0] for c in columns]), np.column_stack([c[1] for c in columns])


def _column(function: Callable, step: np.ndarray, size: float) -> tuple[np.ndarray, np.ndarray]:
    def slope(h: float) -> np.ndarray:
        return (function(h * step) - function(-h * step)) / (2 * h * size)

    longest, row = _largest_step(slope)
    best = row[0]
    error = np.full(len(row[0]), np.inf)
    for level in range(1, LEVELS):
        new = [slope(0.5**level * longest)]
        before = error.max(initial=0.0)
        for k, old in enumerate(row):
            new.append(new[k] + (new[k] - old) / (4.0 ** (k + 1) - 1))
            guess = np.maximum(np.abs(new[-1] - new[-2]), np.abs(new[-1] - old))
            better = guess < error
            best = np.where(better, new[-1], best)
            error = np.where(better, guess, error)
        row = new
        left = error.max(initial=0.0)
        largest = np.abs(best).max(initial=0.0)
        if left <= GOOD * largest or (before <= FAIR * largest and left > before / 2):
            break
    return best, error


def _largest_step(slope: Callable) -> tuple[float, list[np.ndarray]]:
    """Return the first of the steps 1, 1/8, 1/64, ... with a finite slope (else the last), and that slope."""
    h, first = 1.0, slope(1.0)
    for _ in range(SHORTER - 1):
        if np.all(np.isfinite(first)):
            break
        h *= 0.125
        first = slope(h)
    return h, [first]
