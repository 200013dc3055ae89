"""Compiled loops over flat shells: strain rows, and samples of the mass, per nodal DOF in mesh axes (theory 7.3, 7.4).

A node at the height z under the mid-surface moves it by ``u + z t x e3``. A row of coefficients ``(a, b, c)`` per node
of the displacements in the plane and the drilling rotation in the element's axes is therefore
``a e1 + b e2`` on u and ``z (a e2 - b e1) + c e3`` on t. Bending and shear are combinations of the sizes of the edge
functions, one row per side. Arrays only.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.fe.elements.kernels import invert
from modalprep.jit import compile_allocating

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


class Geometry(NamedTuple):
    """Flat cells: ``xy (ne, n, 2)`` in the plane, axes ``frame (ne, 3, 3)`` by rows, ``height (ne, n)`` over the nodes."""

    xy: np.ndarray
    frame: np.ndarray
    height: np.ndarray


class Sides(NamedTuple):
    """Sides of one cell, each from a node to the next.

    Attributes
    ----------
    length : (n,)
        m.
    along : (n, 2)
        Direction.
    turned : (n, 3)
        ``along x e3``: the rotation along the side per rotation vector, mesh axes.
    size : (n,)
        Size of the edge function per ``w_i - w_j - (L/2)(bs_i + bs_j)``, 1/m.
    sheared : (n,)
        Shear strain along the side per size.
    """

    length: np.ndarray
    along: np.ndarray
    turned: np.ndarray
    size: np.ndarray
    sheared: np.ndarray


@compile_allocating
def strain_rows(lo, hi, cells, moduli, optimal, own, rule, elsewhere, B, dx):
    """Strain rows ``B (ne, nq, ns, 6n)`` and measure ``dx (ne, nq)`` at the points of `rule`.

    Rows as in `shell.ShellBlock.strain`, moduli ``(ne or 1, ns, ns)``. The internal displacements of quads are
    condensed at the points of `own`, which are others than those of `rule` where `elsewhere` says so.
    """
    n = cells.xy.shape[1]
    sides = Sides(np.empty(n), np.empty((n, 2)), np.empty((n, 3)), np.empty(n), np.empty(n))
    plane, inner = np.empty((B.shape[2] - 5, n, 3)), np.empty((4, 6 * n))
    there, area = np.empty((len(own.weight), B.shape[2], 6 * n)), np.empty(len(own.weight))
    for e in range(lo, hi):
        x, R, C = cells.xy[e], cells.frame[e], moduli[e if len(moduli) > 1 else 0]
        _measure_sides(x, R, C, sides)
        _compatible(x, R, cells.height[e], optimal, rule, sides, plane, B[e], dx[e])
        if n == 4:
            if elsewhere:
                _compatible(x, R, cells.height[e], optimal, own, sides, plane, there, area)
                _condense(x, C, own, there, area, inner)
            else:
                _condense(x, C, rule, B[e], dx[e], inner)
            _add_internal(x, rule, dx[e], inner, B[e])


@compile_allocating
def _measure_sides(x, R, C, sides):
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
                D += strain[a] * C[3 + a, 3 + b] * strain[b]
        S = c * c * C[6, 6] + c * s * (C[6, 7] + C[7, 6]) + s * s * C[7, 7]
        phi = 12 * D / (S * L * L)
        sides.length[k], sides.along[k, 0], sides.along[k, 1] = L, c, s
        sides.size[k], sides.sheared[k] = 1.5 / (L * (1 + phi)), -2 / 3 * phi
        for a in range(3):
            sides.turned[k, a] = c * R[1, a] - s * R[0, a]


@compile_allocating
def _map(x, dN, weight, q, inverse):
    """Set the inverse Jacobian ``dX/dx (2, 2)`` at a point, and return its measure."""
    a = b = c = d = 0.0
    for i in range(len(x)):
        a += x[i, 0] * dN[q, i, 0]
        b += x[i, 0] * dN[q, i, 1]
        c += x[i, 1] * dN[q, i, 0]
        d += x[i, 1] * dN[q, i, 1]
    det = a * d - b * c
    inverse[0, 0], inverse[0, 1], inverse[1, 0], inverse[1, 1] = d / det, -b / det, -c / det, a / det
    return weight[q] * det


@compile_allocating
def _pull_back(slope, inverse):
    """Gradient in x, y of a function with a gradient on the reference cell."""
    return (
        slope[0] * inverse[0, 0] + slope[1] * inverse[1, 0],
        slope[0] * inverse[0, 1] + slope[1] * inverse[1, 1],
    )


@compile_allocating
def _compatible(x, R, z, optimal, rule, sides, plane, B, dx):
    """Strain rows ``B (nq, ns, 6n)`` without internal displacements, and measure ``dx (nq,)``."""
    inverse = np.empty((2, 2))
    B[:] = 0.0
    for q in range(len(B)):
        dx[q] = _map(x, rule.dN, rule.weight, q, inverse)
        if optimal:
            _optimal_plane(x, rule.N[q], plane)
        else:
            _linear_plane(rule, q, inverse, plane)
        _add_plane(plane, R, z, B[q])
        _add_linear_bending(rule.dN[q], inverse, R, B[q])
        _add_edge_functions(rule, q, inverse, R, sides, B[q])


@compile_allocating
def _linear_plane(rule, q, inverse, plane):
    """Coefficients of the strains ``xx, yy, xy`` and of drilling ``(v,x - u,y)/2 - tz`` of linear displacements."""
    for i in range(plane.shape[1]):
        x, y = _pull_back(rule.dN[q, i], inverse)
        _set(plane, 0, i, x, 0.0, 0.0)
        _set(plane, 1, i, 0.0, y, 0.0)
        _set(plane, 2, i, y, x, 0.0)
        _set(plane, 3, i, -y / 2, x / 2, -rule.N[q, i])


@compile_allocating
def _set(plane, row, i, u, v, t):
    plane[row, i, 0], plane[row, i, 1], plane[row, i, 2] = u, v, t


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


@compile_allocating
def _higher_plane(dx, dy, area, N, plane):
    natural, cartesian, field = np.empty((3, 3)), np.empty((3, 3)), np.zeros((3, 3))
    for a in range(3):
        x, y = dx[(a + 2) % 3], -dy[(a + 2) % 3]  # from node 1 to 2, 2 to 3, 3 to 1
        square = x * x + y * y
        natural[a, 0], natural[a, 1], natural[a, 2] = x * x / square, y * y / square, x * y / square
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
def _add_plane(plane, R, z, B):
    for s in range(len(plane)):
        row = s if s < 3 else s + 5
        for i in range(plane.shape[1]):
            u, v, t = plane[s, i, 0], plane[s, i, 1], plane[s, i, 2]
            for c in range(3):
                B[row, 6 * i + c] += u * R[0, c] + v * R[1, c]
                B[row, 6 * i + 3 + c] += z[i] * (u * R[1, c] - v * R[0, c]) + t * R[2, c]


@compile_allocating
def _add_linear_bending(dN, inverse, R, B):
    """Curvatures ``bx,x by,y bx,y+by,x`` of linear rotations ``b = (ty, -tx)``."""
    for i in range(len(dN)):
        x, y = _pull_back(dN[i], inverse)
        for c in range(3):
            B[3, 6 * i + 3 + c] += x * R[1, c]
            B[4, 6 * i + 3 + c] -= y * R[0, c]
            B[5, 6 * i + 3 + c] += y * R[1, c] - x * R[0, c]


@compile_allocating
def _add_edge_functions(rule, q, inverse, R, sides, B):
    """Curvatures of the edge functions, and transverse shear ``xz, yz`` from the strains along the sides."""
    for k in range(rule.N.shape[1]):
        c, s = sides.along[k, 0], sides.along[k, 1]
        x, y = _pull_back(rule.dP[q, k], inverse)
        xz, yz = _shear(rule.N[q], k, inverse, sides)
        _add_side(k, (x * c, y * s, y * c + x * s, xz, yz), R, sides, B)


@compile_allocating
def _add_side(k, weight, R, sides, B):
    """Add the size of an edge function, weighted, to the rows of curvature and shear."""
    i, j = 6 * k, 6 * ((k + 1) % len(sides.size))
    for row in range(5):
        size = weight[row] * sides.size[k]
        for c in range(3):
            B[3 + row, i + c] += size * R[2, c]
            B[3 + row, j + c] -= size * R[2, c]
            turned = size * sides.length[k] / 2 * sides.turned[k, c]
            B[3 + row, i + 3 + c] -= turned
            B[3 + row, j + 3 + c] -= turned


@compile_allocating
def _shear(N, k, inverse, sides):
    """Transverse shear ``xz, yz`` per size of the edge function of a side."""
    if len(N) == 3:  # interpolated from the nodes, where two sides meet
        x, y = _shear_of_node(sides.along[(k + 2) % 3], sides.along[k], 1)
        x2, y2 = _shear_of_node(sides.along[k], sides.along[(k + 1) % 3], 0)
        i, j = N[k] * sides.sheared[k], N[(k + 1) % 3] * sides.sheared[k]
        return i * x + j * x2, i * y + j * y2
    X, Y = N[1] + N[2], N[2] + N[3]
    along = sides.length[k] * sides.sheared[k] * (1 - Y, X, -Y, X - 1)[k]
    return inverse[k % 2, 0] * along, inverse[k % 2, 1] * along


@compile_allocating
def _shear_of_node(before, after, which):
    """Shear ``xz, yz`` at the node between two sides per strain along the first (0) or the second (1)."""
    det = before[0] * after[1] - before[1] * after[0]
    if which == 0:
        return after[1] / det, -after[0] / det
    return -before[1] / det, before[0] / det


@compile_allocating
def _internal_slopes(x, rule, q, dx, slope):
    """Gradients ``(2, 2)`` of QM6's internal shapes, mapped by the Jacobian of the centre (row: shape)."""
    a, b = (x[1, 0] + x[2, 0] - x[0, 0] - x[3, 0]) / 2, (x[2, 0] + x[3, 0] - x[0, 0] - x[1, 0]) / 2
    c, d = (x[1, 1] + x[2, 1] - x[0, 1] - x[3, 1]) / 2, (x[2, 1] + x[3, 1] - x[0, 1] - x[1, 1]) / 2
    scale = rule.weight[q] / dx  # times the inverse of the Jacobian and its determinant
    X = scale * (4 - 8 * (rule.N[q, 1] + rule.N[q, 2]))
    Y = scale * (4 - 8 * (rule.N[q, 2] + rule.N[q, 3]))
    slope[0, 0], slope[0, 1], slope[1, 0], slope[1, 1] = X * d, -X * b, -Y * c, Y * a


