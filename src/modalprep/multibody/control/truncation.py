"""Balanced truncation: fewer states, with a bound of the error.

In balanced coordinates every state is as much moved by the inputs as seen in the outputs; the Hankel singular values
say how much. What does not decay is split off before, and kept.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import matrix_balance, schur, solve_continuous_lyapunov, solve_sylvester

from modalprep.errors import InputError
from modalprep.multibody.analysis.state_space import LinearSystem
from modalprep.multibody.control.marginal import is_marginal
from modalprep.suggest import refuse_other

NOTHING = 1e-13  # Hankel singular value over the largest: round-off
TOLD = 1e-3  # change of the steady gain, from which on a note tells it


@dataclass(frozen=True, eq=False, kw_only=True)
class ReducedSystem(LinearSystem):
    """A linear system with fewer states, for the inputs and outputs of another.

    Attributes
    ----------
    full : LinearSystem
        The other.
    hankel : (k,)
        Hankel singular values of the part that decays, all of them, the largest first.
    error_bound : float
        Twice the sum of those left out: a bound of the largest singular value of the error at any frequency.
    kept : int
        Number of states that do not decay, the first ones; they are exact.
    V, W : (nz, nr)
        The states of the other are ``V z``, and ``z = W^T`` times them.

    References
    ----------
    B. C. Moore, Principal component analysis in linear systems, IEEE Trans. Automatic Control 26 (1981) 17.
    """

    full: LinearSystem
    hankel: np.ndarray
    error_bound: float
    kept: int
    V: np.ndarray
    W: np.ndarray


def balanced_truncation(linear: LinearSystem, order: int) -> ReducedSystem:
    """Return a linear system with fewer states, by balanced truncation.

    Rigid motions, undamped vibrations and what grows are split off and kept. The error bound holds for the rest,
    between the inputs and outputs in their units: scale them where they differ much.

    Parameters
    ----------
    order : int
        Number of states left, those that do not decay included.

    Returns
    -------
    ReducedSystem
        Named by its inputs and outputs; a note says how much the steady gain changes, if it does by 0.1 % or more.

    Raises
    ------
    InputError
        When there are no inputs or outputs, or the order is less than the number of states that do not decay, or more
        than the number of all.

    References
    ----------
    B. C. Moore, Principal component analysis in linear systems, IEEE Trans. Automatic Control 26 (1981) 17.
    K. Glover, All optimal Hankel-norm approximations of linear multivariable systems and their L-infinity error
    bounds, Int. J. Control 39 (1984) 1115 (the bound).
    M. S. Tombs, I. Postlethwaite, Truncated balanced realization of a stable non-minimal state-space system,
    Int. J. Control 46 (1987) 1319 (by square roots).

    Examples
    --------
    >>> two = LinearSystem(A=np.diag([-1.0, -10.0]), B=np.ones((2, 1)), C=np.array([[1.0, 0.1]]), D=np.zeros((1, 1)),
    ...                    states=("slow", "fast"), inputs=("i",), outputs=("o",))
    >>> one = balanced_truncation(two, 1)
    >>> one.hankel.round(4).tolist(), round(one.error_bound, 4)
    ([0.5017, 0.0033], 0.0067)
    """
    refuse_other("balanced_truncation: the linear system", LinearSystem, linear)
    if not linear.inputs or not linear.outputs:
        raise InputError("balanced_truncation: the linear system needs inputs and outputs; name them to linearise")
    V, W, kept = _split(linear.A)
    _refuse_order(order, kept, len(linear.A))
    A, B, C = W.T @ linear.A @ V, W.T @ linear.B, linear.C @ V
    stable = slice(kept, None)
    right, left, hankel = _balancing(A[stable, stable], B[stable], C[:, stable])
    count = min(order - kept, int(np.sum(hankel > NOTHING * hankel.max(initial=0.0))))
    V = np.hstack([V[:, :kept], V[:, kept:] @ right[:, :count]])
    W = np.hstack([W[:, :kept], W[:, kept:] @ left[:, :count]])
    reduced = W.T @ linear.A @ V, W.T @ linear.B, linear.C @ V
    gains = [_steady_gain(*each, kept) for each in ((A, B, C), reduced)]
    return ReducedSystem(
        A=reduced[0],
        B=reduced[1],
        C=reduced[2],
        D=linear.D,
        states=(*(f"kept.{k + 1}" for k in range(kept)), *(f"balanced.{k + 1}" for k in range(count))),
        inputs=linear.inputs,
        outputs=linear.outputs,
        notes=(*linear.notes, *_notes(gains[0] + linear.D, gains[1] + linear.D, kept)),
        full=linear,
        hankel=hankel,
        error_bound=float(2 * hankel[count:].sum()),
        kept=kept,
        V=V,
        W=W,
    )


def _refuse_order(order: int, kept: int, count: int) -> None:
    if not isinstance(order, int | np.integer) or not max(kept, 1) <= order <= count:
        why = f": {kept} of the states do not decay and are kept" if kept else ""
        raise InputError(
            f"balanced_truncation: order = {order} must be a whole number from {max(kept, 1)} to {count}{why}"
        )


def _split(A: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
    """Return V, W = V^-T (n, n) with ``W^T A V`` in two blocks, the first of what does not decay, and its size."""
    balanced, (scale, _) = matrix_balance(A, permute=False, separate=True)
    values = np.linalg.eigvals(balanced)
    largest = complex(np.abs(values).max(initial=0.0))
    T, Z, kept = schur(
        balanced, sort=lambda re, im: bool(is_marginal(np.array([complex(re, im), -largest], dtype=np.complex128))[0])
    )
    V, inverse = Z.copy(), Z.T.copy()
    if 0 < kept < len(A):
        X = solve_sylvester(T[:kept, :kept], -T[kept:, kept:], -T[:kept, kept:])
        V[:, kept:] += Z[:, :kept] @ X
        inverse[:kept] -= X @ Z.T[kept:]
    return scale[:, None] * V, (inverse / scale).T, int(kept)


def _balancing(A: np.ndarray, B: np.ndarray, C: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return right and left transformations (n, k) to balanced states, and the Hankel singular values (k,)."""
    if not len(A):
        return np.zeros((0, 0)), np.zeros((0, 0)), np.zeros(0)
    moved = _root(solve_continuous_lyapunov(A, -B @ B.T))
    seen = _root(solve_continuous_lyapunov(A.T, -C.T @ C))
    U, hankel, Vt = np.linalg.svd(seen.T @ moved)
    size = np.sqrt(np.maximum(hankel, np.finfo(float).tiny))
    return moved @ Vt.T / size, seen @ U / size, hankel


def _root(P: np.ndarray) -> np.ndarray:
    """Return L (n, n) with ``L L^T = P`` of a matrix that is positive but for round-off."""
    values, vectors = np.linalg.eigh((P + P.T) / 2)
    return vectors * np.sqrt(np.maximum(values, 0.0))


def _steady_gain(A: np.ndarray, B: np.ndarray, C: np.ndarray, kept: int) -> np.ndarray:
    """Return the gain (no, ni) at rest of the part that decays."""
    own = slice(kept, None)
    return -C[:, own] @ np.linalg.solve(A[own, own], B[own])


def _notes(before: np.ndarray, after: np.ndarray, kept: int) -> tuple[str, ...]:
    notes = [f"{kept} states that do not decay are kept as they are"] if kept else []
    size = np.abs(before).max(initial=0.0)
    change = np.abs(after - before).max(initial=0.0)
    if size and change >= TOLD * size:
        of = "the steady gain of what decays" if kept else "the steady gain"
        notes.append(f"{of} changes by {change / size:.1%} of the largest")
    return tuple(notes)
