"""Second implementation of planar chains of rigid rods: Lagrange's equations in the absolute angles of the rods.

With ``A_ij = m l^2 (n - max(i, j) - 1/2)``, and ``n - i - 2/3`` on the diagonal (i from 1),

    sum_j A_ij (cos(t_i - t_j) t_j'' + sin(t_i - t_j) t_j'^2) = -dV/dt_i

No joint coordinates, no recursion and no modal body appears in them, of which the engine is made.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import eigh


@dataclass(frozen=True)
class Chain:
    """n equal uniform rods; springs between them and, twice as stiff, at the clamp; base angle and gravity along -y."""

    n: int
    length: float  # of all rods, m
    mass: float  # of all rods, kg
    EI: float = 0.0  # N m^2; springs EI / l, and 2 EI / l at the clamp, which has half a rod to bend
    gravity: float = 0.0
    base: Callable[[float], float] = lambda t: 0.0

    @cached_property
    def A(self) -> np.ndarray:
        """Coefficients (n, n) of the kinetic energy ``1/2 sum A_ij cos(t_i - t_j) t_i' t_j'``."""
        beyond = self.n - 1 - np.maximum.outer(np.arange(self.n), np.arange(self.n))
        return self.mass / self.n * (self.length / self.n) ** 2 * (beyond + np.where(np.eye(self.n), 1 / 3, 1 / 2))

    @cached_property
    def springs(self) -> np.ndarray:
        """Stiffness (n, n) of the springs in the absolute angles; the base has the angle zero."""
        k = np.full(self.n, self.EI * self.n / self.length)
        k[0] *= 2
        difference = np.eye(self.n) - np.eye(self.n, k=-1)
        return difference.T @ (k[:, None] * difference)

    @cached_property
    def weight(self) -> np.ndarray:
        """Moments (n,) of the weight about the upper ends of level rods."""
        return self.mass / self.n * self.gravity * self.length / self.n * (self.n - np.arange(self.n) - 0.5)

    def rates(self, t: float, y: np.ndarray) -> np.ndarray:
        """Derivative of (angles, their rates)."""
        angle, rate = np.split(y, 2)
        apart = np.subtract.outer(angle, angle)
        A = self.A
        force = -self.springs @ (angle - self.base(t)) - self.weight * np.cos(angle)
        return np.concatenate([rate, np.linalg.solve(A * np.cos(apart), force - (A * np.sin(apart)) @ rate**2)])

    def motion(self, times, start: float = 0.0, rtol: float = 1e-9) -> np.ndarray:
        """Angles (n, len(times)) from rest with all rods at the angle `start`."""
        y = np.concatenate([np.full(self.n, start), np.zeros(self.n)])
        return solve_ivp(self.rates, (0, max(times)), y, "DOP853", times, rtol=rtol, atol=rtol).y[: self.n]

    def tip(self, angle: np.ndarray) -> np.ndarray:
        """Position (..., 2) of the free end, from angles (n, ...)."""
        return self.length / self.n * np.stack([np.cos(angle).sum(axis=0), np.sin(angle).sum(axis=0)], axis=-1)

    def frequencies(self, spin: float = 0.0) -> np.ndarray:
        """Angular frequencies (n,) of small motion about the straight chain.

        The spin (rad/s) is about y, in the plane of the motion: every rod is pulled outwards along x (flap).
        """
        step, mass = self.length / self.n, self.mass / self.n
        pull = mass * spin**2 * (np.arange(self.n) + 0.5) * step
        beyond = np.cumsum(pull[::-1])[::-1] - pull
        own = mass * spin**2 * step**2 / 12  # of a rod that leaves the x axis, about its centre
        K = self.springs + np.diag(step * (beyond + pull / 2) + own)
        return np.sqrt(eigh(K, self.A, eigvals_only=True))
