"""Tied strains of the curved eight- and nine-node quadrilaterals.

Across, the strain along one direction is of the space ``1, r, s, r s`` and the square of the other coordinate, given by
two Gauss points of each of the sides in that direction, which neighbours share, and by its mean: the MITC9 plate
element, whose deflection is that of eight nodes and whose director is that of nine. The eight-node shell finds the
director of the centre from equilibrium; the nine-node one has it as a node. The gradient of the deflection that only
the ninth node has, which this interpolation does not see, is added with the size that the strains have of it.

In the plane, curvatures are interpolated from 2 x 3 points, of Gauss' order two along their direction and three
across, and ``2 rs`` from 2 x 2. So are the membrane strains of nine nodes; those of eight nodes, which cannot follow
a surface without stretching in all six, are interpolated as the strains across.

References
----------
K. J. Bathe, F. Brezzi, S. W. Cho, The MITC7 and MITC9 plate bending elements, Computers & Structures 32 (1989) 797:
strains across. M. L. Bucalem, K. J. Bathe, Higher-order MITC general shell elements, Int. J. Numer. Methods Eng. 36
(1993) 3729: strains in the plane.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

from modalprep.fe.elements.shells.tied_strains import CURVATURE, MEMBRANE, SHEAR, Forms
from modalprep.fe.mesh.reference_cells import quadrature, shapes_at

CELL = "quad9"
TWO = 0.5 + 0.5 / 3**0.5 * np.array([-1, 1])  # Gauss points of the unit line
THREE = 0.5 + 0.5 * 0.6**0.5 * np.array([-1, 0, 1])
TIED = {(0, 0): (TWO, THREE), (1, 1): (THREE, TWO), (0, 1): (TWO, TWO)}  # points in r and s, by components
MEAN = 7  # degree of the means over the element, exact for the products of shapes
EIGHT = np.vstack([np.eye(8), shapes_at("quad8", np.full((2, 1), 0.5))[0]])  # nine nodes of a field of eight


@cache
def quad_forms(kind: str, degree: int, tied: bool = True) -> Forms:
    """Return the strains of "quad8" or "quad9" at points of a rule of that degree, or at the cell's `NODES`.

    Without `tied`, those in the plane are as the shapes give them.

    Examples
    --------
    >>> forms = quad_forms("quad8", 5)
    >>> bool(np.abs(forms.xx.sum(axis=3)).max() < 1e-13)  # translations do not strain
    True
    """
    X, _ = quadrature(kind, degree)
    plane = [_of_grid(X, a, b) if tied else _in_plane(X, a, b) for a, b in TIED]
    xx, xt = np.zeros((2, X.shape[1], 8, 9, 9))
    xx[:, MEMBRANE] = xt[:, CURVATURE] = np.stack(plane, axis=1)
    xt[:, SHEAR] = np.stack([_of_sides(X, a, _across) for a in (0, 1)], axis=1)
    if kind == CELL:
        xt[:, SHEAR] += np.einsum("qa,ij->qaij", _bubble(X), _of_bubble())
        return Forms(xx / 2, xt, np.zeros(xx.shape[:3]))
    if tied:
        xx[:, :2] = np.stack([_of_sides(X, a, _in_plane) for a in (0, 1)], axis=1)
    xt = np.einsum("qcij,ik->qckj", xt, EIGHT)
    return Forms(EIGHT.T @ xx @ EIGHT / 2, xt @ EIGHT, xt[..., 8])


def _of_grid(X: np.ndarray, a: int, b: int) -> np.ndarray:
    """Interpolate the products of `_in_plane` at points ``X (2, nq)`` from a grid."""
    r, s = TIED[a, b]
    share = _lagrange(r, X[0])[:, :, None] * _lagrange(s, X[1])[:, None, :]
    return np.einsum("qk,kij->qij", share.reshape(X.shape[1], -1), _in_plane(_grid(r, s), a, b))


def _of_sides(X: np.ndarray, a: int, products: Callable) -> np.ndarray:
    """Interpolate products ``(nq, 9, 9)`` along a from two points of two sides and the mean."""
    on_sides = _grid(TWO, np.array([0.0, 1.0])) if a == 0 else _grid(np.array([0.0, 1.0]), TWO)
    inside, weight = quadrature(CELL, MEAN)
    fields = np.vstack([_fields(on_sides, a), weight @ _fields(inside, a)])
    samples = np.concatenate([products(on_sides, a), np.tensordot(weight, products(inside, a), 1)[None]])
    return np.einsum("qk,kij->qij", _fields(X, a) @ np.linalg.inv(fields), samples)


def _fields(X: np.ndarray, a: int) -> np.ndarray:
    """Return the five polynomials ``(nq, 5)`` of a strain along a: linear on the sides in its direction."""
    return np.stack([np.ones_like(X[0]), X[0], X[1], X[0] * X[1], X[1 - a] ** 2], axis=1)


def _of_bubble() -> np.ndarray:
    """Coefficients ``(9, 9)`` of ``x_i . t_j`` in the size of the bubble in the strains across.

    From the terms ``r s^2`` along r and ``r^2 s`` along s, which are 32 times that size each, at 2 x 3 points.
    """
    highest = [np.linalg.inv(points[:, None] ** np.arange(len(points)))[-1] for points in (TWO, THREE)]
    along = [
        np.einsum("k,l,klij->ij", *own, _across(_grid(*at), a).reshape(len(at[0]), -1, 9, 9))
        for a, own, at in ((0, highest, TIED[0, 0]), (1, highest[::-1], TIED[1, 1]))
    ]
    return (along[0] + along[1]) / 64


def _bubble(X: np.ndarray) -> np.ndarray:
    """Return the gradient ``(nq, 2)`` of the bubble ``16 r (1 - r) s (1 - s)``."""
    r, s = X
    return 16 * np.stack([(1 - 2 * r) * s * (1 - s), r * (1 - r) * (1 - 2 * s)], axis=1)


def _in_plane(X: np.ndarray, a: int, b: int | None = None) -> np.ndarray:
    """Coefficients ``(nq, 9, 9)`` of ``x,a . x,b``, twice and symmetric where b differs from a."""
    dN = shapes_at(CELL, X)[1]
    both = np.einsum("ki,kj->kij", dN[:, :, a], dN[:, :, a if b is None else b])
    return both if b in (None, a) else both + both.transpose(0, 2, 1)


def _across(X: np.ndarray, a: int) -> np.ndarray:
    """Coefficients ``(nq, 9, 9)`` of ``x,a . t``."""
    N, dN = shapes_at(CELL, X)
    return np.einsum("ki,kj->kij", dN[:, :, a], N)


def _grid(r: np.ndarray, s: np.ndarray) -> np.ndarray:
    return np.stack([np.repeat(r, len(s)), np.tile(s, len(r))])


def _lagrange(points: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Lagrange's polynomials ``(nq, k)`` of the points."""
    power = np.arange(len(points))
    return x[:, None] ** power @ np.linalg.inv(points[:, None] ** power)
