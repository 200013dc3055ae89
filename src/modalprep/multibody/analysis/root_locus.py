"""Poles of linear equations whose loop is closed by a gain, and the zeros to which they go."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import scipy
from numpy.typing import NDArray

from modalprep.errors import InputError
from modalprep.multibody.analysis.state_space import LinearSystem
from modalprep.vectors import VectorLike

FAR = 10.0  # times the largest pole: zeros beyond are those at infinity, moved by rounding errors
RIGID, INFINITE = 1e-6, 1e6  # of the norm of A, below which all poles are zero; rad/s, beyond which zeros are then
CLOSED = 1e-12  # of |1 + k D|, below which the loop has no solution


def root_locus(linear: LinearSystem, gain: VectorLike) -> NDArray[np.complex128]:
    """Return the poles of ``i = -k o`` for each gain k, a column for each branch.

    Parameters
    ----------
    linear : LinearSystem
        With one input and one output.
    gain : (nk,)
        Unit of the input per unit of the output; near enough to each other that branches can be told apart.

    Returns
    -------
    (nk, nz) complex
        1/s.

    Raises
    ------
    InputError
        When there is not one input and one output, or a gain makes ``1 + k D`` zero.

    References
    ----------
    W. R. Evans, Control system synthesis by root locus method, Transactions of the AIEE 69 (1950).

    Examples
    --------
    >>> oscillator = LinearSystem(A=np.array([[0, 1.0], [-4.0, 0]]), B=np.array([[0], [1.0]]), C=np.array([[1.0, 0]]),
    ...                           D=np.zeros((1, 1)), states=("x", "v"), inputs=("f",), outputs=("x",))
    >>> np.abs(root_locus(oscillator, [0.0, 5.0])).round(9).tolist()
    [[2.0, 2.0], [3.0, 3.0]]
    """
    b, c, d = _loop(linear)
    gains = np.atleast_1d(np.asarray(gain, dtype=float))
    if np.any(np.abs(1 + gains * d) < CLOSED):
        raise InputError(f"root locus: the gain {-1 / d:g} makes 1 + k D zero, and the loop has no solution")
    matrices = linear.A - (gains / (1 + gains * d))[:, None, None] * np.outer(b, c)
    return _branches(np.linalg.eigvals(matrices).astype(np.complex128))


def zeros_of_loop(linear: LinearSystem) -> NDArray[np.complex128]:
    """Return the zeros of the one input and the one output, 1/s, that are within ten times the largest pole.

    Of poles that are all zero, those within 1e6 rad/s.

    Returns
    -------
    (n,) complex

    Raises
    ------
    InputError
        When there is not one input and one output.

    Examples
    --------
    >>> damper = LinearSystem(A=np.array([[0, 1.0], [-4.0, 0]]), B=np.array([[0], [1.0]]), C=np.array([[3.0, 1.0]]),
    ...                       D=np.zeros((1, 1)), states=("x", "v"), inputs=("f",), outputs=("o",))
    >>> zeros_of_loop(damper).real.round(9).tolist()
    [-3.0]
    """
    b, c, d = _loop(linear)
    pencil = np.block([[linear.A, b[:, None]], [c[None, :], np.array([[d]])]])
    mass = np.diag(np.append(np.ones(len(b)), 0.0))
    found = scipy.linalg.eigvals(pencil, mass).astype(np.complex128)
    found = found[np.isfinite(found)]
    largest = np.abs(linear.poles).max(initial=0.0)
    far = FAR * largest if largest > RIGID * np.linalg.norm(linear.A) else INFINITE
    return found[np.abs(found) <= far]


def _loop(linear: LinearSystem) -> tuple[np.ndarray, np.ndarray, float]:
    """Return column of B, row of C and entry of D of the only input and output."""
    if len(linear.inputs) != 1 or len(linear.outputs) != 1:
        raise InputError(
            f"a root locus closes the loop from one output to one input; {len(linear.inputs)} inputs and "
            f"{len(linear.outputs)} outputs came: name one of each"
        )
    return linear.B[:, 0], linear.C[0], float(linear.D[0, 0])


def _branches(poles: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Order the poles (nk, nz) of each gain by their distance from those of the gain before."""
    for before, row in pairwise(poles):
        order = scipy.optimize.linear_sum_assignment(np.abs(before[:, None] - row))[1]
        row[:] = row[order]
    return poles
