"""Tied strains of the curved six-node triangle as constants of the unit triangle, and its geometry.

A shell has the mid-surface ``x = N_i x_i`` and the director ``t = N_i t_i``. Its covariant strains are products of the
nodal vectors: membrane ``x,a . x,b / 2``, curvature ``x,a . t,b`` and transverse shear ``x,a . t``, each less its value
at the start. Evaluated everywhere they lock; interpolated from samples on the sides, which neighbours share, and from
means over the element, they do not. In-plane strains are interpolated in the space of Regge of first order, transverse
shears in that of Nedelec of second order. Since the samples are fixed on the unit triangle, so are the coefficients of
``x_i . x_j`` and ``x_i . t_j``.

References
----------
K. J. Bathe, F. Brezzi, S. W. Cho, The MITC7 and MITC9 plate bending elements, Computers & Structures 32 (1989) 797:
transverse shear, and the internal rotations that it needs. M. Neunteufel, J. Schoeberl, Avoiding membrane locking with
Regge interpolation, Comput. Methods Appl. Mech. Eng. 373 (2021) 113524: in-plane strains.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np

from modalprep.fe.mesh.reference_cells import quadrature, shapes, shapes_at

CELL = "triangle6"
LOW, HIGH = 0.5 - 0.5 / 3**0.5, 0.5 + 0.5 / 3**0.5  # Gauss points of a side
SIDES = {  # direction of each side, and the two points on it at which strains along it are sampled
    (1.0, 0.0): ((LOW, 0.0), (HIGH, 0.0)),
    (0.0, 1.0): ((0.0, LOW), (0.0, HIGH)),
    (-1.0, 1.0): ((HIGH, LOW), (LOW, HIGH)),
}
MEAN = 5  # degree of the means over the element, exact for the products of three shapes
MEMBRANE, CURVATURE, SHEAR = slice(0, 3), slice(3, 6), slice(6, 8)  # rows of the eight strains


@cache
def strain_forms(degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the coefficients of the eight covariant strains ``rr, ss, 2 rs`` (twice), ``r, s`` at points of a rule.

    Parameters
    ----------
    degree : int
        Of the quadrature, or `reference_cells.NODES`.

    Returns
    -------
    xx : (nq, 8, 6, 6)
        Of ``x_i . x_j``, symmetric in i and j.
    xt : (nq, 8, 6, 6)
        Of ``x_i . t_j``.

    Examples
    --------
    >>> xx, xt = strain_forms(4)
    >>> bool(np.abs(xx.sum(axis=3)).max() < 1e-13)  # translations do not strain
    True
    """
    X, _ = quadrature(CELL, degree)
    along = [_along(side, points, X) for side, points in SIDES.items()]
    in_plane = np.stack([along[0], along[1], along[0] + along[1] - along[2]], axis=1)
    xx, xt = np.zeros((2, X.shape[1], 8, 6, 6))
    xx[:, MEMBRANE], xt[:, CURVATURE], xt[:, SHEAR] = in_plane / 2, in_plane, _shear(X)[..., :6]
    return xx, xt


@cache
def bubble_forms(degree: int) -> np.ndarray:
    """Return the coefficients ``(nq, 8, 6)`` of ``x_i . t`` when the director grows by ``27 r s (1 - r - s) t``."""
    X, _ = quadrature(CELL, degree)
    dN, slope = shapes_at(CELL, X)[1], _bubble(X)[1]
    pairs = np.einsum("qia,qb->qabi", dN, slope)
    forms = np.zeros((X.shape[1], 8, 6))
    forms[:, CURVATURE] = np.stack([pairs[:, 0, 0], pairs[:, 1, 1], pairs[:, 0, 1] + pairs[:, 1, 0]], axis=1)
    forms[:, SHEAR] = _shear(X)[..., 6]
    return forms


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
    one, none = np.ones_like(r), np.zeros_like(r)
    first = np.stack([one, r, s, none, none, none, r * s, s * s], axis=-1)
    second = np.stack([none, none, none, one, r, s, -r * r, -r * s], axis=-1)
    return np.stack([first, second], axis=1)


class Points(NamedTuple):
    """A curved surface at the points of a rule.

    Attributes
    ----------
    axes : (ne, nq, 3, 3)
        Rows: e1 along the projection of the element's, e2, the unit normal e3.
    dx : (ne, nq)
        Share of the area, m^2.
    cartesian : (ne, nq, 8, 8)
        From covariant strains to those along the axes.
    gradient : (ne, nq, 2, 6)
        Of the shape functions along e1 and e2, 1/m.
    """

    axes: np.ndarray
    dx: np.ndarray
    cartesian: np.ndarray
    gradient: np.ndarray


def surface_points(x: np.ndarray, normal: np.ndarray, frame: np.ndarray, degree: int) -> Points:
    """Return the surface through ``x (ne, 6, 3)`` with directors `normal`, e1 projected from the first row of `frame`.

    The curvatures along the axes are those of Budiansky and Sanders: what a stretching of the curved surface adds to
    the covariant ones is taken off, so that a sphere under pressure does not bend.
    """
    base, e3 = tangents(x, degree)
    _, dN, weight = shapes(CELL, degree)
    e1 = frame[:, None, 0] - np.einsum("eqa,ea->eq", e3, frame[:, 0])[..., None] * e3
    e1 /= np.linalg.norm(e1, axis=2, keepdims=True)
    axes = np.stack([e1, np.cross(e3, e1), e3], axis=2)
    J = base @ axes[:, :, :2].transpose(0, 1, 3, 2)
    inverse = np.linalg.inv(J)
    gradient = inverse @ dN.transpose(0, 2, 1)
    slope = gradient @ normal[:, None] @ axes[:, :, :2].transpose(0, 1, 3, 2)
    return Points(axes, weight * np.linalg.det(J), _cartesian(inverse, slope), gradient)


def tangents(x: np.ndarray, degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Return ``x,r`` and ``x,s (ne, nq, 2, 3)`` of ``x (ne, 6, 3)`` and the unit normals ``(ne, nq, 3)``, or zero."""
    base = np.einsum("qia,eib->eqab", shapes(CELL, degree)[1], x)
    normal = np.cross(base[:, :, 0], base[:, :, 1])
    length = np.linalg.norm(normal, axis=2, keepdims=True)
    return base, normal / np.where(length > 0, length, 1.0)


def _cartesian(g: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """Return ``(ne, nq, 8, 8)``; `g` has the components of ``a^alpha`` in its columns, `slope` those of ``t,a``."""
    T = np.zeros((*g.shape[:2], 8, 8))
    (a, b), (c, d) = np.moveaxis(g, (2, 3), (0, 1))
    plane = np.array([[a * a, b * b, a * b], [c * c, d * d, c * d], [2 * a * c, 2 * b * d, a * d + b * c]])
    T[:, :, MEMBRANE, MEMBRANE] = T[:, :, CURVATURE, CURVATURE] = np.moveaxis(plane, (0, 1), (2, 3))
    T[:, :, SHEAR, SHEAR] = g
    xx, yy, xy = slope[..., 0, 0], slope[..., 1, 1], (slope[..., 0, 1] + slope[..., 1, 0]) / 2
    none = np.zeros_like(xx)
    stretched = np.array([[xx, none, xy / 2], [none, yy, xy / 2], [xy, xy, (xx + yy) / 2]])
    T[:, :, CURVATURE, MEMBRANE] = -np.moveaxis(stretched, (0, 1), (2, 3)) @ T[:, :, MEMBRANE, MEMBRANE]
    return T