@compile_allocating
def _condense(x, C, rule, B, dx, inner):
    """Set QM6's internal displacements ``inner (4, 24)`` per nodal DOF."""
    slope, own, stress, K = np.empty((2, 2)), np.zeros((4, 3)), np.empty((4, 6)), np.zeros((4, 4))
    inner[:] = 0.0
    for q in range(len(dx)):
        _internal_slopes(x, rule, q, dx[q], slope)
        for k in range(2):
            own[2 * k, 0] = own[2 * k + 1, 2] = slope[k, 0]
            own[2 * k + 1, 1] = own[2 * k, 2] = slope[k, 1]
        for p in range(4):
            for t in range(6):
                s = own[p, 0] * C[0, t] + own[p, 1] * C[1, t] + own[p, 2] * C[2, t]
                stress[p, t] = dx[q] * s
                if s != 0.0:
                    for j in range(inner.shape[1]):
                        inner[p, j] -= stress[p, t] * B[q, t, j]
            for r in range(4):
                K[p, r] += stress[p, 0] * own[r, 0] + stress[p, 1] * own[r, 1] + stress[p, 2] * own[r, 2]
    _solve(K, inner)


@compile_allocating
def _solve(K, right):
    """Replace ``right (m, k)`` by ``K^-1 right``, K symmetric and positive definite."""
    m = len(K)
    for p in range(m):
        for r in range(p + 1, m):
            factor = K[r, p] / K[p, p]
            for t in range(p, m):
                K[r, t] -= factor * K[p, t]
            for j in range(right.shape[1]):
                right[r, j] -= factor * right[p, j]
    for p in range(m - 1, -1, -1):
        for j in range(right.shape[1]):
            for r in range(p + 1, m):
                right[p, j] -= K[p, r] * right[r, j]
            right[p, j] /= K[p, p]


