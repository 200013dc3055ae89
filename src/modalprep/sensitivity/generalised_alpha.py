"""A step of generalised-alpha as a map of changes.

The iterations of a step solve ``r(x_1, u_1, w) = G' l``, inverse dynamics at its end with the true accelerations w, of
which algorithmic accelerations, coordinates and speeds are linear functions (on the group of rotations with the tangent
of the exponential), so that ``(M + c_1 D + c_2 K T) dw - G' dl = -(K dx_1 + D du_1 + F_p dp)`` with what is known
before; closed loops keep their places, ``c_2 G T dw = -(G dx_1 + Phi_p dp)``, then their speeds are brought onto them.
Trees go back in compiled code (alpha_back.py).
"""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np

from modalprep.sensitivity.local import Local, Model
from modalprep.sensitivity.projection import closing
from modalprep.sensitivity.tangent_maps import StepMap
from modalprep.sensitivity.trace import Step


class AlphaMethod(NamedTuple):
    """Constants of the method: Chung and Hulbert (1993)."""

    am: float
    af: float
    beta: float
    gamma: float
    c: float

    @classmethod
    def of(cls, rho: float) -> AlphaMethod:
        """Return those of an amplification at infinite frequency."""
        am, af = (2 * rho - 1) / (rho + 1), rho / (rho + 1)
        gamma = 0.5 + af - am
        return cls(am, af, 0.25 * (gamma + 0.5) ** 2, gamma, (1 - af) / (1 - am))


class AlphaStep(StepMap):
    """A step; changes are those of state, true and algorithmic accelerations."""

    def __init__(self, model: Model, step: Step) -> None:
        self.model, self.step = model, step
        self.p = p = AlphaMethod.of(model.rho_inf)
        h, nx = step.h, model.nx
        a, b = step.algorithmic
        d = h * step.y[nx:] + h * h * ((0.5 - p.beta) * a + p.beta * b)
        speeds = step.y[nx:] + h * ((1 - p.gamma) * a + p.gamma * b)
        self.end = Local(model, np.concatenate([step.end[:nx], speeds]), step.at(1.0), step.udot)
        self.first = Local(model, step.y, step.begin) if step.ratio == 0.0 else None
        self.carried, self.T = model.layout.exponential(d)
        self.increments = model.layout.kinematics(step.y).increments
        self.directions = model.layout.directions(step.end)
        self.widths = p.c * p.beta * h * h, p.c * p.gamma * h
        self.by_force, self.by_gap = self._inverse()
        self.projection = closing(model, step, self.end.y, self.widths)

    def _inverse(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the accelerations by forces (nu, nu), and by the gaps of closed loops (nu, m)."""
        end, (place, rate) = self.end, self.widths
        whole = end.M + rate * end.D + place * end.K @ self.T
        if end.rows is None:
            return np.linalg.inv(whole), np.zeros((len(whole), 0))
        G = end.rows.slopes.G
        nu, m = len(whole), len(G)
        inverse = np.linalg.inv(np.block([[whole, -G.T], [G @ self.T, np.zeros((m, m))]]))
        return inverse[:nu, :nu], inverse[:nu, nu:] / place

    def forward(self, dz: np.ndarray, dp: np.ndarray) -> np.ndarray:
        """Return the changes (ny + 2 nu, k) after the step."""
        p, nx, nu = self.p, self.model.nx, self.model.nu
        y, v, a = dz[: nx + nu], dz[nx + nu : nx + 2 * nu], dz[nx + 2 * nu :]
        if self.first is not None:
            v = self.first.forward(y, dp)[nx:]
        a = v + self.step.ratio * (a - v)
        known = (p.af * v - p.am * a) / (1 - p.am)
        x1, u1 = self._moved(y, a, known)
        w = -self.by_force @ (self.end.K @ x1 + self.end.D @ u1 + self.end.force_p @ dp) - self.by_gap @ self._gap(
            x1, dp
        )
        place, rate = self.widths
        found = np.vstack([self.directions @ (x1 + place * self.T @ w), u1 + rate * w])
        found = self.projection.forward(found, dp) if self.projection else found
        return np.vstack([found, w, known + p.c * w])

    def _gap(self, x1: np.ndarray, dp: np.ndarray) -> np.ndarray:
        """Return what increments and parameters open closed loops by (m, k)."""
        if self.end.rows is None:
            return np.zeros((0, x1.shape[1]))
        return self.end.rows.slopes.G @ x1 + self.gap_p @ dp

    @cached_property
    def gap_p(self) -> np.ndarray:
        """The derivatives (m, np) of the conditions by the parameters."""
        return self.end.gap_slopes()[0]

    def _moved(self, y: np.ndarray, a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return increments and speeds at the end with algorithmic accelerations at begin and end."""
        p, h, nx = self.p, self.step.h, self.model.nx
        d = h * y[nx:] + h * h * ((0.5 - p.beta) * a + p.beta * b)
        return self.carried @ (self.increments @ y[:nx]) + self.T @ d, y[nx:] + h * ((1 - p.gamma) * a + p.gamma * b)
