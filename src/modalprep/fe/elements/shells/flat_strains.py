"""Compiled strains of one flat shell per local DOF: membrane, drilling, bending and shear (theory 7.3, 7.4).

Strains are taken separately per ``u, v, tz`` (membrane, drilling) and ``w, tx, ty`` (bending, shear) of each node.
Bending and shear are combinations of the sizes of the edge functions, one per side. Arrays only.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.compiler.jit import compile_allocating, compile_inline
from modalprep.fe.elements.kernels import invert

OPT_ALPHA = 1.5  # of the OPT triangle: drilling rotations bow its sides so many times as cubic shapes would
OPT_BETA = ((2 / 3, 4 / 3, 2 / 3), (0.0, 2 / 3, -2 / 3), (-2 / 3, -2 / 3, -4 / 3))  # of its higher-order strains


class Rule(NamedTuple):
    """Shapes of a cell at the points of a quadrature.

    Attributes
    ----------
    N : (nq, n)
        Shape functions.
    dN : (nq, n, 2)
        Their gradients on the reference cell.
    P : (nq, n)
        Edge functions, 1 at the middle of their side.
    dP : (nq, n, 2)
        Their gradients on the reference cell.
    weight : (nq,)
    """

    N: np.ndarray
    dN: np.ndarray
    P: np.ndarray
    dP: np.ndarray
    weight: np.ndarray


class Sides(NamedTuple):
    """Sides of one cell, each from a node to the next.

    Attributes
    ----------
    length : (n,)
        m.
    along : (n, 2)
        Direction.
    size : (n,)
        Size of the edge function per ``w_i - w_j - (L/2)(bs_i + bs_j)``, 1/m.
    sheared : (n,)
        Shear strain along the side per size.
    """

    length: np.ndarray
    along: np.ndarray
    size: np.ndarray
    sheared: np.ndarray


class Moduli(NamedTuple):
    """Moduli of the rows of strain, each ``(ne or 1, ., .)``.

    Attributes
    ----------
    plane : (., m, m)
        Membrane strains 3, then drilling (1) or the higher-order strains of the OPT triangle (3).
    bend : (., 5, 5)
        Curvatures 3, shear 2.
    coupling : (., 3, 3)
        Membrane forces per curvature; zero for symmetric sections.
    """

    plane: np.ndarray
    bend: np.ndarray
    coupling: np.ndarray


class Strains(NamedTuple):
    """Strains of one cell at the points of a rule: ``plane (nq, m, 3n)``, ``bend (nq, 5, 3n)``, and ``dx (nq,)``."""

    plane: np.ndarray
    bend: np.ndarray
    dx: np.ndarray


@compile_allocating
def measure_sides(x, C, sides):
    """Set what `Sides` holds: ``(2/3) L (1 + phi) db = w_i - w_j - (L/2)(bs_i + bs_j)``, ``g = -(2/3) phi db``.

    ``phi = 12 D_s / (S_s L^2)`` with the bending and shear stiffness along the side.
    """
    for k in range(len(x)):
        after = (k + 1) % len(x)
        L = np.hypot(x[after, 0] - x[k, 0], x[after, 1] - x[k, 1])
        c, s = (x[after, 0] - x[k, 0]) / L, (x[after, 1] - x[k, 1]) / L
        strain = (c * c, s * s, 2 * c * s)
        D = 0.0
        for a in range(3):
            for b in range(3):
                D += strain[a] * C[a, b] * strain[b]
        S = c * c * C[3, 3] + c * s * (C[3, 4] + C[4, 3]) + s * s * C[4, 4]
        phi = 12 * D / (S * L * L)
        sides.length[k], sides.along[k, 0], sides.along[k, 1] = L, c, s
        sides.size[k] = 1.5 / (L * (1 + phi))
        sides.sheared[k] = -2 / 3 * phi


@compile_inline
def set_map(x, dN, weight, q, inverse):
    """Set the inverse Jacobian ``dX/dx (2, 2)`` at a point, and return its measure."""
    a = b = c = d = 0.0
    for i in range(len(x)):
        a += x[i, 0] * dN[q, i, 0]
        b += x[i, 0] * dN[q, i, 1]
        c += x[i, 1] * dN[q, i, 0]
        d += x[i, 1] * dN[q, i, 1]
    det = a * d - b * c
    inverse[0, 0] = d / det
    inverse[0, 1] = -b / det
    inverse[1, 0] = -c / det
    inverse[1, 1] = a / det
    return weight[q] * det


@compile_inline
def _pull_back(slope, inverse):
    """Gradient in x, y of a function with a gradient on the reference cell."""
    return (
        slope[0] * inverse[0, 0] + slope[1] * inverse[1, 0],
        slope[0] * inverse[0, 1] + slope[1] * inverse[1, 1],
    )


@compile_inline
def _set(plane, row, i, u, v, t):
    plane[row, 3 * i], plane[row, 3 * i + 1], plane[row, 3 * i + 2] = u, v, t


@compile_inline
def _linear_plane(rule, q, inverse, plane):
    """Coefficients of the strains ``xx, yy, xy`` and of drilling ``(v,x - u,y)/2 - tz`` of linear displacements."""
    for i in range(rule.N.shape[1]):
        x, y = _pull_back(rule.dN[q, i], inverse)
        _set(plane, 0, i, x, 0.0, 0.0)
        _set(plane, 1, i, 0.0, y, 0.0)
        _set(plane, 2, i, y, x, 0.0)
        _set(plane, 3, i, -y / 2, x / 2, -rule.N[q, i])


@compile_allocating
def _higher_plane(dx, dy, area, N, plane):
    natural = np.empty((3, 3))
    cartesian = np.empty((3, 3))
    field = np.zeros((3, 3))
    for a in range(3):
        x, y = dx[(a + 2) % 3], -dy[(a + 2) % 3]  # from node 1 to 2, 2 to 3, 3 to 1
        square = x * x + y * y
        natural[a, 0] = x * x / square
        natural[a, 1] = y * y / square
        natural[a, 2] = x * y / square
        for b in range(3):
            for m in range(3):
                field[a, b] += N[m] * OPT_BETA[(a - m) % 3][(b - m) % 3] * area / square
    invert(natural, cartesian)
    for a in range(3):
        for i in range(3):
            turned = total = 0.0
            for b in range(3):
                turned += cartesian[a, b] * field[b, i]
                total += cartesian[a, b] * (field[b, 0] + field[b, 1] + field[b, 2])
            _set(plane, 3 + a, i, total * dx[i] / (4 * area), -total * dy[i] / (4 * area), turned)


@compile_allocating
def _optimal_plane(x, N, plane):
    """Coefficients of the basic and of the higher-order strains of the OPT triangle, three each."""
    dx, dy = np.empty(3), np.empty(3)  # opposite side of each node: x32, x13, x21 and y23, y31, y12
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        dx[i], dy[i] = x[k, 0] - x[j, 0], x[j, 1] - x[k, 1]
    area = (dx[2] * dy[1] - dx[1] * dy[2]) / 2
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        x_i, y_i = dx[i] / (2 * area), dy[i] / (2 * area)
        turned = OPT_ALPHA / (6 * area) * (dx[j] * dy[j] - dx[k] * dy[k])
        _set(plane, 0, i, y_i, 0.0, OPT_ALPHA / 6 * y_i * (dy[k] - dy[j]))
        _set(plane, 1, i, 0.0, x_i, OPT_ALPHA / 6 * x_i * (dx[k] - dx[j]))
        _set(plane, 2, i, x_i, y_i, turned)
    _higher_plane(dx, dy, area, N, plane)


@compile_inline
def _add_linear_bending(dN, inverse, bend):
    """Curvatures ``bx,x by,y bx,y+by,x`` of linear rotations ``b = (ty, -tx)``."""
    for i in range(len(dN)):
        x, y = _pull_back(dN[i], inverse)
        bend[0, 3 * i + 2] += x
        bend[1, 3 * i + 1] -= y
        bend[2, 3 * i + 2] += y
        bend[2, 3 * i + 1] -= x


@compile_inline
def _shear_of_node(before, after, which):
    """Shear ``xz, yz`` at the node between two sides per strain along the first (0) or the second (1)."""
    det = before[0] * after[1] - before[1] * after[0]
    if which == 0:
        return after[1] / det, -after[0] / det
    return -before[1] / det, before[0] / det


@compile_inline
def _shear(N, k, inverse, sides):
    """Transverse shear ``xz, yz`` per size of the edge function of a side."""
    if len(N) == 3:  # interpolated from the nodes, where two sides meet
        x, y = _shear_of_node(sides.along[(k + 2) % 3], sides.along[k], 1)
        x2, y2 = _shear_of_node(sides.along[k], sides.along[(k + 1) % 3], 0)
        i = N[k] * sides.sheared[k]
        j = N[(k + 1) % 3] * sides.sheared[k]
        return i * x + j * x2, i * y + j * y2
    X, Y = N[1] + N[2], N[2] + N[3]
    along = sides.length[k] * sides.sheared[k] * (1 - Y, X, -Y, X - 1)[k]
    return inverse[k % 2, 0] * along, inverse[k % 2, 1] * along


@compile_allocating
def _add_edge_functions(rule, q, inverse, sides, bend):
    """Curvatures of the edge functions, and transverse shear ``xz, yz`` from the strains along the sides."""
    n = rule.N.shape[1]
    for k in range(n):
        c = sides.along[k, 0]
        s = sides.along[k, 1]
        size = sides.size[k]
        i = 3 * k
        j = 3 * ((k + 1) % n)
        x, y = _pull_back(rule.dP[q, k], inverse)
        xz, yz = _shear(rule.N[q], k, inverse, sides)
        strain = (size * x * c, size * y * s, size * (y * c + x * s), size * xz, size * yz)
        for row in range(5):  # per w_i - w_j - (L/2)(bs_i + bs_j)
            half = strain[row] * sides.length[k] / 2
            bend[row, i] += strain[row]
            bend[row, j] -= strain[row]
            bend[row, i + 1] += half * s
            bend[row, j + 1] += half * s
            bend[row, i + 2] -= half * c
            bend[row, j + 2] -= half * c


@compile_allocating
def compatible(x, optimal, rule, sides, points):
    """Set the strains at the points of a rule, without internal displacements."""
    inverse = np.empty((2, 2))
    points.plane[:] = 0.0
    points.bend[:] = 0.0
    for q in range(len(points.dx)):
        points.dx[q] = set_map(x, rule.dN, rule.weight, q, inverse)
        if optimal:
            _optimal_plane(x, rule.N[q], points.plane[q])
        else:
            _linear_plane(rule, q, inverse, points.plane[q])
        _add_linear_bending(rule.dN[q], inverse, points.bend[q])
        _add_edge_functions(rule, q, inverse, sides, points.bend[q])
