"""Springs, bushings, dampers between modes that a Rosenbrock step treats implicitly: the forces they add to a stage.

A row g of stiffness k and damping d adds ``g' (k g.a + d g.b)`` with the vectors a, b of the stage (rosenbrock.py). It
turns with the state of the stage; what that changes is a difference of this force, an algebraic function of the state.
"""

from __future__ import annotations

import numpy as np

from modalprep.multibody.evaluation.evaluator import Evaluator
from modalprep.multibody.evaluation.implicit_rows import with_force_elements
from modalprep.multibody.kernels.closed_loops.projection import rate_slopes
from modalprep.multibody.packing.constraints import constraint_work
from modalprep.sensitivity.differences import RELATIVE, directional


class Compliance:
    """The rows of springs, bushings and rotational springs of a system, may be none, and its dampers between modes.

    Attributes
    ----------
    stiffness, damping : (m,)
    """

    def __init__(self, evaluator: Evaluator) -> None:
        self.evaluator = evaluator
        self.data = evaluator.packed.data()
        self.rows = with_force_elements(None, evaluator.loading.arrays)
        self.work = None if self.rows is None else constraint_work(self.rows, evaluator.packed)
        none = np.zeros(0)
        self.stiffness = none if self.rows is None else self.rows.rows["stiffness"]
        self.damping = none if self.rows is None else self.rows.rows["damping"]

    def slopes(self, y: np.ndarray) -> np.ndarray:
        """Return the derivatives (m, nu) of the rates along the rows by the speeds."""
        own = self.evaluator
        found = np.zeros((len(self.stiffness), own.nu))
        if self.rows is not None:
            still = np.zeros_like(own.loading.motion)
            still[:, 0] = own.loading.prescribe(own.t, self.data)[:, 0]
            rate_slopes(self.rows, own.packed.model, self.data, y.copy(), still, own.t, self.work, found)
        return found

    def matrices(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the derivatives (nu, nu) of their force by the increments of places and of rates."""
        G = self.slopes(y)
        by_rates = G.T @ (self.damping[:, None] * G) + self.evaluator.packed.dampers
        return G.T @ (self.stiffness[:, None] * G), by_rates

    def force(self, y: np.ndarray, place: np.ndarray, rate: np.ndarray) -> np.ndarray:
        """Return their force (nu,) at increments `place` and `rate` (nu,)."""
        G = self.slopes(y)
        rows = G.T @ (self.stiffness * (G @ place) + self.damping * (G @ rate))
        return rows + self.evaluator.packed.dampers @ rate

    def force_slopes(self, y: np.ndarray, place: np.ndarray, rate: np.ndarray) -> np.ndarray:
        """Return the derivatives (nu, nu) of this force by increments of the coordinates."""
        own = self.evaluator
        found = np.zeros((own.nu, own.nu))
        for k in range(own.nu) if self.rows is not None else ():
            step = own.scale[k] * np.eye(own.nu)[k]
            changed = directional(lambda s, d=step: self.force(own.moved(y, s * d), place, rate), RELATIVE)
            found[:, k] = changed / own.scale[k]
        return found
