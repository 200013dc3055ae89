"""Harmonic compliance of a large model: its lowest modes, and a series of static responses for all others."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from modalprep.linalg.blas import inner, subtract
from modalprep.linalg.sparse import times

TERMS = 20  # of the series, at most
ENOUGH = 1e-10  # relative remainder at which it ends
AT_ONCE = 2_000_000  # numbers in memory


@dataclass(frozen=True, eq=False)
class Compliance:
    """Displacements ``F^T u`` under loads F that vibrate, of a model with the stiffness ``K (1 + i loss)``.

    With the modes n that are known, and the others r (theory 3.6):
    ``H = sum_n a a^T / (w_n^2 (1 + i loss) - w^2) + sum_j w^2j / (1 + i loss)^(j + 1) R_j``, where
    ``R_j = sum_r a a^T / w_r^(2 j + 2)`` come from static responses.

    Attributes
    ----------
    w2 : (n,)
        (rad/s)^2, of the modes, ascending.
    a : (n, k)
        Modal forces of the loads.
    rest : (j, k, k)
        R_0, R_1, ...
    """

    w2: np.ndarray
    a: np.ndarray
    rest: np.ndarray

    @property
    def static(self) -> np.ndarray:
        """(k, k) displacements under static loads."""
        return (self.a.T / self.w2) @ self.a + (self.rest[0] if len(self.rest) else 0.0)

    def values(self, omega: np.ndarray, loss: float) -> np.ndarray:
        """Return H (nf, k, k) complex at circular frequencies omega (nf,)."""
        z = 1 + 1j * loss
        square = np.asarray(omega, dtype=float)[:, None] ** 2
        H = np.einsum("ni,fn,nj->fij", self.a, 1 / (self.w2 * z - square), self.a, optimize=True)
        for j, R in enumerate(self.rest):
            H += (square[:, :, None] ** j / z ** (j + 1)) * R
        return H

    def remainder(self, omega: np.ndarray) -> np.ndarray:
        """Return a bound (nf, k) of the diagonal that the series leaves out; infinite beyond the highest mode."""
        if not len(self.rest):
            return np.zeros((len(omega), self.a.shape[1]))
        ratio = np.asarray(omega, dtype=float)[:, None] ** 2 / self.w2[-1]
        left = np.divide(ratio, 1 - ratio, out=np.full(ratio.shape, np.inf), where=ratio < 1)
        return left * np.asarray(omega)[:, None] ** (2 * len(self.rest) - 2) * np.abs(np.diag(self.rest[-1]))


def compliance(
    K: csr_array, M: csr_array, w2: np.ndarray, Phi: np.ndarray, F: np.ndarray, solve: Callable, top: float
) -> Compliance:
    """Return the compliance of a model at circular frequencies up to `top` (rad/s), below its highest known mode.

    Parameters
    ----------
    K, M : (n_dof, n_dof) csr
    w2, Phi : (n,), (n_dof, n)
        All modes up to the highest of them.
    F : (n_dof, k)
        Loads.
    solve : callable
        ``K^-1``.
    top : float
        rad/s.

    Examples
    --------
    >>> K, M = csr_array(np.diag([1.0, 4.0, 9.0])), csr_array(np.eye(3))
    >>> known, F, solve = np.array([1.0, 4.0]), np.ones((3, 1)), lambda f: f / [[1], [4], [9]]
    >>> found = compliance(K, M, known, np.eye(3)[:, :2], F, solve, 1.5)
    >>> bool(abs(found.values(np.array([1.5]), 0.0).item() - 1 / (1 - 2.25) - 1 / (4 - 2.25) - 1 / (9 - 2.25)) < 1e-9)
    True
    """
    a = inner(Phi, F)
    X = subtract(solve(F), Phi, a / w2[:, None])
    rest: list[np.ndarray] = []
    while True:
        force = times(M, X)
        X = subtract(X, Phi, inner(Phi, force))  # of round-off
        rest.append(F.T @ X)
        found = Compliance(w2, a, np.array(rest))
        size = np.abs(np.diag(found.static))
        if len(rest) == TERMS or np.all(found.remainder(np.array([top])) <= ENOUGH * size):
            return found
        X = solve(times(M, X))


def differences(exact: Compliance, other: Compliance, omega: np.ndarray, loss: float) -> np.ndarray:
    """Return the differences (nf,) of two compliances over the size of the first, and what that may be wrong by.

    Each load is scaled to a static compliance of 1, so that forces and moments count alike.

    Examples
    --------
    >>> one = Compliance(np.array([1.0]), np.ones((1, 1)), np.zeros((0, 0, 0)))
    >>> differences(one, Compliance(one.w2 * 2, one.a, one.rest), np.array([0.0]), 0.0)
    array([0.5])
    """
    static = np.diag(exact.static)
    scale = 1 / np.sqrt(static)
    found = []
    for part in np.array_split(omega, max(1, len(omega) * (len(scale) ** 2 + len(other.w2)) // AT_ONCE + 1)):
        H, R = (x.values(part, loss) * scale * scale[:, None] for x in (exact, other))
        unsure = (exact.remainder(part) / static).sum(axis=1)
        found.append((np.linalg.norm(R - H, axis=(1, 2)) + unsure) / np.linalg.norm(H, axis=(1, 2)))
    return np.concatenate(found)


def damped_response(
    M: csr_array, w2: np.ndarray, Phi: np.ndarray, F: np.ndarray, solve: Callable, omega: float, loss: float
) -> np.ndarray:
    """Return the complex displacements ``(K (1 + i loss) - omega^2 M)^-1 F`` (n_dof, k) at one frequency (rad/s).

    The arguments are those of `compliance`.

    Examples
    --------
    >>> M, known, solve = csr_array(np.eye(2)), np.array([1.0]), lambda f: f / [[1], [4]]
    >>> damped_response(M, known, np.eye(2)[:, :1], np.ones((2, 1)), solve, 0.5, 0.0).real.round(9).ravel()
    array([1.33333333, 0.26666667])
    """
    z = 1 + 1j * loss
    a = inner(Phi, F)
    X = subtract(solve(F), Phi, a / w2[:, None])
    u = Phi @ (a / (w2 * z - omega**2)[:, None]) + X / z
    for j in range(1, TERMS):
        force = omega**2 * times(M, X)
        X = solve(force)
        X = subtract(X, Phi, inner(Phi, times(M, X)))
        u += X / z ** (j + 1)
        if np.abs(X).max() <= ENOUGH * np.abs(u).max():
            break
    return u
