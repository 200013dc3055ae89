"""Independent coordinates of a system about a state: closed loops determine the dependent ones.

Closed loops ``Phi(x, t) = 0`` leave as many coordinates independent as their Jacobian G has columns beyond its rank. A
pivoted QR factorisation of the scaled G selects the dependent ones such that they are well conditioned; ``G_d du_d =
-G_i du_i`` gives ``R`` (book section 9.4). Without loops every coordinate is independent and R is the identity.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
import scipy

from modalprep.errors import SimulationError
from modalprep.multibody.evaluation.evaluator import Evaluator
from modalprep.multibody.kernels.closed_loops.projection import CLOSED

TIGHT = 1e-15  # of gaps over the size of the system, and of angles: at round-off
SLOW = 0.3  # reduction of the gap by a step, above which the Jacobian is renewed
MAX_STEPS = 60
PROBE, BRANCHES = 1e-2, 1e-3  # scaled step; gap of redundant conditions after it, over its square
WORST = 1e12  # condition number of the dependent columns
SINGULAR = "the closed loops do not close near this state: they are in, or near, a singular position"


@lru_cache(8)
def _all(n: int) -> tuple[np.ndarray, ...]:
    """Return what holds without loops: no dependent coordinates, all n independent, no inverse, R."""
    found = np.zeros(0, dtype=int), np.arange(n), np.zeros((0, 0)), np.eye(n)
    for each in found:
        each.flags.writeable = False
    return found


class Chart:
    """Motions of a closed system about a state, by changes of its independent coordinates.

    Attributes
    ----------
    y : (nx + nu,)
        The reference state, with closed loops.
    kept : (k,) int
        Independent conditions of the loops.
    independent : (n,) int
        Indices of the independent ones among the nu coordinates.
    R : (nu, n)
        Derivative of all coordinates by the independent ones, at the reference.

    Raises
    ------
    SimulationError
        When the loops are in a singular position.

    Examples
    --------
    >>> from modalprep.body.rigid import rigid_body
    >>> from modalprep.multibody.model.constraints import Coupler
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.multibody.model.system import System
    >>> disc = rigid_body("disc", mass=1.0, centre=np.zeros(3), inertia=np.eye(3), interfaces={"root": np.zeros(3)})
    >>> joints = tuple(Joint(name=name, type="revolute", parent="ground", child=name) for name in ("one", "two"))
    >>> gear = Coupler(name="gear", factors={"one": 3.0, "two": 1.0})
    >>> evaluator = Evaluator(System(bodies={"one": disc, "two": disc}, joints=joints, closures=(gear,)))
    >>> chart = Chart(evaluator, evaluator.start)
    >>> chart.independent.tolist(), chart.R.ravel()
    ([1], array([-0.33333333,  1.        ]))
    """

    def __init__(self, evaluator: Evaluator, y: np.ndarray) -> None:
        y = np.array(y)  # writable, as in runs: kernels are compiled anew for a read-only state
        self.evaluator, self.y = evaluator, y
        if evaluator.loops is None:
            self.kept = np.zeros(0, dtype=int)
            self.dependent, self.independent, self.inverse, self.R = _all(evaluator.nu)
        else:
            self._choose()

    def _choose(self) -> None:
        evaluator, y = self.evaluator, self.y
        self.kept = evaluator.kept_rows(y)
        G = self._jacobian(y)
        scaled = G * evaluator.scale
        order = scipy.linalg.qr(scaled / np.linalg.norm(scaled, axis=1)[:, None], mode="r", pivoting=True)[1]
        self.dependent = np.sort(order[: len(G)])
        self.independent = np.sort(order[len(G) :])
        self.inverse = np.linalg.inv(G[:, self.dependent])
        self.R = self.tangent(y)
        if len(G) < evaluator.gap_count:
            self._probe()

    def _probe(self) -> None:
        """Refuse a state where conditions are redundant at this configuration only: a bifurcation of the loops."""
        mixed = PROBE * np.cos(np.arange(len(self.independent)))
        left = self.evaluator.gaps(self.moved(mixed * self.evaluator.scale[self.independent]))[0]
        if np.abs(left).max() > BRANCHES * PROBE**2:
            raise SimulationError(SINGULAR)

    def _jacobian(self, y: np.ndarray) -> np.ndarray:
        return self.evaluator.jacobian(y)[self.kept]

    def tangent(self, y: np.ndarray) -> np.ndarray:
        """Return R (nu, n) at another state, for the same independent coordinates."""
        if not len(self.dependent):
            return _all(self.evaluator.nu)[-1]
        G = self._jacobian(y)
        R = np.zeros((self.evaluator.nu, len(self.independent)))
        R[self.independent, np.arange(len(self.independent))] = 1.0
        R[self.dependent] = -np.linalg.solve(G[:, self.dependent], G[:, self.independent])
        return R

    def moved(self, change: np.ndarray, speed: np.ndarray | None = None) -> np.ndarray:
        """Return the closed state whose independent coordinates and speeds differ by `change` and `speed` (n,).

        Without `speed` the speeds are those of the reference, closed or not.

        Raises
        ------
        SimulationError
            When the loops cannot be closed there.
        """
        evaluator = self.evaluator
        step = self.R @ change
        state = evaluator.moved(self.y, step)
        inverse = self.inverse

        def correct_position(correction: np.ndarray) -> None:
            step[self.dependent] += correction
            state[: evaluator.nx] = evaluator.moved(self.y, step)[: evaluator.nx]

        def correct_speed(correction: np.ndarray) -> None:
            state[evaluator.nx + self.dependent] += correction

        if len(self.dependent):
            inverse = self._close(lambda: evaluator.gaps(state)[0], correct_position, inverse, state, 1.0)
        if speed is not None:
            state[evaluator.nx + self.independent] += speed
            if len(self.dependent):
                self._close(
                    lambda: evaluator.gaps(state)[1], correct_speed, inverse, state, np.abs(state[evaluator.nx :]).max()
                )
        return state

    def _close(self, gap: Callable, correct: Callable, inverse: np.ndarray, state: np.ndarray, size: float):
        """Close the loops by Newton's method, the Jacobian renewed on slow convergence; returns its last inverse."""
        left = gap()[self.kept]
        for _ in range(MAX_STEPS):
            before = np.abs(left).max()
            if before <= TIGHT * size:
                return inverse
            correct(-inverse @ left)
            left = gap()[self.kept]
            now = np.abs(left).max()
            if not now <= SLOW * before:
                if now <= CLOSED * size:  # round-off
                    return inverse
                inverse = self._renewed(state)
        raise SimulationError(SINGULAR)

    def _renewed(self, y: np.ndarray) -> np.ndarray:
        G = self._jacobian(y)[:, self.dependent]
        if not np.all(np.isfinite(G)) or np.linalg.cond(G) > WORST:
            raise SimulationError(SINGULAR)
        return np.linalg.inv(G)
