"""Rows of numbers of all modes of a body, four modes at a time.

A component of all modes is a row of N numbers, filled up with zeros to a multiple of four; rows stand one after the
other: the number of component c and mode a at ``c N + a``. `b` is the first of four modes, or its place in a later row.
"""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline
from modalprep.multibody.kernels.algebra.lanes import (
    WIDTH,
    four,
    get_lanes,
    numbers,
    put_lanes,
    sum_lanes,
    transposed,
)
from modalprep.multibody.kernels.algebra.tuples import axpy3, axpy6, axpy9


@compile_inline
def rows3(x, b, N):
    """Three rows from b on."""
    return get_lanes(x, b), get_lanes(x, b + N), get_lanes(x, b + 2 * N)


@compile_inline
def rows6(x, b, N):
    """Six rows from b on."""
    u = rows3(x, b, N)
    v = rows3(x, b + 3 * N, N)
    return u[0], u[1], u[2], v[0], v[1], v[2]


@compile_inline
def rows9(x, b, N):
    """Nine rows from b on."""
    u = rows6(x, b, N)
    v = rows3(x, b + 6 * N, N)
    return u[0], u[1], u[2], u[3], u[4], u[5], v[0], v[1], v[2]


@compile_inline
def rows12(x, b, N):
    """Twelve rows from b on."""
    u = rows6(x, b, N)
    v = rows6(x, b + 6 * N, N)
    return u[0], u[1], u[2], u[3], u[4], u[5], v[0], v[1], v[2], v[3], v[4], v[5]


@compile_inline
def mode6(x, a, N):
    """Six numbers of mode a."""
    return x[a], x[N + a], x[2 * N + a], x[3 * N + a], x[4 * N + a], x[5 * N + a]


@compile_inline
def mode12(x, a, N):
    """Twelve numbers of mode a."""
    u = mode6(x, a, N)
    v = mode6(x, a + 6 * N, N)
    return u[0], u[1], u[2], u[3], u[4], u[5], v[0], v[1], v[2], v[3], v[4], v[5]


@compile_inline
def put_rows3(x, b, N, v):
    """Write three rows from b on."""
    put_lanes(x, b, v[0])
    put_lanes(x, b + N, v[1])
    put_lanes(x, b + 2 * N, v[2])


@compile_inline
def put_rows6(x, b, N, v):
    """Write six rows from b on."""
    put_rows3(x, b, N, (v[0], v[1], v[2]))
    put_rows3(x, b + 3 * N, N, (v[3], v[4], v[5]))


@compile_inline
def zero6():
    """Six times four zeros."""
    z = four(0.0)
    return z, z, z, z, z, z


@compile_inline
def combined3(table, f, n, b, N):
    """Return ``sum_j f_j table[j]`` of three rows from b on."""
    z = four(0.0)
    total = (z, z, z)
    for j in range(n):
        total = axpy3(total, f[j], rows3(table[j], b, N))
    return total


@compile_inline
def twice_combined6(table, f, g, n, b, N):
    """Return ``sum_j f_j table[j]`` and ``sum_j g_j table[j]`` of six rows from b on."""
    first, second = zero6(), zero6()
    for j in range(n):
        row = rows6(table[j], b, N)
        first, second = axpy6(first, f[j], row), axpy6(second, g[j], row)
    return first, second


@compile_inline
def combined9(table, f, n, b, N):
    """Return ``sum_j f_j table[j]`` of nine rows from b on."""
    z = four(0.0)
    total = (z, z, z, z, z, z, z, z, z)
    for j in range(n):
        total = axpy9(total, f[j], rows9(table[j], b, N))
    return total


@compile_inline
def dots4(x, first, N, f, n):
    """Products of f (n,) with four rows, the first of which begins at `first`."""
    z = four(0.0)
    s, t, u, v = z, z, z, z
    for b in range(0, n, WIDTH):
        g = get_lanes(f, b)
        at = first + b
        s = s + g * get_lanes(x, at)
        t = t + g * get_lanes(x, at + N)
        u, v = u + g * get_lanes(x, at + 2 * N), v + g * get_lanes(x, at + 3 * N)
    return sum_lanes(s, t, u, v)


@compile_inline
def dots6(x, N, f, n):
    """Products of f (n,) with six rows, as a tuple of numbers."""
    u = numbers(dots4(x, 0, N, f, n))
    v = numbers(dots4(x, 2 * N, N, f, n))
    return u[0], u[1], u[2], u[3], v[2], v[3]


@compile_inline
def dots9(x, N, f, n):
    """Products of f (n,) with nine rows, of twelve that are there, as a tuple of numbers."""
    u = numbers(dots4(x, 0, N, f, n))
    v = numbers(dots4(x, 4 * N, N, f, n))
    w = numbers(dots4(x, 8 * N, N, f, n))
    return u[0], u[1], u[2], u[3], v[0], v[1], v[2], v[3], w[0]


@compile_inline
def sums6(v):
    """Sums over the modes of six rows, as a tuple of numbers."""
    z = four(0.0)
    a = numbers(sum_lanes(v[0], v[1], v[2], v[3]))
    b = numbers(sum_lanes(v[4], v[5], z, z))
    return a[0], a[1], a[2], a[3], b[0], b[1]


@compile_inline
def sums9(v):
    """Sums over the modes of nine rows, as a tuple of numbers."""
    z = four(0.0)
    a = numbers(sum_lanes(v[0], v[1], v[2], v[3]))
    b = numbers(sum_lanes(v[4], v[5], v[6], v[7]))
    c = numbers(sum_lanes(v[8], z, z, z))
    return a[0], a[1], a[2], a[3], b[0], b[1], b[2], b[3], c[0]


@compile_inline
def heads(Z, b):
    """Eight numbers at the begin of each of four rows of Z, by component."""
    u = transposed(get_lanes(Z[b], 0), get_lanes(Z[b + 1], 0), get_lanes(Z[b + 2], 0), get_lanes(Z[b + 3], 0))
    v = transposed(get_lanes(Z[b], 4), get_lanes(Z[b + 1], 4), get_lanes(Z[b + 2], 4), get_lanes(Z[b + 3], 4))
    return u[0], u[1], u[2], u[3], v[0], v[1], v[2], v[3]


@compile_inline
def put_heads(Z, b, v):
    """Write eight numbers at the begin of each of four rows of Z, by component."""
    x, y = transposed(v[0], v[1], v[2], v[3]), transposed(v[4], v[5], v[6], v[7])
    _put8(Z[b], x[0], y[0])
    _put8(Z[b + 1], x[1], y[1])
    _put8(Z[b + 2], x[2], y[2])
    _put8(Z[b + 3], x[3], y[3])


@compile_inline
def _put8(row, x, y):
    put_lanes(row, 0, x)
    put_lanes(row, 4, y)


@compile_inline
def add_heads(Z, b, v):
    """Add eight numbers at the begin of each of four rows of Z, by component."""
    x, y = transposed(v[0], v[1], v[2], v[3]), transposed(v[4], v[5], v[6], v[7])
    add8(Z[b], 1.0, x[0], y[0])
    add8(Z[b + 1], 1.0, x[1], y[1])
    add8(Z[b + 2], 1.0, x[2], y[2])
    add8(Z[b + 3], 1.0, x[3], y[3])


@compile_inline
def add8(row, f, x, y):
    """Add ``f (x, y)`` at the begin of a row."""
    put_lanes(row, 0, get_lanes(row, 0) + f * x)
    put_lanes(row, 4, get_lanes(row, 4) + f * y)
