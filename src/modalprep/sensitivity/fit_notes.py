"""What weakens the estimates of a fit, in sentences."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from modalprep.sensitivity.parameters import Parameter

ALIKE = 0.95  # correlation of two estimates, from which on it is told
KNOWN = 1.0  # standard deviation over the estimate, from which on it is hardly one
MISFIT = 3.0  # standard deviations of the mean square of white noise
MEMORY = 4.0  # standard deviations of the correlation of neighbours in white noise
FAINT = 0.1  # mean square of residuals in units of the noise, below which they are those of the integration
LEAST = 20  # numbers of a channel, below which its residuals tell nothing


def notes_of(
    parameters: Sequence[Parameter],
    found: Any,
    deviation: np.ndarray,
    correlation: np.ndarray,
    bounds: np.ndarray,
    residuals: dict[str, np.ndarray],
    noise_given: bool,
) -> tuple[str, ...]:
    """Return the notes of a fit: its search, its parameters, its residuals (nt,) by channel, in units of the noise."""
    names = [each.name for each in parameters]
    return (
        *_search(found),
        *_undetermined(names, found.x, deviation),
        *_at_bounds(names, found.x, bounds, found.active_mask),
        *_alike(names, correlation),
        *(_misfit(np.concatenate(list(residuals.values())), len(names)) if noise_given else ()),
        *_memory(residuals),
    )


def _search(found: Any) -> Iterator[str]:
    if found.status <= 0:
        yield f"the search has not converged after {found.nfev} runs; start it from these estimates, or raise most_runs"


def _undetermined(names: list[str], x: np.ndarray, deviation: np.ndarray) -> Iterator[str]:
    for name, value, error in zip(names, x, deviation, strict=True):
        if not np.isfinite(error):
            yield f"{name} is not determined by the measurement: other values fit as well"
        elif error > KNOWN * abs(value):
            yield f"{name} is hardly determined by the measurement: {value:.4g} with the standard deviation {error:.2g}"


def _at_bounds(names: list[str], x: np.ndarray, bounds: np.ndarray, active: np.ndarray) -> Iterator[str]:
    for k, name in enumerate(names):
        if active[k]:
            side = "lower" if active[k] < 0 else "upper"
            bound = bounds[0 if active[k] < 0 else 1, k]
            yield f"{name} is at its {side} bound, {bound:g}: it and its interval are no free estimate"


def _alike(names: list[str], correlation: np.ndarray) -> Iterator[str]:
    for i, one in enumerate(names):
        for j in range(i):
            if np.isfinite(correlation[i, j]) and abs(correlation[i, j]) > ALIKE:
                yield f"{names[j]} and {one} are correlated by {correlation[i, j]:.3f}: they are hardly told apart"


def _misfit(residuals: np.ndarray, parameters: int) -> Iterator[str]:
    square = float(np.nansum(residuals**2))
    free = int(np.isfinite(residuals).sum()) - parameters
    if square > free + MISFIT * np.sqrt(2 * free):
        yield (
            f"residuals are {np.sqrt(square / free):.3g} times the noise given: the model misses something, and the "
            "intervals are too narrow"
        )


def _memory(residuals: dict[str, np.ndarray]) -> Iterator[str]:
    """Tell residuals whose neighbours are alike: of white noise their correlation is 0 +- 1 / sqrt(n)."""
    for name, column in residuals.items():
        pairs = np.isfinite(column[1:]) & np.isfinite(column[:-1])
        n = int(pairs.sum())
        if n < LEAST or np.nanmean(column**2) < FAINT:
            continue
        r = float(np.sum((column[1:] * column[:-1])[pairs]) / np.nansum(column**2))
        if r > MEMORY / np.sqrt(n):
            yield (
                f"residuals of {name} are no white noise (neighbours are correlated by {r:.2f}): the model "
                "misses something, and the intervals are too narrow"
            )
