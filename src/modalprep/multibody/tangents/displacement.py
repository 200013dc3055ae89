"""Displacements of second order in the modal coordinates, and what their velocity and acceleration change by.

Affine functions and interfaces of a body move alike (body/mass.py, body/line.py): with linear part B, second order D
and the strain ``tau = e.(q D q) / 2``

    p(q) = h(tau) B q + g(tau) q D q / 2

whose derivatives of third order are those of g and h.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.body.line import shortening, swing

SMALL = 1e-30  # an imaginary step: the derivative of a formula of one number, to round-off


class Displacement(NamedTuple):
    """A displacement (m,), its partial velocities, its velocity, its acceleration, and their derivatives (m, n)."""

    p: np.ndarray  # (m,)
    dp: np.ndarray
    rate: np.ndarray  # (m,) of p
    acceleration: np.ndarray  # (m,)
    rate_q: np.ndarray
    acceleration_q: np.ndarray
    acceleration_qd: np.ndarray
    shape: tuple  # for `curvature`

    def curvature(self, F: np.ndarray) -> np.ndarray:
        """Return the derivative by q of ``dp' F`` (n, n) at constant forces ``F (m,)``."""
        B, D, Dq, along, bow, tau_q, tau_qq, (g, h1, g1) = self.shape
        one = np.outer(h1 * (F @ B) + g1 * (F @ Dq), tau_q)
        second = g * np.tensordot(F, D, 1) + (F @ along) * tau_qq + (F @ bow) * np.outer(tau_q, tau_q)
        return one + one.T + second


def displacement(B: np.ndarray, D: np.ndarray, e: np.ndarray, motion: tuple) -> Displacement:
    """Return a displacement by its linear part (m, n), second order (m, n, n) and strain (m,), with q, q', q''.

    Examples
    --------
    >>> B, D, e = np.array([[0.0], [1.0]]), np.array([[[-1.0]], [[0.0]]]), np.array([1.0, 0.0])
    >>> bar = displacement(B, D, e, (np.array([0.1]), np.array([2.0]), np.array([0.0])))  # turns by 0.1
    >>> bar.p.round(5), bar.rate.round(4)
    (array([-0.005  ,  0.09983]), array([-0.1997,  1.99  ]))
    """
    q, qd, qdd = motion
    Dq, Dqd, Dqdd = D @ q, D @ qd, D @ qdd
    tau_q, tau_qq = e @ Dq, np.tensordot(e, D, 1)
    tau = tau_q @ q / 2
    g, g1, g2, g3 = _with_third(shortening, tau)
    h, h1, h2, h3 = _with_third(swing, tau)
    linear, second = B @ q, Dq @ q / 2
    along, bow, third = (a * linear + b * second for a, b in ((h1, g1), (h2, g2), (h3, g3)))
    dp = h * B + g * Dq + np.outer(along, tau_q)

    def turned(z: np.ndarray, Dz: np.ndarray) -> np.ndarray:
        """Return the derivative by q of ``dp z`` at a constant z."""
        speed = tau_q @ z
        found = speed * (h1 * B + g1 * Dq) + g * Dz + np.outer(along, tau_qq @ z)
        return found + np.outer(h1 * (B @ z) + g1 * (Dq @ z) + speed * bow, tau_q)

    rate_q = turned(qd, Dqd)
    speed, growth = tau_q @ qd, tau_qq @ qd
    b, s, ss, rising = B @ qd, Dq @ qd, Dqd @ qd, growth @ qd
    mixed, mixed_2 = h1 * b + g1 * s, h2 * b + g2 * s
    of_tau = 2 * speed * mixed_2 + g1 * ss + rising * bow + speed**2 * third
    acceleration_q = turned(qdd, Dqdd) + np.outer(of_tau, tau_q) + 2 * np.outer(mixed + speed * bow, growth)
    acceleration_q += 2 * g1 * speed * Dqd + rising * (h1 * B + g1 * Dq) + speed**2 * (h2 * B + g2 * Dq)
    return Displacement(
        p=h * linear + g * second,
        dp=dp,
        rate=dp @ qd,
        acceleration=dp @ qdd + rate_q @ qd,
        rate_q=rate_q,
        acceleration_q=acceleration_q,
        acceleration_qd=2 * rate_q,
        shape=(B, D, Dq, along, bow, tau_q, tau_qq, (g, h1, g1)),
    )


def _with_third(function, tau: float) -> tuple[float, float, float, float]:
    """Return `shortening` or `swing` with its three derivatives."""
    third = function(complex(tau, SMALL))[2].imag / SMALL
    return (*function(tau), third)
