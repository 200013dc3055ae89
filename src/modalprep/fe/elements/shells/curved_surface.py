"""Geometry of a curved shell at the points of a rule, and the way from covariant strains to those along its axes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.fe.elements.shells.tied_strains import CURVATURE, MEMBRANE, SHEAR
from modalprep.fe.mesh.reference_cells import shapes


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
    gradient : (ne, nq, 2, n)
        Of the shape functions along e1 and e2, 1/m.
    """

    axes: np.ndarray
    dx: np.ndarray
    cartesian: np.ndarray
    gradient: np.ndarray


def surface_points(kind: str, x: np.ndarray, normal: np.ndarray, frame: np.ndarray, degree: int) -> Points:
    """Return the surface through ``x (ne, n, 3)`` with directors `normal`, e1 projected from the first row of `frame`.

    The curvatures along the axes are those of Budiansky and Sanders: what a stretching of the curved surface adds to
    the covariant ones is taken off, so that a sphere under pressure does not bend.
    """
    base, e3 = tangents(kind, x, degree)
    _, dN, weight = shapes(kind, degree)
    e1 = frame[:, None, 0] - np.einsum("eqa,ea->eq", e3, frame[:, 0])[..., None] * e3
    e1 /= np.linalg.norm(e1, axis=2, keepdims=True)
    axes = np.stack([e1, np.cross(e3, e1), e3], axis=2)
    J = base @ axes[:, :, :2].transpose(0, 1, 3, 2)
    inverse = np.linalg.inv(J)
    gradient = inverse @ dN.transpose(0, 2, 1)
    slope = gradient @ normal[:, None] @ axes[:, :, :2].transpose(0, 1, 3, 2)
    return Points(axes, weight * np.linalg.det(J), _cartesian(inverse, slope), gradient)


def tangents(kind: str, x: np.ndarray, degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Return ``x,r`` and ``x,s (ne, nq, 2, 3)`` of ``x (ne, n, 3)`` and the unit normals ``(ne, nq, 3)``, or zero."""
    base = np.einsum("qia,eib->eqab", shapes(kind, degree)[1], x)
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
    xx = slope[..., 0, 0]
    yy = slope[..., 1, 1]
    xy = (slope[..., 0, 1] + slope[..., 1, 0]) / 2
    none = np.zeros_like(xx)
    stretched = np.array([[xx, none, xy / 2], [none, yy, xy / 2], [xy, xy, (xx + yy) / 2]])
    T[:, :, CURVATURE, MEMBRANE] = -np.moveaxis(stretched, (0, 1), (2, 3)) @ T[:, :, MEMBRANE, MEMBRANE]
    return T
