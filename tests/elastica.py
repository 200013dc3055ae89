"""An inextensible beam whose slope is exact: Rayleigh-Ritz in the angle of its tangent.

Lengths are over L, times over ``sqrt(rho A L^4 / EI)``, as in `beam_series`. With the slopes of the modes ``phi_i'``
as functions of the angle, ``theta = phi_i' q_i``, the strain energy ``int theta'^2 / 2`` is ``w_i^2 q_i^2 / 2`` and a
point is at ``int (cos theta, sin theta)``. Five functions give the deepest lag of a spin-up to 3e-5 of itself.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from analytic import cantilever_roots
from beam_series import LENGTH, POINTS, RISE, UNIT, WEIGHTS, mode_shapes, spin_up
from numpy.polynomial import legendre
from scipy.integrate import solve_ivp

ORDER = len(POINTS)
_VALUES = legendre.legvander(2 * POINTS - 1, ORDER - 1)
_SUMS = np.array([legendre.legval(2 * POINTS - 1, legendre.legint(row, lbnd=-1)) for row in np.eye(ORDER)]).T
INTEGRAL = _SUMS @ np.linalg.inv(_VALUES) / 2  # values at POINTS to the integral from the root


class Elastica:
    """A clamped-free beam in a frame that turns in its plane about its root."""

    def __init__(self, functions: int = 5) -> None:
        self.slope, self.w2 = mode_shapes(functions)[1], cantilever_roots(functions) ** 4

    def points(self, q: np.ndarray) -> np.ndarray:
        """Return the places (2, points)."""
        angle = q @ self.slope
        return np.stack([np.cos(angle), np.sin(angle)]) @ INTEGRAL.T

    def tip(self, q: np.ndarray) -> np.ndarray:
        """Return the place (2,) of the tip."""
        angle = q @ self.slope
        return np.stack([np.cos(angle), np.sin(angle)]) @ WEIGHTS

    def accelerations(self, q: np.ndarray, v: np.ndarray, spin: float = 0.0, spin_rate: float = 0.0) -> np.ndarray:
        """Return q'' by the principle of virtual power."""
        angle, rate = q @ self.slope, v @ self.slope
        along = np.stack([np.cos(angle), np.sin(angle)])
        across = np.stack([-along[1], along[0]])
        J = (across[:, None] * self.slope) @ INTEGRAL.T
        velocity, (x, y) = np.einsum("ain,i->an", J, v), along @ INTEGRAL.T
        bias = -(along * rate**2) @ INTEGRAL.T
        bias += 2 * spin * np.stack([-velocity[1], velocity[0]]) - spin**2 * np.stack([x, y])
        bias += spin_rate * np.stack([-y, x])
        mass, force = np.einsum("ain,ajn,n->ij", J, J, WEIGHTS), np.einsum("ain,an,n->i", J, bias, WEIGHTS)
        return np.linalg.solve(mass, -force - self.w2 * q)

    def motion(self, times: np.ndarray, q: np.ndarray, drive: Callable = lambda t: (0.0, 0.0)) -> np.ndarray:
        """Return q over the times (nt, functions) from rest at q; the drive gives spin and its rate."""
        start = np.concatenate([q, np.zeros_like(q)])

        def rate(t, z):
            at, v = np.split(z, 2)
            return np.concatenate([v, self.accelerations(at, v, *drive(t))])

        z = solve_ivp(rate, (0, times[-1]), start, "DOP853", times, rtol=1e-8, atol=1e-11).y
        return z[: len(q)].T


def spin_up_lag(times: np.ndarray) -> np.ndarray:
    """Deflection (m) of the tip of the beam of Simo and Vu-Quoc (1986), as `beam_series.spin_up_lag`."""
    beam = Elastica()

    def drive(t):
        spin, rate = spin_up(min(t / UNIT, RISE))
        return spin / UNIT, rate / UNIT**2

    q = beam.motion(times * UNIT, np.zeros(len(beam.w2)), drive)
    return LENGTH * np.array([beam.tip(each)[1] for each in q])
