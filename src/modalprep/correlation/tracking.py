"""The same mode along a study: a number for each mode that follows its shape, not its place in the list."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

from modalprep.correlation.criteria import mac
from modalprep.correlation.mode_set import ModeSet
from modalprep.errors import InputError

UNSURE = 0.6  # MAC below which a step of the study is too large to follow a mode


def track_modes(
    grid: Mapping[tuple[int, ...], ModeSet],
) -> tuple[dict[tuple[int, ...], np.ndarray], dict[tuple[int, ...], np.ndarray]]:
    """Number the modes of all cases of a study so that the same shape keeps its number.

    Modes are paired between neighbours of the grid, from the first case on, each case with that neighbour to which its
    modes are most alike. So a crossing of two frequencies is passed, also where one way around it is too coarse.

    Parameters
    ----------
    grid : {place: ModeSet}
        By the indices of the case's values; the same points and as many modes in each case.

    Returns
    -------
    number : {place: (n,) int}
        Number of each mode, from 0, those of the first case being 0, 1, ...
    certainty : {place: (n,) float}
        MAC with the neighbour from which the number comes; below 0.6 it is a guess.

    Raises
    ------
    InputError
        When the cases have different points or numbers of modes, or are no grid of neighbours.

    Examples
    --------
    >>> from modalprep.correlation import body_modes
    >>> from modalprep.examples import uniform_beam
    >>> modes = body_modes(uniform_beam(modes=4))
    >>> number, certainty = track_modes({(0,): modes, (1,): modes.select(np.array([1, 0, 2, 3]))})
    >>> number[1,].tolist()
    [1, 0, 2, 3]
    """
    _refuse_different(list(grid.values()))
    first = min(grid)
    number = {first: np.arange(grid[first].n)}
    certainty = {first: np.ones(grid[first].n)}
    links = {first: [(q, *_match(grid[first], grid[q])) for q in _neighbours(first, grid)]}
    while len(number) < len(grid):
        waiting = [(p, *link) for p, found in links.items() for link in found if link[0] not in number]
        if not waiting:
            raise InputError("the cases of the study are no grid of neighbours; give indices without gaps")
        here, there, order, alike = max(waiting, key=lambda link: link[3].min(initial=1.0))
        number[there], certainty[there] = number[here][order], alike
        links[there] = [(q, *_match(grid[there], grid[q])) for q in _neighbours(there, grid) if q not in number]
    return number, certainty


def _refuse_different(cases: Sequence[ModeSet]) -> None:
    if not cases:
        raise InputError("the study has no cases")
    for case in cases[1:]:
        if case.n != cases[0].n or case.points.shape != cases[0].points.shape:
            raise InputError(
                f"{case.name} has {case.n} modes at {len(case.points)} points, {cases[0].name} {cases[0].n} at "
                f"{len(cases[0].points)}; track modes of one mesh and of one number"
            )


def _neighbours(place: tuple[int, ...], grid: Mapping[tuple[int, ...], ModeSet]) -> list[tuple[int, ...]]:
    steps = [(k, d) for k in range(len(place)) for d in (-1, 1)]
    near = [(*place[:k], place[k] + d, *place[k + 1 :]) for k, d in steps]
    return [p for p in near if p in grid]


def _match(a: ModeSet, b: ModeSet) -> tuple[np.ndarray, np.ndarray]:
    """Return, for each mode of b, the mode of a that it is, and their MAC."""
    known = a.measured & b.measured
    table = mac(a.shape[known], b.shape[known])
    i, j = linear_sum_assignment(-table)
    order = np.empty(b.n, dtype=int)
    order[j] = i
    return order, table[order, np.arange(b.n)]
