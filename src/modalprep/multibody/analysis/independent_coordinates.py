"""Independent coordinates of a system about a state: the closed loops decide the others.

Closed loops ``Phi(x, t) = 0`` leave as many coordinates free as their Jacobian G has columns beyond its rank. A pivoted
QR factorisation of G, rows and columns scaled, chooses the dependent ones, so that what is left moves them least;
``G_d du_d = -G_i du_i`` makes ``R`` (book section 9.4). Without loops every coordinate is independent and R is one.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.linalg import qr

from modalprep.errors import SimulationError
from modalprep.multibody.evaluation.evaluator import Evaluator

TIGHT = 1e-15  # of lengths by the size of the system, and of angles: nothing is left to close
CLOSED = 1e-11  # what must be reached
SLOW = 0.3  # of the gap left by a step: the Jacobian of the reference is too old
MOST = 60  # steps
PROBE, BRANCHES = 1e-2, 1e-3  # step in scales; gap of redundant conditions after it, by its square
WORST = 1e12  # condition of the dependent columns
SINGULAR = "the closed loops do not close near this state: they are in, or near, a singular position"


class Chart:
    """Motions of a closed system about a state, by changes of its independent coordinates.

    Attributes
    ----------
    y : (nx + nu,)
        The reference, closed.
    kept : (k,) int
        Conditions of the loops that do not follow from others.
    independent : (n,) int
        Which of the nu coordinates.
    R : (nu, n)
        Changes of all coordinates by those, at the reference.

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
        self.evaluator, self.y = evaluator, y
        self.kept = evaluator.kept_rows(y)
        G = self._jacobian(y)
        scaled = G * evaluator.scale
        order = qr(scaled / np.linalg.norm(scaled, axis=1)[:, None], mode="r", pivoting=True)[1]
        self.dependent, self.independent = np.sort(order[: len(G)]), np.sort(order[len(G) :])
        self.inverse = np.linalg.inv(G[:, self.dependent])
        self.R = self.tangent(y)
        if len(G) < evaluator.gap_count:
            self._probe()

    def _probe(self) -> None:
        """Refuse a state where conditions follow from others at this place only: the loops are about to branch."""
        mixed = PROBE * np.cos(np.arange(len(self.independent)))
        left = self.evaluator.gaps(self.moved(mixed * self.evaluator.scale[self.independent]))[0]
        if np.abs(left).max() > BRANCHES * PROBE**2:
            raise SimulationError(SINGULAR)

    def _jacobian(self, y: np.ndarray) -> np.ndarray:
        return self.evaluator.jacobian(y)[self.kept]

    def tangent(self, y: np.ndarray) -> np.ndarray:
        """Return R (nu, n) at another state, for the same independent coordinates."""
        G, R = self._jacobian(y), np.zeros((self.evaluator.nu, len(self.independent)))
        R[self.independent, np.arange(len(self.independent))] = 1.0
        R[self.dependent] = -np.linalg.solve(G[:, self.dependent], G[:, self.independent])
        return R

    def moved(self, place: np.ndarray, speed: np.ndarray | None = None) -> np.ndarray:
        """Return the state whose independent coordinates and speeds differ by `place` and `speed` (n,), loops closed.

        Without `speed` the speeds are those of the reference, closed or not.

        Raises
        ------
        SimulationError
            When the loops cannot be closed there.
        """
        evaluator, step = self.evaluator, self.R @ place
        state = evaluator.moved(self.y, step)
        inverse = self.inverse

        def shift(change: np.ndarray) -> None:
            step[self.dependent] += change
            state[: evaluator.nx] = evaluator.moved(self.y, step)[: evaluator.nx]

        def turn(change: np.ndarray) -> None:
            state[evaluator.nx + self.dependent] += change

        if len(self.dependent):
            inverse = self._close(lambda: evaluator.gaps(state)[0], shift, inverse, state, 1.0)
        if speed is not None:
            state[evaluator.nx + self.independent] += speed
            if len(self.dependent):
                self._close(lambda: evaluator.gaps(state)[1], turn, inverse, state, np.abs(state[evaluator.nx :]).max())
        return state

    def _close(self, gap: Callable, change: Callable, inverse: np.ndarray, state: np.ndarray, size: float):
        """Newton's method with an old Jacobian, renewed where it converges slowly; returns the last inverse."""
        left = gap()[self.kept]
        for _ in range(MOST):
            before = np.abs(left).max()
            if before <= TIGHT * size:
                return inverse
            change(-inverse @ left)
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
