"""The projection of a state onto closed loops after a step, as a linear map of changes."""

from __future__ import annotations

import numpy as np

from modalprep.sensitivity.local import Local, Model, saddle_inverse
from modalprep.sensitivity.tangent_maps import reversed_map
from modalprep.sensitivity.trace import Step


class Projection:
    """Changes of a state brought onto closed loops, by the least kinetic energy; without loops the identity.

    A state that was closed with other parameters, or by a step with its error, is brought onto the loops in the metric
    of the mass matrix: ``dx - B (G dx + Phi_p)`` with ``B = M^-1 G' (G M^-1 G')^-1``, speeds likewise with the
    derivatives of the rates.
    """

    def __init__(self, local: Local) -> None:
        self.local = local
        if local.rows is None:
            return
        model, rows = local.model, local.rows
        self.G, self.rate_x = rows.slopes.G, rows.slopes.rate_x
        self.by_force, self.B = local.mobility
        self.increments = local.kinematics.increments
        self.directions = model.layout.directions(local.y)
        self.gap_p, self.rate_p = local.gap_slopes()

    def forward(self, dy: np.ndarray, dp: np.ndarray) -> np.ndarray:
        """Return the change (ny, k) of the closed state, with changes (ny, k) before and (np, k) of the parameters."""
        if self.local.rows is None:
            return dy
        nx = self.local.model.nx
        turned = self.increments @ dy[:nx]
        move = -self.B @ (self.G @ turned + self.gap_p @ dp) - self._place_force(turned, dp)
        rate = self.G @ dy[nx:] + self.rate_x @ (turned + move) + self.rate_p @ dp
        u = dy[nx:] - self.B @ rate - self._rate_force(turned + move, dp)
        return np.vstack([dy[:nx] + self.directions @ move, u])

    def _place_force(self, turned: np.ndarray, dp: np.ndarray) -> np.ndarray | float:
        """Return what the metric changes the places by."""
        return 0.0

    def _rate_force(self, turned: np.ndarray, dp: np.ndarray) -> np.ndarray | float:
        """Return what the metric changes the speeds by."""
        return 0.0

    def reverse(self, bar: np.ndarray, bar_p: np.ndarray) -> np.ndarray:
        """Return the gradient (ny,) by the state before; that by the parameters is added."""
        return bar if self.local.rows is None else reversed_map(self.forward, bar, bar_p)


class ClosingStep(Projection):
    """That of an implicit step: its metric is ``P = M + S``, and what it changes is more than the error of the step.

    For both changes c, ``P c = G' n``, and derivatives are those of this equation.

    Parameters
    ----------
    raw : (nx + nu,)
        The state before.
    widths : (float, float)
        By which S has stiffness and damping of joints; stiffness of modes counts by a quarter of the squared step.
    """

    def __init__(self, model: Model, step: Step, raw: np.ndarray, widths: tuple[float, float]) -> None:
        super().__init__(Local(model, step.end, step.at(1.0)))
        linear, by_parameter = model.linear(step.end, step.at(1.0))
        weights = np.tile(np.array(widths)[:, None], model.nu)
        modes = [kind == "body" for kind, _ in model.evaluator.owner]
        weights[:, modes] = np.array([[step.h**2 / 4], [0.0]])
        self.metric = np.sum(weights * linear, axis=0)
        self.metric_p = np.einsum("ck,ckp->kp", weights, by_parameter)
        self.by_force, self.B = saddle_inverse(self.local.M + np.diag(self.metric), self.G)
        self.of_places = self._pull(self.increments @ (step.end - raw)[: model.nx])
        self.of_speeds = self._pull((step.end - raw)[model.nx :])

    def _pull(self, change: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the derivatives of ``P c - G' n`` by coordinates and parameters, c and n given.

        They are those by which the tangent changes with the accelerations, in which it is linear.
        """
        own = self.local
        beside = Local(own.model, own.y, own.moment, own.udot + change, own.more + self.metric * change)
        return beside.K - own.K, beside.force_p - own.force_p + self.metric_p * change[:, None]

    def _place_force(self, turned: np.ndarray, dp: np.ndarray) -> np.ndarray:
        by_x, by_p = self.of_places
        return self.by_force @ (by_x @ turned + by_p @ dp)

    def _rate_force(self, turned: np.ndarray, dp: np.ndarray) -> np.ndarray:
        by_x, by_p = self.of_speeds
        return self.by_force @ (by_x @ turned + by_p @ dp)


def closing(model: Model, step: Step, raw: np.ndarray, widths: tuple[float, float]) -> ClosingStep | None:
    """Return how an implicit step closes loops; None without loops."""
    return None if model.loops is None else ClosingStep(model, step, raw, widths)
