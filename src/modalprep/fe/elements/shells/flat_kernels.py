"""Compiled loops over flat shells: strain rows, stiffness, and samples of the mass (theory 7.3, 7.4).

The strains of `flat_strains` are per DOF in the element's axes. A node at the height z under the mid-surface moves it
by ``u + z t x e3``; axes are rotated last. Arrays only.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.compiler.jit import compile_allocating, compile_inline
from modalprep.fe.elements.shells.flat_strains import Moduli, Sides, Strains, compatible, measure_sides, set_map


class Geometry(NamedTuple):
    """Flat cells: ``xy (ne, n, 2)`` in the plane, axes ``frame (ne, 3, 3)`` by rows, ``height (ne, n)``, m."""

    xy: np.ndarray
    frame: np.ndarray
    height: np.ndarray


@compile_allocating
def _sides(n):
    return Sides(np.empty(n), np.empty((n, 2)), np.empty(n), np.empty(n))


@compile_allocating
def _strains(nq, moduli, n):
    return Strains(np.empty((nq, moduli.plane.shape[1], 3 * n)), np.empty((nq, 5, 3 * n)), np.empty(nq))


@compile_allocating
def _moduli_of(moduli, e):
    k = e if len(moduli.plane) > 1 else 0
    return Moduli(moduli.plane[k], moduli.bend[k], moduli.coupling[k])


@compile_inline
def _internal_slopes(x, rule, q, dx, slope):
    """Gradients ``(2, 2)`` of QM6's internal shapes, mapped by the Jacobian of the centre (row: shape)."""
    a = (x[1, 0] + x[2, 0] - x[0, 0] - x[3, 0]) / 2
    b = (x[2, 0] + x[3, 0] - x[0, 0] - x[1, 0]) / 2
    c = (x[1, 1] + x[2, 1] - x[0, 1] - x[3, 1]) / 2
    d = (x[2, 1] + x[3, 1] - x[0, 1] - x[1, 1]) / 2
    scale = rule.weight[q] / dx  # times the inverse of the Jacobian and its determinant
    X = scale * (4 - 8 * (rule.N[q, 1] + rule.N[q, 2]))
    Y = scale * (4 - 8 * (rule.N[q, 2] + rule.N[q, 3]))
    slope[0, 0] = X * d
    slope[0, 1] = -X * b
    slope[1, 0] = -Y * c
    slope[1, 1] = Y * a


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
def _condense(x, C, rule, points, inner, mixed):
    """Set QM6's internal displacements ``inner (4, 6n)`` per ``u, v, tz`` and then ``w, tx, ty`` of the nodes.

    ``mixed (4, 6n)`` is the stiffness between internal and nodal displacements.
    """
    slope = np.empty((2, 2))
    own = np.zeros((4, 3))
    K = np.zeros((4, 4))
    m = points.plane.shape[2]
    mixed[:] = 0.0
    for q in range(len(points.dx)):
        _internal_slopes(x, rule, q, points.dx[q], slope)
        for k in range(2):
            own[2 * k, 0] = own[2 * k + 1, 2] = slope[k, 0]
            own[2 * k + 1, 1] = own[2 * k, 2] = slope[k, 1]
        for p in range(4):
            for t in range(3):
                force = moment = 0.0
                for s in range(3):
                    force += points.dx[q] * own[p, s] * C.plane[s, t]
                    moment += points.dx[q] * own[p, s] * C.coupling[s, t]
                for r in range(4):
                    K[p, r] += force * own[r, t]
                for j in range(m):
                    mixed[p, j] += force * points.plane[q, t, j]
                if moment != 0.0:
                    for j in range(m):
                        mixed[p, m + j] += moment * points.bend[q, t, j]
    for p in range(4):
        for j in range(2 * m):
            inner[p, j] = -mixed[p, j]
    _solve(K, inner)


