"""All constraints of a model as one linear map from the independent DOFs to all: links, supports, equations."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from heapq import heapify, heappop, heappush

import numpy as np
from scipy.sparse import coo_array, csr_array

from modalprep.errors import InputError
from modalprep.fe.links.multipoint import PlacedLink

SQUARED = 20  # squarings of the dependence: links that hang on links, 2^20 deep; more is a loop
DEPTH = 50  # corrections of nodes that follow other nodes
ROUND_OFF = 8 * np.finfo(float).eps  # of the largest arm or displacement: fitted frames never come to the last bit
NOISE = 1e-10  # of the same: changes below it that fall no more are those of short arms
VANISHED = 1e-9  # of the coefficients of an equation: round-off
PIVOT = 1e-6  # of the largest coefficient: less makes no dependent DOF


@dataclass(frozen=True, eq=False)
class PlacedEquation:
    """``sum coefficients . u[dofs] = 0`` between DOFs of a model.

    Attributes
    ----------
    name : str
        For messages.
    dofs : (s,) int
        In the order in which they may become dependent; none twice.
    coefficients : (s,)
    """

    name: str
    dofs: np.ndarray
    coefficients: np.ndarray


@dataclass(frozen=True, eq=False)
class Constraints:
    """Every constraint of a model, resolved.

    Attributes
    ----------
    links : list of PlacedLink
    solved : list of (int, (s,) int, (s,))
        Equations: the dependent DOF, its sources and their coefficients.
    C : (n, n_free) csr
        From the independent DOFs to all.
    free : (n_free,) int
        The independent DOFs.
    step : (n, n) csr
        From the sources of each dependent DOF to it.
    notes : tuple of str
        Equations that add nothing.
    """

    links: list[PlacedLink]
    solved: list[tuple[int, np.ndarray, np.ndarray]]
    C: csr_array
    free: np.ndarray
    step: csr_array
    notes: tuple[str, ...] = ()

    def with_dependent(self, d: np.ndarray) -> np.ndarray:
        """Return finite displacements ``(n_dof,)`` whose dependent DOFs follow the independent ones of `d` exactly."""
        d = d.copy()
        size = max(np.abs(x).max(initial=0.0) for x in (d, *(link.arm for link in self.links)))
        last = np.inf
        for _ in range(DEPTH):
            before = d.copy()
            for link in self.links:
                link.move_dependent(d)
            for dependent, sources, values in reversed(self.solved):
                d[dependent] = values @ d[sources]
            change = np.abs(d - before).max(initial=0.0)
            if change <= ROUND_OFF * size or last <= change <= NOISE * size:
                break
            last = change
        return d

    def transferred(self, force: np.ndarray) -> np.ndarray:
        """Return the forces at every DOF with those of its dependent DOFs: ``(1 + D^T + D^T D^T + ...) force``."""
        some = np.union1d(np.flatnonzero(np.diff(self.step.indptr)), self.step.indices)
        pull = self.step[some][:, some].T
        total = force.copy()
        step = force[some]
        while np.any(step):
            step = pull @ step
            total[some] += step
        return total


def constrain(links: list[PlacedLink], n: int, equations: Iterable[PlacedEquation] = (), kept: Iterable[int] = ()):
    """Return the constraints of `n` DOFs, of which those `kept` stay independent.

    An equation makes its first DOF dependent that nothing else drives. What it says of dependent DOFs it says of those
    that they depend on, so that chains and loops of equations are solved.

    Raises
    ------
    InputError
        When two links drive the same DOF, links drive each other in a loop, or an equation would hold a kept DOF.

    Examples
    --------
    >>> halves = [PlacedEquation("a", np.array([0, 1]), np.array([1.0, -2.0])),  # u0 = 2 u1, u1 = u0 - u2
    ...           PlacedEquation("b", np.array([1, 0, 2]), np.array([1.0, -1.0, 1.0]))]
    >>> constrain([], 3, halves).C.toarray().ravel()
    array([2., 1., 1.])
    """
    owner = np.full(n, -1)
    parts = []
    for k, link in enumerate(links):
        rows = link.rows
        taken = rows.dependent[owner[rows.dependent] >= 0]
        if len(taken):
            raise InputError(
                f"{links[owner[taken[0]]].name} and {link.name} drive the same node; "
                "let one of them hold it, or tie the two frames to each other"
            )
        owner[rows.dependent] = k
        parts.append(rows)
    D = _matrix([part.row for part in parts], [part.source for part in parts], [part.value for part in parts], n)
    free = np.flatnonzero(owner < 0)
    C = _resolve(D, _columns_of_unity(n, free), links)
    solved, notes = _eliminated(equations, C, free, set(map(int, kept)))
    if solved:
        rows = np.repeat([dependent for dependent, _, _ in solved], [len(sources) for _, sources, _ in solved])
        D = D + _matrix([rows], [s for _, s, _ in solved], [v for _, _, v in solved], n)
        free = np.setdiff1d(free, [dependent for dependent, _, _ in solved])
        C = _resolve(D, _columns_of_unity(n, free), links)
    return Constraints(links, solved, C, free, D, notes)


def _columns_of_unity(n: int, some: np.ndarray) -> csr_array:
    """Return columns, ascending, of the unit matrix of order n."""
    held = np.zeros(n + 1, dtype=np.int32)
    held[some + 1] = 1
    columns = np.arange(len(some), dtype=np.int32)
    starts = np.cumsum(held, dtype=np.int32)
    return csr_array((np.ones(len(some)), columns, starts), shape=(n, len(some)))


def _matrix(rows: list[np.ndarray], sources: list[np.ndarray], values: list[np.ndarray], n: int) -> csr_array:
    if not rows:
        return csr_array((n, n))
    place = tuple(np.concatenate(numbers).astype(np.int32) for numbers in (rows, sources))
    D = coo_array((np.concatenate(values), place), shape=(n, n)).tocsr()
    D.eliminate_zeros()
    return D


def _resolve(D: csr_array, E: csr_array, links: list[PlacedLink]) -> csr_array:
    """``C = (1 + D + D^2 + ...) E``, finite because links depend on each other without a loop."""
    total, power = E, D
    for _ in range(SQUARED):
        if power.nnz == 0:
            return total.tocsr()
        total = total + power @ total
        if not np.diff(power.indptr)[power.indices].any():  # no source depends on others
            return total.tocsr()
        power = power @ power
    names = ", ".join(link.name for link in links[:4])
    raise InputError(f"rigid links drive each other in a loop ({names}...); let one frame be independent")


def _eliminated(equations: Iterable[PlacedEquation], C: csr_array, free: np.ndarray, kept: set[int]):
    """Return the equations, each solved for one DOF, and notes on those that add nothing.

    Each is first written in DOFs that nothing drives yet, so that a DOF depends only on those that depend on nothing,
    or on later ones: there is no loop.
    """
    independent = np.zeros(C.shape[0], dtype=bool)
    found = {}
    empty = []
    independent[free] = True
    for equation in equations:
        left = _in_free(_in_independent(equation, C, free, independent), found)
        largest = max(map(abs, left.values()), default=0.0)
        if largest <= VANISHED * np.abs(equation.coefficients).max(initial=0.0):
            empty.append(equation.name)
            continue
        choice = next((dof for dof, value in left.items() if dof not in kept and abs(value) > PIVOT * largest), None)
        if choice is None:
            raise InputError(f"{equation.name} would hold an interface, which must stay free; leave one of the two out")
        others = {dof: -value / left[choice] for dof, value in left.items() if dof != choice and value}
        found[choice] = len(found), others
    notes = (f"equations that others contain are left out ({len(empty)}, the first is {empty[0]})",) if empty else ()
    return [(dof, np.array(list(of), dtype=int), np.array(list(of.values()))) for dof, (_, of) in found.items()], notes


def _in_independent(equation: PlacedEquation, C: csr_array, free: np.ndarray, independent: np.ndarray):
    """Return the coefficients of an equation on DOFs that no link drives, its own ones first."""
    own, others = {}, {}
    for dof, value in zip(equation.dofs.tolist(), equation.coefficients.tolist(), strict=True):
        if independent[dof]:
            own[dof] = own.get(dof, 0.0) + value
            continue
        span = slice(C.indptr[dof], C.indptr[dof + 1])
        for source, factor in zip(free[C.indices[span]].tolist(), C.data[span].tolist(), strict=True):
            others[source] = others.get(source, 0.0) + value * factor
    return own | {dof: own.get(dof, 0.0) + value for dof, value in others.items()}


def _in_free(left: dict[int, float], found: dict[int, tuple[int, dict[int, float]]]) -> dict[int, float]:
    """Return the coefficients on DOFs that no equation `found` before drives; these depend on later ones only."""
    waiting = [(found[dof][0], dof) for dof in left if dof in found]
    heapify(waiting)
    while waiting:
        _, dof = heappop(waiting)
        value = left.pop(dof)
        for other, factor in found[dof][1].items():
            if other in found and other not in left:
                heappush(waiting, (found[other][0], other))
            left[other] = left.get(other, 0.0) + value * factor
    return left
