"""A step of generalised-alpha as a map of changes, and its reverse.

The iterations of a step solve ``r(x_1, u_1, w) = 0``, inverse dynamics at its end with the true accelerations w, of
which algorithmic accelerations, coordinates and speeds are linear functions (on the group of rotations with the tangent
of the exponential), so that ``(M + c_1 D + c_2 K T) dw = -(K dx_1 + D du_1 + F_p dp)`` with what is known before.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.sensitivity.local import Local, Model
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


class AlphaStep:
    """A step; changes are those of state, true and algorithmic accelerations."""

    def __init__(self, model: Model, step: Step) -> None:
        self.model, self.step = model, step
        self.p = p = AlphaMethod.of(model.rho_inf)
        self.end = Local(model, step.end, step.at(1.0), step.udot)
        self.first = Local(model, step.y, step.begin) if step.ratio == 0.0 else None
        h, nx = step.h, model.nx
        a, b = step.algorithmic
        d = h * step.y[nx:] + h * h * ((0.5 - p.beta) * a + p.beta * b)
        self.carried, self.T = model.layout.exponential(d)
        self.increments = model.layout.kinematics(step.y).increments
        self.directions = model.layout.directions(step.end)
        whole = self.end.M + p.c * p.gamma * h * self.end.D + p.c * p.beta * h * h * self.end.K @ self.T
        self.inverse = np.linalg.inv(whole)

    def forward(self, dz: np.ndarray) -> np.ndarray:
        """Return the changes (ny + 2 nu, np) after the step."""
        p, h, nx, nu = self.p, self.step.h, self.model.nx, self.model.nu
        y, v, a = dz[: nx + nu], dz[nx + nu : nx + 2 * nu], dz[nx + 2 * nu :]
        if self.first is not None:
            v = self.first.forward(y)[nx:]
        a = v + self.step.ratio * (a - v)
        known = (p.af * v - p.am * a) / (1 - p.am)
        x1, u1 = self._moved(y, a, known)
        w = -self.inverse @ (self.end.K @ x1 + self.end.D @ u1 + self.end.force_p)
        a1 = known + p.c * w
        x1 = x1 + h * h * p.beta * p.c * self.T @ w
        u1 = u1 + h * p.gamma * p.c * w
        return np.vstack([self.directions @ x1, u1, w, a1])

    def _moved(self, y: np.ndarray, a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return increments and speeds at the end with algorithmic accelerations at begin and end."""
        p, h, nx = self.p, self.step.h, self.model.nx
        d = h * y[nx:] + h * h * ((0.5 - p.beta) * a + p.beta * b)
        return self.carried @ (self.increments @ y[:nx]) + self.T @ d, y[nx:] + h * ((1 - p.gamma) * a + p.gamma * b)

    def reverse(self, bar: np.ndarray, bar_p: np.ndarray) -> np.ndarray:
        """Return the gradient (ny + 2 nu,) by what was before; that by the parameters is added to `bar_p`."""
        p, h, nx, nu = self.p, self.step.h, self.model.nx, self.model.nu
        x1, u1 = self.directions.T @ bar[:nx], bar[nx : nx + nu]
        w, a1 = bar[nx + nu : nx + 2 * nu], bar[nx + 2 * nu :]
        mu = self.inverse.T @ (w + p.c * self._algorithmic(x1, u1, a1))
        x1, u1 = x1 - self.end.K.T @ mu, u1 - self.end.D.T @ mu
        bar_p -= self.end.force_p.T @ mu
        known = self._algorithmic(x1, u1, a1)
        d = self.T.T @ x1
        a = h * h * (0.5 - p.beta) * d + h * (1 - p.gamma) * u1 - p.am / (1 - p.am) * known
        v = p.af / (1 - p.am) * known + (1 - self.step.ratio) * a
        before = np.concatenate([self.increments.T @ (self.carried.T @ x1), u1 + h * d])
        if self.first is not None:
            before += self.first.reverse(np.concatenate([np.zeros(nx), v]), bar_p)
            v = np.zeros(nu)
        return np.concatenate([before, v, self.step.ratio * a])

    def _algorithmic(self, x1: np.ndarray, u1: np.ndarray, a1: np.ndarray) -> np.ndarray:
        """Return the gradient by the algorithmic acceleration at the end."""
        p, h = self.p, self.step.h
        return a1 + h * h * p.beta * self.T.T @ x1 + h * p.gamma * u1