@compile_allocating
def _add_internal(x, rule, dx, inner, B):
    slope = np.empty((2, 2))
    for q in range(len(dx)):
        _internal_slopes(x, rule, q, dx[q], slope)
        for k in range(2):
            x_k, y_k = slope[k, 0], slope[k, 1]
            for j in range(inner.shape[1]):
                B[q, 0, j] += x_k * inner[2 * k, j]
                B[q, 1, j] += y_k * inner[2 * k + 1, j]
                B[q, 2, j] += y_k * inner[2 * k, j] + x_k * inner[2 * k + 1, j]


@compile_allocating
def mass_samples(lo, hi, cells, middle, lift, surface, sheet, dx, position, values):
    """Samples of the mass at the points of `surface`, then those of the thickness at the points of `sheet`.

    ``middle (ne, 3)`` is the point of the mid-surface over the mean of the nodes, `lift` the height of the mass over
    the mid-surface, m. Sets ``dx (ne, ns)``, ``position (ne, ns, 3)``, the normal for the thickness, and
    ``values (ne, ns, nn, 10)`` as in `mass.NodalFunctions`: of the displacement of the mass, and of its change per
    height.
    """
    n, count, inverse, bowed = cells.xy.shape[1], len(surface.weight), np.empty((2, 2)), np.empty((4, 3))
    for e in range(lo, hi):
        x, R, z = cells.xy[e], cells.frame[e], cells.height[e]
        for q in range(count):
            dx[e, q] = _map(x, surface.dN, surface.weight, q, inverse)
            _bow(x, R, surface.P[q], bowed)
            for c in range(3):
                position[e, q, c] = middle[e, c] + lift * R[2, c]
            for i in range(n):
                N = surface.N[q, i]
                for c in range(3):
                    position[e, q, c] += N * (x[i, 0] * R[0, c] + x[i, 1] * R[1, c])
                _set_lever(N * (z[i] + lift), R[2], bowed[i], N, values[e, q, i])
        bowed[:] = 0.0
        for q in range(len(sheet.weight)):
            dx[e, count + q] = _map(x, sheet.dN, sheet.weight, q, inverse)
            for c in range(3):
                position[e, count + q, c] = R[2, c]
            for i in range(n):
                _set_lever(sheet.N[q, i], R[2], bowed[i], 0.0, values[e, count + q, i])


@compile_allocating
def _set_lever(height, normal, bowed, N, values):
    """Set the functions of a node: ``N u``, ``t x normal`` times the height, and ``bowed . t`` along the normal."""
    for a in range(3):
        b, c = (a + 1) % 3, (a + 2) % 3
        values[3 * a + a] = normal[a] * bowed[a]
        values[3 * a + b] = normal[a] * bowed[b] + height * normal[c]
        values[3 * a + c] = normal[a] * bowed[c] - height * normal[b]
    values[9] = N


@compile_allocating
def _bow(x, R, P, bowed):
    """Deflection ``bowed (n, 3)`` of the edge functions ``(L/8)(bs_j - bs_i)`` of all sides per rotation of a node."""
    bowed[:] = 0.0
    for k in range(len(x)):
        after = (k + 1) % len(x)
        c, s = (x[after, 0] - x[k, 0]) / 8, (x[after, 1] - x[k, 1]) / 8
        for a in range(3):
            turned = P[k] * (c * R[1, a] - s * R[0, a])
            bowed[after, a] += turned
            bowed[k, a] -= turned