@compile_inline
def _add_bend(local, R, row):
    """Add what a row per ``w, tx, ty`` of the nodes is per nodal DOF in mesh axes."""
    for i in range(len(local) // 3):
        for c in range(3):
            row[6 * i + c] += local[3 * i] * R[2, c]
            row[6 * i + 3 + c] += local[3 * i + 1] * R[0, c] + local[3 * i + 2] * R[1, c]


@compile_inline
def _add_plane(local, R, z, row):
    """Add what a row per ``u, v, tz`` of the nodes is per nodal DOF in mesh axes."""
    for i in range(len(z)):
        u = local[3 * i]
        v = local[3 * i + 1]
        t = local[3 * i + 2]
        for c in range(3):
            row[6 * i + c] += u * R[0, c] + v * R[1, c]
            row[6 * i + 3 + c] += z[i] * (u * R[1, c] - v * R[0, c]) + t * R[2, c]


@compile_allocating
def _add_internal(x, rule, inner, R, points, B):
    """Add the strains of the internal displacements: per ``u, v, tz`` to `points`, per ``w, tx, ty`` to the rows B."""
    slope = np.empty((2, 2))
    m = points.plane.shape[2]
    row = np.empty((3, m))
    for q in range(len(points.dx)):
        _internal_slopes(x, rule, q, points.dx[q], slope)
        row[:] = 0.0
        for k in range(2):
            for j in range(m):
                along = inner[2 * k, j]
                across = inner[2 * k + 1, j]
                points.plane[q, 0, j] += slope[k, 0] * along
                points.plane[q, 1, j] += slope[k, 1] * across
                points.plane[q, 2, j] += slope[k, 1] * along + slope[k, 0] * across
                along = inner[2 * k, m + j]
                across = inner[2 * k + 1, m + j]
                row[0, j] += slope[k, 0] * along
                row[1, j] += slope[k, 1] * across
                row[2, j] += slope[k, 1] * along + slope[k, 0] * across
        for s in range(3):
            _add_bend(row[s], R, B[q, s])


@compile_allocating
def strain_rows(lo, hi, cells, moduli, optimal, own, rule, B, dx):
    """Strain rows ``B (ne, nq, ns, 6n)`` per nodal DOF in mesh axes and measure ``dx (ne, nq)`` at points of `rule`.

    Rows as in `shell.ShellBlock.strain`. The internal displacements of quads are condensed at the points of `own`.
    """
    n = cells.xy.shape[1]
    sides = _sides(n)
    inner = np.empty((4, 6 * n))
    mixed = np.empty((4, 6 * n))
    there = _strains(len(own.weight), moduli, n)
    points = _strains(len(rule.weight), moduli, n)
    for e in range(lo, hi):
        x = cells.xy[e]
        R = cells.frame[e]
        z = cells.height[e]
        C = _moduli_of(moduli, e)
        measure_sides(x, C.bend, sides)
        compatible(x, optimal, rule, sides, points)
        B[e] = 0.0
        dx[e] = points.dx
        if n == 4:
            compatible(x, optimal, own, sides, there)
            _condense(x, C, own, there, inner, mixed)
            _add_internal(x, rule, inner, R, points, B[e])
        for q in range(len(points.dx)):
            for s in range(points.plane.shape[1]):
                _add_plane(points.plane[q, s], R, z, B[e, q, s if s < 3 else s + 5])
            for s in range(5):
                _add_bend(points.bend[q, s], R, B[e, q, 3 + s])


@compile_allocating
def _set_square(rows, C, dx, weighted, K):
    """Set ``K = sum_q dx B^T C B`` of the rows ``B (nq, ns, m)``; `weighted` is overwritten by ``dx C B``."""
    nq, ns, m = rows.shape
    weighted[:] = 0.0
    for q in range(nq):
        for s in range(ns):
            for t in range(ns):
                c = dx[q] * C[s, t]
                if c != 0.0:
                    for j in range(m):
                        weighted[q, s, j] += c * rows[q, t, j]
    np.dot(rows.reshape(nq * ns, m).T, weighted.reshape(nq * ns, m), K)


@compile_inline
def _add_product(left, C, right, dx, K):
    """Add ``dx A^T C B`` of the first three rows A and B to K."""
    for s in range(3):
        for t in range(3):
            c = dx * C[s, t]
            if c != 0.0:
                for i in range(left.shape[1]):
                    for j in range(right.shape[1]):
                        K[i, j] += c * left[s, i] * right[t, j]


@compile_allocating
def _add_condensed(mixed, inner, P, D, X):
    """Add the stiffness that the internal displacements take off."""
    m = len(P)
    for p in range(4):
        for i in range(m):
            for j in range(i + 1):
                P[i, j] += mixed[p, i] * inner[p, j]
            moment = mixed[p, m + i]
            if moment != 0.0:
                for j in range(i + 1):
                    D[i, j] += moment * inner[p, m + j]
                for j in range(m):
                    X[j, i] += inner[p, j] * moment


@compile_allocating
def _to_nodes(P, D, X, R, z, K):
    """Set ``K (6n, 6n)`` per nodal DOF in mesh axes from its parts per ``u, v, tz`` and ``w, tx, ty`` of the nodes."""
    k, half = np.empty((6, 6)), np.empty((6, 6))
    plane, bend = (0, 1, 5), (2, 3, 4)
    for i in range(len(z)):
        for j in range(i + 1):
            for a in range(3):
                for b in range(3):
                    p, q = 3 * i + a, 3 * j + b
                    k[plane[a], plane[b]] = P[max(p, q), min(p, q)]
                    k[bend[a], bend[b]] = D[max(p, q), min(p, q)]
                    k[plane[a], bend[b]] = X[p, q]
                    k[bend[a], plane[b]] = X[q, p]
            for a in range(6):
                k[4, a] += z[i] * k[0, a]
                k[3, a] -= z[i] * k[1, a]
            for a in range(6):
                k[a, 4] += z[j] * k[a, 0]
                k[a, 3] -= z[j] * k[a, 1]
            for a in range(6):
                for b in range(3):
                    half[a, b] = k[a, 0] * R[0, b] + k[a, 1] * R[1, b] + k[a, 2] * R[2, b]
                    half[a, 3 + b] = k[a, 3] * R[0, b] + k[a, 4] * R[1, b] + k[a, 5] * R[2, b]
            for a in range(3):
                for b in range(6):
                    u = R[0, a] * half[0, b] + R[1, a] * half[1, b] + R[2, a] * half[2, b]
                    t = R[0, a] * half[3, b] + R[1, a] * half[4, b] + R[2, a] * half[5, b]
                    K[6 * i + a, 6 * j + b], K[6 * i + 3 + a, 6 * j + b] = u, t
            for a in range(6):
                for b in range(a if i == j else 6):
                    K[6 * j + b, 6 * i + a] = K[6 * i + a, 6 * j + b]


@compile_allocating
def stiffness(lo, hi, cells, moduli, optimal, rule, K):
    """Elastic stiffness ``K (ne, 6n, 6n)`` per nodal DOF in mesh axes, exactly symmetric."""
    n = cells.xy.shape[1]
    sides = _sides(n)
    points = _strains(len(rule.weight), moduli, n)
    weighted = _strains(len(rule.weight), moduli, n)
    inner, mixed = np.empty((4, 6 * n)), np.empty((4, 6 * n))
    P = np.empty((3 * n, 3 * n))
    D = np.empty((3 * n, 3 * n))
    X = np.empty((3 * n, 3 * n))
    for e in range(lo, hi):
        x = cells.xy[e]
        C = _moduli_of(moduli, e)
        measure_sides(x, C.bend, sides)
        compatible(x, optimal, rule, sides, points)
        _set_square(points.plane, C.plane, points.dx, weighted.plane, P)
        _set_square(points.bend, C.bend, points.dx, weighted.bend, D)
        X[:] = 0.0
        for q in range(len(points.dx)):
            _add_product(points.plane[q], C.coupling, points.bend[q], points.dx[q], X)
        if n == 4:
            _condense(x, C, rule, points, inner, mixed)
            _add_condensed(mixed, inner, P, D, X)
        _to_nodes(P, D, X, cells.frame[e], cells.height[e], K[e])


@compile_inline
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


@compile_inline
def _set_lever(height, normal, bowed, N, values):
    """Set the functions of a node: ``N u``, ``t x normal`` times the height, and ``bowed . t`` along the normal."""
    for a in range(3):
        b, c = (a + 1) % 3, (a + 2) % 3
        values[3 * a + a] = normal[a] * bowed[a]
        values[3 * a + b] = normal[a] * bowed[b] + height * normal[c]
        values[3 * a + c] = normal[a] * bowed[c] - height * normal[b]
    values[9] = N


@compile_allocating
def mass_samples(lo, hi, cells, middle, lift, surface, sheet, dx, position, values):
    """Samples of the mass at the points of `surface`, then those of the thickness at the points of `sheet`.

    ``middle (ne, 3)`` is the point of the mid-surface over the mean of the nodes, `lift` the height of the mass over
    the mid-surface, m. Sets ``dx (ne, ns)``, ``position (ne, ns, 3)``, the normal for the thickness, and
    ``values (ne, ns, nn, 10)`` as in `mass.NodalFunctions`: of the displacement of the mass, and of its change per
    height.
    """
    n = cells.xy.shape[1]
    count = len(surface.weight)
    inverse = np.empty((2, 2))
    bowed = np.empty((4, 3))
    for e in range(lo, hi):
        x, R, z = cells.xy[e], cells.frame[e], cells.height[e]
        for q in range(count):
            dx[e, q] = set_map(x, surface.dN, surface.weight, q, inverse)
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
            dx[e, count + q] = set_map(x, sheet.dN, sheet.weight, q, inverse)
            for c in range(3):
                position[e, count + q, c] = R[2, c]
            for i in range(n):
                _set_lever(sheet.N[q, i], R[2], bowed[i], 0.0, values[e, count + q, i])
