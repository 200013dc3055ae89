"""The equations of motion about a state as matrices, and their roots: stiff modes do not cost the digits of soft ones.

With the accelerations of the state, the generalised forces that the motion needs beyond its loads (inverse dynamics)
change by ``M du' + D du + K dx``. Mass, gyroscopic and circulatory matrices and stiffness stand apart there, each entry
with its own round-off, whereas ``M^-1 K`` mixes the stiffness of every mode into each row.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eig

from modalprep.errors import SimulationError
from modalprep.multibody.analysis.differences import jacobian
from modalprep.multibody.analysis.independent_coordinates import Chart

PLACE_STEP, SPEED_STEP = 0.05, 1.0  # initial steps, in scales of the coordinates and of their rates
EPS = np.finfo(float).eps


@dataclass(frozen=True)
class Roots:
    """Eigenvalues (k,), vectors ``(x, u)`` (2 n, k), and the first-order error of each (k,)."""

    values: np.ndarray
    vectors: np.ndarray
    error: np.ndarray


@dataclass(frozen=True)
class Tangent:
    """``x' = N x + u`` and ``M u' + D u + K x = 0``, all (n, n), with the estimated errors of D and K."""

    N: np.ndarray
    M: np.ndarray
    D: np.ndarray
    K: np.ndarray
    D_error: np.ndarray
    K_error: np.ndarray


def has_tangent(chart: Chart) -> bool:
    """Whether `tangent` applies: closed loops have to be at rest."""
    evaluator = chart.evaluator
    still = not np.any(chart.y[evaluator.nx :]) and not any(joint.motions for joint in evaluator.system.joints)
    return still or not len(chart.dependent)


def tangent(chart: Chart, udot: np.ndarray, N: np.ndarray) -> Tangent:
    """Return the matrices about the state of a chart with accelerations ``udot (nu,)``; N as in `linearise`.

    Raises
    ------
    SimulationError
        When the forces do not exist near the state.
    """
    evaluator = chart.evaluator
    n = len(chart.independent)
    own, scale = udot[chart.independent], evaluator.scale[chart.independent]

    def force(z: np.ndarray) -> np.ndarray:
        state = chart.moved(z[:n], z[n:])
        R = chart.tangent(state)
        try:
            return R.T @ evaluator.required(state, R @ own)
        except SimulationError:
            return np.full(n, np.nan)

    J, error = jacobian(force, np.concatenate([PLACE_STEP * scale, SPEED_STEP * scale]))
    if not np.all(np.isfinite(error)):
        raise SimulationError("cannot linearise: the forces do not exist near this state; use another state")
    M = chart.R.T @ evaluator.mass(chart.y) @ chart.R
    return Tangent(N=N, M=(M + M.T) / 2, D=J[:, n:], K=J[:, :n], D_error=error[:, n:], K_error=error[:, :n])


def roots(t: Tangent) -> Roots:
    """Return the roots, the slowest to round-off of their own size: by shift and inversion near zero.

    Coordinates are scaled to stiffness one, and time by the shift.

    Examples
    --------
    >>> none = np.zeros((2, 2))
    >>> chain = Tangent(none, np.eye(2), none, np.array([[1.0, -1.0], [-1.0, 1.0 + 1e12]]), none, none)
    >>> np.sort(np.abs(roots(chain).values))[::2].round(9).tolist()
    [1.0, 1000000.0]
    """
    n = len(t.M)
    w = _slowest(t)
    S = 1 / np.sqrt(np.abs(np.diag(t.K)) + w**2 * np.diag(t.M))
    N = t.N * S / (S[:, None] * w)
    one = np.eye(n)
    none = np.zeros((n, n))
    M, D, K, D_error, K_error = (
        X * S * S[:, None] for X in (w**2 * t.M, w * t.D, t.K, w * t.D_error, t.K_error + EPS * np.abs(t.K))
    )
    E, F = np.block([[one, none], [none, M]]), np.block([[N, one], [-K, -D]])
    inverse = np.linalg.inv(F - E)
    mu, left, right = eig(inverse @ E, left=True)
    off = np.abs(left).T @ np.abs(inverse) @ np.block([[none, none], [K_error, D_error]]) @ np.abs(right)
    own = EPS * np.linalg.norm(inverse @ E) / np.abs(mu) ** 2  # of vectors of length one
    across = np.maximum(np.abs(np.sum(left.conj() * right, axis=0)), np.finfo(float).tiny)
    error = (np.diag(off) / np.abs(mu) + own) / across
    values = 1 + 1 / mu
    # inversion costs fast roots digits, but none is zero
    fast = np.abs(values) > 1
    dual = (inverse.T @ left).conj()
    values[fast] = (np.sum(dual * (F @ right), axis=0) / np.sum(dual * (E @ right), axis=0))[fast]
    error[fast] = 0.0
    return Roots(values=w * values, vectors=right * np.concatenate([S, w * S])[:, None], error=w * error)


def _slowest(t: Tangent) -> float:
    """Return a rate (1/s) of the order of the slowest: that of a coordinate by itself, else of the damping, else 1."""
    k, m = np.diag(t.K), np.diag(t.M)
    held = k > 10 * np.diag(t.K_error) + EPS * np.abs(t.K).max(axis=1, initial=0.0)
    if np.any(held):
        return float(np.sqrt((k[held] / m[held]).min()))
    return float((np.abs(t.D) / np.sqrt(np.outer(m, m))).max(initial=0.0)) or 1.0
