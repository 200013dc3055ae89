"""The three contractions by which exchange formats store the modal integrals ``H, P, Kg_W`` of theory 4.

They take an array ``X[a, b, ...]`` that stands for ``int rho r_b X_a``, the first moment of a vector field;
`from_moment` and `from_centrifugal` return its antisymmetric and its symmetric part, `from_inertia` the whole.
"""

from __future__ import annotations

import numpy as np

SPIN_PRODUCTS = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))


def moment(X: np.ndarray) -> np.ndarray:
    """Return ``int rho r x X``, the load of an angular acceleration: ``M_c = eps_cab X_ba`` (3, ...).

    Examples
    --------
    >>> moment(np.array([[0, 0, 0], [2.0, 0, 0], [0, 0, 0]]))  # a field along y, two along x
    array([0., 0., 2.])
    """
    return np.array([X[2, 1] - X[1, 2], X[0, 2] - X[2, 0], X[1, 0] - X[0, 1]])


def centrifugal(X: np.ndarray) -> np.ndarray:
    """Return the coefficients of `SPIN_PRODUCTS` in ``int rho X . w~ w~ r = (w_a w_b - w^2 delta_ab) X_ab`` (6, ...).

    Examples
    --------
    >>> centrifugal(np.diag([1.0, 2, 4]))
    array([-6., -5., -3.,  0.,  0.,  0.])
    """
    trace = np.einsum("aa...->...", X)
    return np.array([X[a, a] - trace if a == b else X[a, b] + X[b, a] for a, b in SPIN_PRODUCTS])


def inertia(X: np.ndarray) -> np.ndarray:
    """Return ``-int rho r~ X~ = tr(X) I - X`` (3, 3, ...).

    Of ``E0`` it is the inertia tensor about the origin.

    Examples
    --------
    >>> inertia(np.diag([1.0, 2, 4])).diagonal()
    array([6., 5., 3.])
    """
    trace = np.einsum("aa...->...", X)
    return np.multiply.outer(np.eye(3), trace) - X


def from_moment(M: np.ndarray) -> np.ndarray:
    """Return the antisymmetric X (3, 3, ...) whose `moment` is M.

    Examples
    --------
    >>> moment(from_moment(np.array([1.0, 2, 4])))
    array([1., 2., 4.])
    """
    X = np.zeros((3, *M.shape))
    for a, b, c in ((2, 1, 0), (0, 2, 1), (1, 0, 2)):
        X[a, b], X[b, a] = M[c] / 2, -M[c] / 2
    return X


def from_centrifugal(spin: np.ndarray) -> np.ndarray:
    """Return the symmetric X (3, 3, ...) whose `centrifugal` coefficients are `spin` (6, ...).

    Examples
    --------
    >>> centrifugal(from_centrifugal(np.array([-6.0, -5, -3, 2, 4, 8])))
    array([-6., -5., -3.,  2.,  4.,  8.])
    """
    X = np.zeros((3, 3, *spin.shape[1:]))
    trace = -spin[:3].sum(axis=0) / 2
    for value, (a, b) in zip(spin, SPIN_PRODUCTS, strict=True):
        X[a, b] = X[b, a] = value + trace if a == b else value / 2
    return X


def from_inertia(J: np.ndarray) -> np.ndarray:
    """Return the X (3, 3, ...) whose `inertia` is J.

    Examples
    --------
    >>> from_inertia(np.diag([6.0, 5, 3])).diagonal()
    array([1., 2., 4.])
    """
    return inertia(J) - np.multiply.outer(np.eye(3), np.einsum("aa...->...", J)) / 2
