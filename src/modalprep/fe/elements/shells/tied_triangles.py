"""Tied strains of the curved six-node triangle.

Samples are taken on the sides, which neighbours share, and as means over the element. In-plane strains are interpolated
in the space of Regge of first order, transverse shears in that of Nedelec of second order.

References
----------
K. J. Bathe, F. Brezzi, S. W. Cho, The MITC7 and MITC9 plate bending elements, Computers & Structures 32 (1989) 797:
transverse shear, and the internal rotations that it needs. M. Neunteufel, J. Schoeberl, Avoiding membrane locking with
Regge interpolation, Comput. Methods Appl. Mech. Eng. 373 (2021) 113524: in-plane strains.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from modalprep.fe.elements.shells.tied_strains import CURVATURE, MEMBRANE, SHEAR, Forms
from modalprep.fe.mesh.reference_cells import quadrature, shapes_at

CELL = "triangle6"
# Gauss points of a side
LOW = 0.5 - 0.5 / 3**0.5
HIGH = 0.5 + 0.5 / 3**0.5
SIDES = {  # direction of each side, and the two points on it at which strains along it are sampled
    (1.0, 0.0): ((LOW, 0.0), (HIGH, 0.0)),
    (0.0, 1.0): ((0.0, LOW), (0.0, HIGH)),
    (-1.0, 1.0): ((HIGH, LOW), (LOW, HIGH)),
}
MEAN = 5  # degree of the means over the element, exact for the products of three shapes


@cache
def triangle_forms(degree: int) -> Forms:
    """Return the strains of "triangle6" at points of a rule of that degree, or at the cell's `NODES`.

    Inside, the director may change by ``27 r s (1 - r - s) tau``.

    Examples
    --------
    >>> forms = triangle_forms(4)
    >>> bool(np.abs(forms.xx.sum(axis=3)).max() < 1e-13)  # translations do not strain
    True
    """
    X, _ = quadrature(CELL, degree)
    along = [_along(side, points, X) for side, points in SIDES.items()]
    in_plane = np.stack([along[0], along[1], along[0] + along[1] - along[2]], axis=1)
    xx, xt = np.zeros((2, X.shape[1], 8, 6, 6))
    turned = np.zeros(xx.shape[:3])
    shear = _shear(X)
    xx[:, MEMBRANE] = in_plane / 2
    xt[:, CURVATURE] = in_plane
    xt[:, SHEAR] = shear[..., :6]
    pairs = np.einsum("qia,qb->qabi", shapes_at(CELL, X)[1], _bubble(X)[1])
    turned[:, CURVATURE] = np.stack([pairs[:, 0, 0], pairs[:, 1, 1], pairs[:, 0, 1] + pairs[:, 1, 0]], axis=1)
    turned[:, SHEAR] = shear[..., 6]
    return Forms(xx, xt, turned)


def _along(side, points, X: np.ndarray) -> np.ndarray:
    """Interpolate ``x,v . x,v (nq, 6, 6)`` along v linearly from two points of the side and the mean."""
    inner, weight = quadrature(CELL, MEAN)
    on_side, inside = (shapes_at(CELL, at)[1] @ side for at in (np.array(points).T, inner))
    mean = np.einsum("k,ki,kj->ij", weight / weight.sum(), inside, inside)
    samples = np.concatenate([on_side[:, :, None] * on_side[:, None, :], mean[None]])
    tied = np.vstack([points, [1 / 3, 1 / 3]])  # where a linear function has its mean
    share = np.column_stack([np.ones(X.shape[1]), *X]) @ np.linalg.inv(np.column_stack([np.ones(3), tied]))
    return np.einsum("qk,kij->qij", share, samples)


def _shear(X: np.ndarray) -> np.ndarray:
    """Interpolate ``x,a . t (nq, 2, 6, 7)`` from the shear along the sides and the means; the last t is the bubble."""
    at = np.concatenate([points for points in SIDES.values()])
    side = np.repeat(list(SIDES), 2, axis=0)
    inner, weight = quadrature(CELL, MEAN)
    weight = weight / weight.sum()
    samples = [np.einsum("kija,ka->kij", _products(at.T), side), np.einsum("k,kija->aij", weight, _products(inner))]
    fields = [np.einsum("kam,ka->km", _nedelec(at.T), side), np.einsum("k,kam->am", weight, _nedelec(inner))]
    return np.einsum("qak,kij->qaij", _nedelec(X) @ np.linalg.inv(np.vstack(fields)), np.concatenate(samples))


def _products(X: np.ndarray) -> np.ndarray:
    """Coefficients of ``x,a . t (nq, 6, 7, 2)`` at points ``X (2, nq)``: of six directors and the bubble."""
    N, dN = shapes_at(CELL, X)
    return np.einsum("qia,qj->qija", dN, np.column_stack([N, _bubble(X)[0]]))


def _bubble(X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the function that vanishes on the sides ``(nq,)`` and its gradient ``(nq, 2)``."""
    r, s = X
    return 27 * r * s * (1 - r - s), 27 * np.stack([s * (1 - 2 * r - s), r * (1 - r - 2 * s)], axis=-1)


def _nedelec(X: np.ndarray) -> np.ndarray:
    """Return the eight vector fields ``(nq, 2, 8)`` whose tangents are linear along every side."""
    r, s = X
    one = np.ones_like(r)
    none = np.zeros_like(r)
    first = np.stack([one, r, s, none, none, none, r * s, s * s], axis=-1)
    second = np.stack([none, none, none, one, r, s, -r * r, -r * s], axis=-1)
    return np.stack([first, second], axis=1)
