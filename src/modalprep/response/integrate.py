"""Modal equations over time, exactly where inputs are straight lines between their samples (theory 11.5)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from modalprep.response.modal import ModalEquations

HEAVY = 0.999  # damping ratio above which a mode is not written by its pair of conjugate poles
SERIES = 0.5  # |x| below which phi_2(x) is a power series


@dataclass
class Integrator:
    """Steps ``M q'' + D q' + K q = B u`` through samples of u; it keeps its state from one call to the next.

    Modes that are not coupled and damped below critical have one complex pole each, ``z = q' - conj(l) q`` with
    ``z' = l z + B u``; else the matrix exponential of all modes is taken. Both are exact for inputs that are straight
    between samples (theory 11.5). Coordinates without mass follow the input.
    """

    equations: ModalEquations

    def __post_init__(self) -> None:
        """Begin at rest."""
        self.q = np.zeros(len(self.equations.moving.K))
        self.qd = np.zeros(len(self.equations.moving.K))

    def run(self, step: float, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return q, q' and q'' (nt, n) at samples ``u (nt, k)``, `step` s apart; the first is at the present state."""
        q, qd, qdd = self._moving(step, u)
        still = self.equations.M == 0
        if not still.any():
            return q, qd, qdd
        whole = np.zeros((3, len(u), len(still)))
        whole[0][:, still] = u @ self.equations.B[still].T / self.equations.K[still]
        whole[:, :, ~still] = q, qd, qdd
        return whole[0], whole[1], whole[2]

    def _moving(self, step: float, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return q, q' and q'' of the coordinates with mass."""
        e = self.equations.moving
        force = u @ e.B.T
        q, qd = (_poles if _light(e) else _exponential)(e, step, force, self.q, self.qd)
        self.q, self.qd = q[-1], qd[-1]
        qdd = force - qd @ e.D.T - q * e.K if e.coupled else force - qd * e.D - q * e.K
        return q, qd, qdd


def _light(e: ModalEquations) -> bool:
    """Whether every mode vibrates on its own."""
    return not e.coupled and bool(np.all(e.D < 2 * HEAVY * np.sqrt(e.K)))


def _poles(
    e: ModalEquations, h: float, force: np.ndarray, q0: np.ndarray, qd0: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    decay = e.D / 2
    wd = np.sqrt(e.K - (e.D / 2) ** 2)
    x = h * (-decay + 1j * wd)
    one, two = phi_functions(x)
    # z_{k+1} = exp(x) z_k + h ((phi_1 - phi_2) f_k + phi_2 f_{k+1})
    driven = np.empty(force.shape, dtype=complex)
    driven[0] = qd0 + (decay + 1j * wd) * q0
    driven[1:] = h * ((one - two) * force[:-1] + two * force[1:])
    for k, factor in enumerate(np.exp(x)):
        driven[:, k] = scipy.signal.lfilter([1.0], [1.0, -factor], driven[:, k])
    q = np.imag(driven) / wd
    return q, np.real(driven) - decay * q


def phi_functions(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return ``(exp(x) - 1) / x`` and ``(exp(x) - 1 - x) / x^2``.

    Examples
    --------
    >>> [float(y[0].real) for y in phi_functions(np.array([0j]))]
    [1.0, 0.5]
    """
    small = np.abs(x) < SERIES
    y = np.where(small, 1.0, x)
    term = np.full(x.shape, 0.5, dtype=complex)
    two = np.zeros(x.shape, dtype=complex)
    for k in range(3, 18):
        two += term
        term = term * x / k
    two = np.where(small, two, (np.expm1(y) - y) / y**2)
    return 1 + x * two, two


def _exponential(
    e: ModalEquations, h: float, force: np.ndarray, q0: np.ndarray, qd0: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Step (q, h q') by the exponential of the system with its input and the input's slope as further states."""
    n = len(e.K)
    D = e.D if e.coupled else np.diag(e.D)
    A = np.zeros((4 * n, 4 * n))
    A[:n, n : 2 * n] = np.eye(n)
    A[n : 2 * n, :n] = -np.diag(e.K) * h**2
    A[n : 2 * n, n : 2 * n] = -D * h
    A[n : 2 * n, 2 * n : 3 * n] = np.eye(n)
    A[2 * n : 3 * n, 3 * n :] = np.eye(n)
    E = scipy.linalg.expm(A)[: 2 * n]
    now = E[:, 2 * n : 3 * n] * h**2
    slope = E[:, 3 * n :] * h**2
    driven = force[:-1] @ (now - slope).T + force[1:] @ slope.T
    states = np.empty((len(force), 2 * n))
    states[0] = np.concatenate([q0, h * qd0])
    step = np.ascontiguousarray(E[:, : 2 * n])
    for k, part in enumerate(driven):
        states[k + 1] = step @ states[k] + part
    return states[:, :n], states[:, n:] / h
