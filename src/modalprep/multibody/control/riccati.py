"""The algebraic Riccati equation of regulators and estimators, with a check of its solution."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, solve_continuous_are

from modalprep.errors import SimulationError

WORST = 1e-6  # what a solution leaves of the equation, relative to its largest term


def solve_riccati(
    A: np.ndarray, B: np.ndarray, Q: np.ndarray, R: np.ndarray, S: np.ndarray, what: str
) -> tuple[np.ndarray, np.ndarray, NDArray[np.complex128]]:
    """Return P of ``A' P + P A - (P B + S) R^-1 (B' P + S') + Q = 0``, the gains ``R^-1 (B' P + S')``, and the poles.

    Raises
    ------
    SimulationError
        When there is no solution with poles that decay, or it is not accurate; `what` begins the sentence.

    Examples
    --------
    >>> P, K, poles = solve_riccati(np.zeros((1, 1)), np.ones((1, 1)), np.full((1, 1), 4.0), np.eye(1),
    ...                             np.zeros((1, 1)), "lqr")
    >>> P.tolist(), K.tolist(), poles.real.tolist()
    ([[2.0]], [[2.0]], [-2.0])
    """
    try:
        P = solve_continuous_are(A, B, Q, R, s=S)
    except (LinAlgError, ValueError) as error:
        raise SimulationError(f"{what}: the Riccati equation has no solution ({error}); change the weights") from None
    K = np.linalg.solve(R, B.T @ P + S.T)
    left = A.T @ P + P @ A - (P @ B + S) @ K + Q
    size = max(np.abs(term).max(initial=0.0) for term in (A.T @ P, (P @ B + S) @ K, Q))
    poles = np.linalg.eigvals(A - B @ K).astype(np.complex128)
    error = np.abs(left).max(initial=0.0) / size
    if not error <= WORST or not np.all(poles.real < 0):
        raise SimulationError(
            f"{what}: the Riccati equation is solved to {error:.0e} only, with the slowest pole at "
            f"{poles.real.max(initial=-np.inf):.2g} 1/s; change the weights, or take a system with fewer states"
        )
    return P, K, poles[np.argsort(-poles.real, kind="stable")]
