"""The same mode along a study: a number for each mode that follows its shape, not its place in the list."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from modalprep.correlation.criteria import mac
from modalprep.correlation.mode_set import ModeSet
from modalprep.errors import InputError
from modalprep.records import Record

UNSURE = 0.6  # MAC below which a step of the study is too large to follow a mode
LOST = 0.3  # MAC below which a mode is another one: one leaves the list of modes, and one enters it
UNSEEN = 0.5  # stands for the MAC of modes of equal rank among those without displacement of the nodes
NOISE = 1e-6  # of the largest displacement of any mode: below it a mode of unit mass has rotations only
Indices = tuple[int, ...]


@dataclass(frozen=True, eq=False, kw_only=True)
class Tracks(Record):
    """Modes that are followed through a study.

    Attributes
    ----------
    number : {place: (n,) int}
        Number of each mode, from 0; those of the first case are 0, 1, ..., modes that appear later have further ones.
    certainty : {place: (n,) float}
        Largest MAC with a neighbour from which the number comes; below 0.6 it is uncertain. 1 where a number begins.
    conflicts : tuple of (place, place, int, int)
        Neighbours between which a mode is most like itself under another number: which of the two it is depends on the
        way through the study. The two numbers follow the places.

    Examples
    --------
    >>> from modalprep.correlation import body_modes
    >>> from modalprep.examples import uniform_beam
    >>> modes = body_modes(uniform_beam(modes=4))
    >>> track_modes({(0,): modes, (1,): modes.select(np.array([1, 0]))})
    Tracks(4 modes in 2 cases, 0 with a low MAC, 0 conflicts)
    """

    number: Mapping[Indices, np.ndarray]
    certainty: Mapping[Indices, np.ndarray]
    conflicts: tuple[tuple[Indices, Indices, int, int], ...] = ()

    @property
    def count(self) -> int:
        """How many different modes there are."""
        return 1 + max(int(found.max(initial=-1)) for found in self.number.values())

    @property
    def low_mac(self) -> list[tuple[Indices, int]]:
        """Place and row of each mode whose number is uncertain, as its MAC with its neighbour is below 0.6."""
        return [(p, int(k)) for p, sure in self.certainty.items() for k in np.flatnonzero(sure < UNSURE)]

    def __repr__(self) -> str:
        """Numbers of modes, cases and uncertain numbers."""
        uncertain = f"{len(self.low_mac)} with a low MAC, {len(self.conflicts)} conflicts"
        return f"Tracks({self.count} modes in {len(self.number)} cases, {uncertain})"


def track_modes(grid: Mapping[Indices, ModeSet]) -> Tracks:
    """Number the modes of all cases of a study so that the same shape keeps its number.

    From the first case on, that case comes next whose modes are most like those of its neighbours; its modes take the
    numbers of the neighbours that they are most like. So a crossing of two frequencies is passed, also where one way
    around it is too coarse. A mode that leaves the list and comes back elsewhere has one number where neighbours tell
    so. Then all pairs of neighbours are compared, also those that gave no numbers.

    Parameters
    ----------
    grid : {place: ModeSet}
        By the indices of the case's values; of the same points in each case.

    Returns
    -------
    Tracks

    Raises
    ------
    InputError
        When the cases have different points, or are no grid of neighbours.

    References
    ----------
    Pairs of largest total MAC, of which `mac` has the source.

    Examples
    --------
    >>> from modalprep.correlation import body_modes
    >>> from modalprep.examples import uniform_beam
    >>> modes = body_modes(uniform_beam(modes=4))
    >>> found = track_modes({(0,): modes, (1,): modes.select(np.array([1, 0, 2, 3]))})
    >>> found.number[1,].tolist()
    [1, 0, 2, 3]
    """
    _refuse_different(list(grid.values()))
    alike = {(p, q): _alike(grid[p], grid[q]) for p in grid for q in _after(p, grid)}
    alike |= {(q, p): table.T for (p, q), table in alike.items()}
    first = min(grid)
    number = {first: np.arange(grid[first].n)}
    certainty = {first: np.ones(grid[first].n)}
    while len(number) < len(grid):
        waiting = [link for link in alike if link[0] in number and link[1] not in number]
        if not waiting:
            raise InputError("the cases of the study are no grid of neighbours; give indices without gaps")
        there = max(waiting, key=lambda link: _total(alike[link]))[1]
        known = {p: alike[p, there] for p, q in alike if q == there and p in number}
        number[there], certainty[there] = _numbered(known, number)
    _merge(alike, number)
    return Tracks(number=number, certainty=certainty, conflicts=tuple(_conflicts(alike, number)))


def _refuse_different(cases: Sequence[ModeSet]) -> None:
    if not cases:
        raise InputError("the study has no cases")
    for case in cases[1:]:
        if case.points.shape != cases[0].points.shape:
            raise InputError(
                f"{case.name} has {len(case.points)} points, {cases[0].name} {len(cases[0].points)}; modes are "
                "followed on one mesh, which the study must not change"
            )


def _after(place: Indices, grid: Mapping[Indices, ModeSet]) -> list[Indices]:
    """Return the neighbours of a case with the next value of one parameter."""
    next_ones = [(*place[:k], place[k] + 1, *place[k + 1 :]) for k in range(len(place))]
    return [p for p in next_ones if p in grid]


def _alike(a: ModeSet, b: ModeSet) -> np.ndarray:
    known = a.measured & b.measured
    table = mac(a.shape[known], b.shape[known])
    blind_a = unseen(a)
    blind_b = unseen(b)
    table[blind_a], table[:, blind_b] = 0.0, 0.0
    rows, columns = np.flatnonzero(blind_a), np.flatnonzero(blind_b)
    both = min(len(rows), len(columns))
    table[rows[:both], columns[:both]] = UNSEEN
    return table


def unseen(modes: ModeSet) -> np.ndarray:
    """Return which modes (n,) turn the nodes without displacing them, as in torsion of a straight beam."""
    size = np.nanmax(np.abs(modes.shape), axis=(0, 1), initial=0.0)
    return size <= NOISE * size.max(initial=0.0) if modes.unit_mass else size == 0


def _total(table: np.ndarray) -> float:
    return float(table[linear_sum_assignment(-table)].sum() / min(table.shape)) if table.size else 0.0


def _numbered(
    known: Mapping[Indices, np.ndarray], number: Mapping[Indices, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Return the numbers and the certainty of the modes of a case, by its MAC with neighbours that have numbers."""
    count = 1 + max(int(found.max(initial=-1)) for found in number.values())
    n = next(iter(known.values())).shape[1]
    table = np.zeros((count, n))
    for place, own in known.items():
        rows = number[place]
        table[rows] = np.maximum(table[rows], own)
    found = np.full(n, -1)
    certainty = np.ones(n)
    for i, j in zip(*linear_sum_assignment(-table), strict=True):
        if table[i, j] >= LOST:
            found[j] = i
            certainty[j] = table[i, j]
    new = found < 0
    found[new] = count + np.arange(new.sum())
    return found, certainty


def _merge(alike: Mapping[tuple[Indices, Indices], np.ndarray], number: Mapping[Indices, np.ndarray]) -> None:
    """Give one number to modes that are alike under two numbers which no case has both; then count without gaps."""
    for _, _, i, j in _conflicts(alike, number):
        if not any({i, j} <= set(own.tolist()) for own in number.values()):
            for own in number.values():
                own[own == max(i, j)] = min(i, j)
    used = np.unique(np.concatenate(list(number.values())))
    for own in number.values():
        own[:] = np.searchsorted(used, own)


def _conflicts(alike: Mapping[tuple[Indices, Indices], np.ndarray], number: Mapping[Indices, np.ndarray]):
    """Yield the neighbours, and the numbers, of modes that are alike under different numbers."""
    for (p, q), table in alike.items():
        if p < q:
            for i, j in zip(*linear_sum_assignment(-table), strict=True):
                if table[i, j] >= UNSURE and number[p][i] != number[q][j]:
                    yield p, q, int(number[p][i]), int(number[q][j])
