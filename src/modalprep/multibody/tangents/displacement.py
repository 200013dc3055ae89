"""Displacements of second order in the modal coordinates, and what their velocity and acceleration change by.

Affine functions and interfaces of a body move alike (body/mass.py, body/line.py): with linear part B, second order D
and the strain ``tau = e.(q D q) / 2``

    p(q) = h(tau) B q + g(tau) q D q / 2

whose derivatives of third order are those of g and h.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from modalprep.body import line

SMALL = 1e-30  # an imaginary step: the derivative of a formula of one number, to round-off


class Bent(NamedTuple):
    """What `curvature` needs of a displacement."""

    B: np.ndarray  # (m, n)
    D: np.ndarray  # (m, n, n)
    Dq: np.ndarray  # (m, n)
    along: np.ndarray  # (m,) derivative of p by tau
    bow: np.ndarray  # (m,) second derivative
    tau_q: np.ndarray  # (n,)
    tau_qq: np.ndarray  # (n, n)
    g: float
    h_slope: float
    g_slope: float


class Displacement(NamedTuple):
    """A displacement (m,), its partial velocities, its velocity, its acceleration, and their derivatives (m, n)."""

    p: np.ndarray  # (m,)
    dp: np.ndarray
    rate: np.ndarray  # (m,) of p
    acceleration: np.ndarray  # (m,)
    rate_q: np.ndarray
    acceleration_q: np.ndarray
    acceleration_qd: np.ndarray
    bent: Bent


def displacement(
    B: np.ndarray, D: np.ndarray, e: np.ndarray, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray
) -> Displacement:
    """Return a displacement by its linear part (m, n), second order (m, n, n) and strain (m,), with q, q', q''.

    Examples
    --------
    >>> B, D, e = np.array([[0.0], [1.0]]), np.array([[[-1.0]], [[0.0]]]), np.array([1.0, 0.0])
    >>> bar = displacement(B, D, e, np.array([0.1]), np.array([2.0]), np.array([0.0]))  # turns by 0.1
    >>> bar.p.round(5), bar.rate.round(4)
    (array([-0.005  ,  0.09983]), array([-0.1997,  1.99  ]))
    """
    m, n = B.shape
    by_rows = D.reshape(m * n, n)
    Dq, Dqd, Dqdd = ((by_rows @ z).reshape(m, n) for z in (q, qd, qdd))
    tau_q, tau_qq = e @ Dq, (e @ D.reshape(m, n * n)).reshape(n, n)
    tau = 0.5 * float(tau_q @ q)
    g, g1, g2, g3 = _with_third(line.shortening, tau)
    h, h1, h2, h3 = _with_third(line.swing, tau)
    linear, second = B @ q, 0.5 * (Dq @ q)
    along, bow, third = (a * linear + b * second for a, b in ((h1, g1), (h2, g2), (h3, g3)))
    slope = h1 * B + g1 * Dq
    dp = h * B + g * Dq + np.outer(along, tau_q)
    speed, growth = tau_q @ qd, tau_qq @ qd
    b, s, ss, rising = B @ qd, Dq @ qd, Dqd @ qd, growth @ qd
    mixed, mixed_2 = h1 * b + g1 * s, h2 * b + g2 * s
    rate_q = speed * slope + g * Dqd + np.outer(along, growth) + np.outer(mixed + speed * bow, tau_q)
    of_tau = 2.0 * speed * mixed_2 + g1 * ss + rising * bow + speed * speed * third
    pull = tau_q @ qdd
    of_tau += h1 * (B @ qdd) + g1 * (Dq @ qdd) + pull * bow
    acceleration_q = (pull + rising) * slope + g * Dqdd + np.outer(along, tau_qq @ qdd) + np.outer(of_tau, tau_q)
    acceleration_q += 2.0 * np.outer(mixed + speed * bow, growth) + 2.0 * g1 * speed * Dqd
    acceleration_q += speed * speed * (h2 * B + g2 * Dq)
    bent = Bent(B, D, Dq, along, bow, tau_q, tau_qq, g, h1, g1)
    p, rate, acceleration = h * linear + g * second, dp @ qd, dp @ qdd + rate_q @ qd
    return Displacement(p, dp, rate, acceleration, rate_q, acceleration_q, 2.0 * rate_q, bent)


def curvature(bent: Bent, F: np.ndarray) -> np.ndarray:
    """Return the derivative by q of ``dp' F`` (n, n) at constant forces ``F (m,)``.

    Examples
    --------
    >>> B, D, e = np.array([[0.0], [1.0]]), np.array([[[-1.0]], [[0.0]]]), np.array([1.0, 0.0])
    >>> rest = np.zeros(1)
    >>> curvature(displacement(B, D, e, rest, rest, rest).bent, np.array([3.0, 0.0]))
    array([[-3.]])
    """
    m, n = bent.B.shape
    one = np.outer(bent.h_slope * (F @ bent.B) + bent.g_slope * (F @ bent.Dq), bent.tau_q)
    second = bent.g * (F @ bent.D.reshape(m, n * n)).reshape(n, n) + (F @ bent.along) * bent.tau_qq
    return one + one.T + second + (F @ bent.bow) * np.outer(bent.tau_q, bent.tau_q)


def _with_third(function: Callable[..., tuple], tau: float) -> tuple[float, float, float, float]:
    """Return `shortening` or `swing` with its three derivatives."""
    third = function(complex(tau, SMALL))[2].imag / SMALL
    return (*function(tau), third)
