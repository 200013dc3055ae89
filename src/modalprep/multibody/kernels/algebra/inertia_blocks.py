"""Spatial inertias by axes: a symmetric (3, 3) of blocks, each of which vector instructions treat as one number.

The block of axes i and j is ``[[M_ij, H_ij], [H_ji, J_ij]]`` of the inertia [[M, H], [H^T, J]], by rows, in lanes; that
of j and i is its transpose. An inertia is a tuple of six blocks (xx, xy, xz, yy, yz, zz).
"""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline
from modalprep.compiler.lanes import arrangement, lanes, numbers
from modalprep.multibody.kernels.algebra.matrices import product, symmetric_product, times
from modalprep.multibody.kernels.algebra.tuples import add3, cross, put6, put9, sub3

flipped = arrangement(0, 2, 1, 3)  # the transposed block
first_column = arrangement(0, 2, 0, 2)  # twice
second_column = arrangement(1, 3, 1, 3)
by_rows = arrangement(0, 0, 1, 1)  # from a column, twice: a block of equal columns
linear_column_as_angular = arrangement(4, 0, 4, 2)
linear_row_as_angular = arrangement(4, 4, 0, 1)


@compile_inline
def blocks(M, H, J):
    """Return an inertia by axes."""
    return (
        lanes(M[0], H[0], H[0], J[0]),
        lanes(M[1], H[1], H[3], J[1]),
        lanes(M[2], H[2], H[6], J[2]),
        lanes(M[3], H[4], H[4], J[3]),
        lanes(M[4], H[5], H[7], J[4]),
        lanes(M[5], H[8], H[8], J[5]),
    )


@compile_inline
def parts(B):
    """Return M, H and J of an inertia."""
    a = numbers(B[0])
    b = numbers(B[1])
    c = numbers(B[2])
    d = numbers(B[3])
    e = numbers(B[4])
    f = numbers(B[5])
    H = (a[1], b[1], c[1], b[2], d[1], e[1], c[2], e[2], f[1])
    return (a[0], b[0], c[0], d[0], e[0], f[0]), H, (a[3], b[3], c[3], d[3], e[3], f[3])


@compile_inline
def put_parts(own, B):
    """Write M, H and J of an inertia to a link's record of the data."""
    M, H, J = parts(B)
    put6(own.M, M)
    put9(own.H, H)
    put6(own.J, J)


@compile_inline
def all_blocks(B):
    """Return the nine blocks of an inertia."""
    return B[0], B[1], B[2], flipped(B[1]), B[3], B[4], flipped(B[2]), flipped(B[4]), B[5]


@compile_inline
def rotated(R, B):
    """Return an inertia in axes turned by R."""
    return symmetric_product(product(R, all_blocks(B)), R)


@compile_inline
def column_parts(v):
    """Return force and torque of a column by axes, each (linear, angular) twice."""
    fx, tx, _, _ = numbers(v[0])
    fy, ty, _, _ = numbers(v[1])
    fz, tz, _, _ = numbers(v[2])
    return (fx, fy, fz), (tx, ty, tz)


@compile_inline
def blocks_times(B, v):
    """Inertia times a spatial vector."""
    x = lanes(v[0], v[3], v[0], v[3])
    y = lanes(v[1], v[4], v[1], v[4])
    z = lanes(v[2], v[5], v[2], v[5])
    a, b, c = times(all_blocks(B), (x, y, z))
    a, b, c = numbers(a), numbers(b), numbers(c)
    return a[0] + a[1], b[0] + b[1], c[0] + c[1], a[2] + a[3], b[2] + b[3], c[2] + c[3]


@compile_inline
def less_outer_blocks(B, g, v):
    """Return ``B - g v v^T``; v by axes, each (linear, angular) twice."""
    x, y, z = g * by_rows(v[0]), g * by_rows(v[1]), g * by_rows(v[2])
    return (
        B[0] - x * v[0],
        B[1] - x * v[1],
        B[2] - x * v[2],
        B[3] - y * v[1],
        B[4] - y * v[2],
        B[5] - z * v[2],
    )


@compile_inline
def shifted(B, r):
    """Return ``T^T B T`` with ``T = [[1, -r~], [0, 1]]``."""
    a, b, c, d, e, f, g, h, k = all_blocks(B)
    x, y, z = _columns(a, b, c, r), _columns(d, e, f, r), _columns(g, h, k, r)
    first = (x[0], y[0], z[0])
    second = (x[1], y[1], z[1])
    third = (x[2], y[2], z[2])
    p, q, s = _rows(first, r), _rows(second, r), _rows(third, r)
    return p[0], q[0], s[0], q[1], s[1], s[2]


@compile_inline
def _columns(a, b, c, r):
    """Add to the angular columns of a row of blocks its linear columns times -r~."""
    linear = linear_column_as_angular(a), linear_column_as_angular(b), linear_column_as_angular(c)
    return sub3((a, b, c), cross(linear, r))


@compile_inline
def _rows(v, r):
    """Add to the angular rows of a column of blocks r~ times its linear rows."""
    linear = linear_row_as_angular(v[0]), linear_row_as_angular(v[1]), linear_row_as_angular(v[2])
    return add3(v, cross(r, linear))
