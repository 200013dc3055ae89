"""Criteria of correlation: modal assurance, by coordinates, and cross-orthogonality.

All take shapes as ``(d, n)``: the components that both sets know, by the modes.
"""

from __future__ import annotations

import numpy as np

from modalprep.errors import InputError

RANK = 1e-8  # relative singular value below which modes look the same at the sensors


def mac(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the modal assurance criterion ``|a_i^H b_j|^2 / ((a_i^H a_i) (b_j^H b_j))`` of two sets of shapes.

    Parameters
    ----------
    a, b : (d, n), (d, m)
        Real or complex, of any scale.

    Returns
    -------
    (n, m) float
        From 0 to 1; 0 for a shape of zeros.

    References
    ----------
    R. J. Allemang, D. L. Brown, A correlation coefficient for modal vector analysis, IMAC 1982.

    Examples
    --------
    >>> mac(np.array([[1.0, 1.0], [1.0, 0.0]]), np.array([[2.0], [0.0]])).round(2)
    array([[0.5],
           [1. ]])
    """
    product = np.abs(a.conj().T @ b) ** 2
    scale = np.outer(_square(a), _square(b))
    return product / np.where(scale > 0, scale, 1.0)


def comac(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the coordinate MAC of each component over pairs of modes: low where the two sets disagree.

    Parameters
    ----------
    a, b : (d, n)
        Paired modes, mode k of one with mode k of the other; real shapes. Each pair is first brought to one scale
        (both of unit length), so that sets of any normalisation can be compared.

    Returns
    -------
    (d,)
        From 0 to 1; 1 where neither moves.

    References
    ----------
    N. A. J. Lieven, D. J. Ewins, Spatial correlation of mode shapes, the coordinate modal assurance criterion, IMAC
    1988.

    Examples
    --------
    >>> comac(np.eye(2), np.array([[3.0, 0.0], [0.0, -1.0]]))
    array([1., 1.])
    """
    a, b = (x / np.sqrt(np.where(_square(x) > 0, _square(x), 1.0)) for x in (a, b))
    above = np.abs(a * b).sum(axis=1) ** 2
    below = (a**2).sum(axis=1) * (b**2).sum(axis=1)
    return np.where(below > 0, above / np.where(below > 0, below, 1.0), 1.0)


def cross_orthogonality(test: np.ndarray, analysis: np.ndarray) -> np.ndarray:
    """Return test modes in terms of the analysis modes, in the mass of the analysis reduced to the sensors.

    The mass is that of SEREP, ``M = (A^+)^T A^+`` with the analysis modes A of unit modal mass at the sensors, so that
    ``A^T M A = 1``: no mass matrix of the model is needed. Each test mode is brought to unit modal mass in it first.

    Parameters
    ----------
    test : (d, n)
        Real, of any scale.
    analysis : (d, m)
        Of unit modal mass.

    Returns
    -------
    (n, m)
        1 (or -1) and 0 for equal modes; usual requirements are 0.95 (or 0.9) on paired modes and 0.1 elsewhere.

    Raises
    ------
    InputError
        When the sensors cannot tell the analysis modes apart.

    References
    ----------
    J. O'Callahan, P. Avitabile, R. Riemer, System equivalent reduction expansion process (SEREP), IMAC 1989;
    NASA-STD-5002A on the limits.

    Examples
    --------
    >>> cross_orthogonality(np.diag([2.0, -3.0]), np.eye(2)).round(2) + 0.0
    array([[ 1.,  0.],
           [ 0., -1.]])
    """
    inverse = sensor_inverse(analysis)
    weights = (inverse @ test).T  # T^T (A^+)^T A^+ A = (A^+ T)^T
    size = np.linalg.norm(weights, axis=1, keepdims=True)
    return weights / np.where(size > 0, size, 1.0)


def sensor_inverse(analysis: np.ndarray) -> np.ndarray:
    """Return the pseudo-inverse (m, d) of shapes at sensors (d, m).

    Raises
    ------
    InputError
        When the sensors cannot tell the modes apart.
    """
    d, m = analysis.shape
    size = np.sqrt(_square(analysis))
    scaled = analysis / np.where(size > 0, size, 1.0)
    if d < m or np.linalg.matrix_rank(scaled, tol=RANK) < m:
        raise InputError(f"{d} measured components cannot tell {m} modes apart; compare fewer modes, or add sensors")
    return np.linalg.pinv(scaled, rcond=RANK) / size[:, None]


def _square(a: np.ndarray) -> np.ndarray:
    return (np.abs(a) ** 2).sum(axis=0)
