"""Motions that do not decay by themselves, and which of them inputs do not move.

A motion with the eigenvalue s is moved by inputs where ``[A - s I, B]`` has full rank (Hautus).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import matrix_balance, svd

DECAYS = 1e-6  # real part over size of an eigenvalue, from which on a vibration decays
STANDS = 1e-7  # of the largest eigenvalue: less is a rigid motion, whose double eigenvalue splits by round-off
UNMOVED = 1e-12  # singular value over the size of A: round-off


@dataclass(frozen=True)
class Unmoved:
    """A motion that inputs do not move: its frequency (Hz; 0: none), and the state with the largest part in it."""

    frequency: float
    state: int

    def told(self, states: tuple[str, ...]) -> str:
        """Return what it is called.

        Examples
        --------
        >>> Unmoved(0.0, 1).told(("hinge.angle", "hinge.rate"))
        "the motion of 'hinge.rate' without vibration"
        """
        how = f"at {self.frequency:.4g} Hz" if self.frequency else "without vibration"
        return f"the motion of {states[self.state]!r} {how}"


def is_marginal(values: NDArray[np.complex128]) -> np.ndarray:
    """Return which eigenvalues do not decay.

    Examples
    --------
    >>> is_marginal(np.array([0.1j, -0.1 + 1j, 1e-12, 2.0]))
    array([ True, False,  True,  True])
    """
    size = np.abs(values)
    return (values.real >= -DECAYS * size) | (size <= STANDS * size.max(initial=0.0))


def unmoved(A: np.ndarray, B: np.ndarray) -> Unmoved | None:
    """Return a motion that does not decay and that no input moves; None where there is none.

    Examples
    --------
    >>> two = np.diag([1.0, 1.0], k=1)[:2, :2]
    >>> unmoved(two, np.array([[0.0], [1.0]])) is None, unmoved(two, np.array([[1.0], [0.0]])).state
    (True, 1)
    """
    balanced, (scale, _) = matrix_balance(A, permute=False, separate=True)
    pushed = B / scale[:, None]
    pushed = pushed / np.maximum(np.linalg.norm(pushed, axis=0), np.finfo(float).tiny)
    values = np.linalg.eigvals(balanced).astype(np.complex128)
    size = np.abs(values).max(initial=0.0) or 1.0
    for value in values[is_marginal(values) & (values.imag >= 0)]:
        left, singular, _ = svd(np.hstack([(balanced - value * np.eye(len(A))) / size, pushed]))
        if singular[-1] <= UNMOVED:
            frequency = value.imag / (2 * np.pi) if value.imag > STANDS * size else 0.0
            return Unmoved(float(frequency), int(np.argmax(np.abs(left[:, -1]))))
    return None
