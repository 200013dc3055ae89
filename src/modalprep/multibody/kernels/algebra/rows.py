"""Rows of numbers of all modes of a body, four modes at a time.

``x[c, a]`` is component c of mode a; a row has N numbers, filled up with zeros to a multiple of four. `b` is the first
of four modes.
"""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline
from modalprep.compiler.lanes import (
    WIDTH,
    four,
    get_lanes,
    numbers,
    put_lanes,
    sum_lanes,
)
from modalprep.multibody.kernels.algebra.tuples import axpy3, axpy6, axpy9, take3


@compile_inline
def rows3(x, c, b):
    """Three rows from c on."""
    return get_lanes(x[c], b), get_lanes(x[c + 1], b), get_lanes(x[c + 2], b)


@compile_inline
def rows6(x, c, b):
    """Six rows from c on."""
    u = rows3(x, c, b)
    v = rows3(x, c + 3, b)
    return u[0], u[1], u[2], v[0], v[1], v[2]


@compile_inline
def rows9(x, b):
    """Nine rows."""
    u = rows6(x, 0, b)
    v = rows3(x, 6, b)
    return u[0], u[1], u[2], u[3], u[4], u[5], v[0], v[1], v[2]


@compile_inline
def vectors(x):
    """Twelve numbers as four vectors."""
    return take3(x, 0), take3(x, 3), take3(x, 6), take3(x, 9)


@compile_inline
def row_vectors(x, b):
    """Twelve rows as four vectors."""
    return rows3(x, 0, b), rows3(x, 3, b), rows3(x, 6, b), rows3(x, 9, b)


@compile_inline
def mode6(x, a):
    """Six numbers of mode a."""
    return x[0, a], x[1, a], x[2, a], x[3, a], x[4, a], x[5, a]


@compile_inline
def put_rows3(x, c, b, v):
    """Write three rows from c on."""
    put_lanes(x[c], b, v[0])
    put_lanes(x[c + 1], b, v[1])
    put_lanes(x[c + 2], b, v[2])


@compile_inline
def put_rows6(x, c, b, v):
    """Write six rows from c on."""
    put_rows3(x, c, b, (v[0], v[1], v[2]))
    put_rows3(x, c + 3, b, (v[3], v[4], v[5]))


@compile_inline
def zero6():
    """Six times four zeros."""
    z = four(0.0)
    return z, z, z, z, z, z


@compile_inline
def zero9():
    """Nine times four zeros."""
    z = four(0.0)
    return z, z, z, z, z, z, z, z, z


@compile_inline
def combined3(table, f, n, b):
    """Return ``sum_j f_j table[j]`` of three rows."""
    z = four(0.0)
    total = (z, z, z)
    for j in range(n):
        total = axpy3(total, f[j], rows3(table[j], 0, b))
    return total


@compile_inline
def twice_combined6(table, c, b, f, g, n):
    """Return ``sum_j f_j table[j]`` and ``sum_j g_j table[j]`` of six rows from c on."""
    first = zero6()
    second = zero6()
    for j in range(n):
        row = rows6(table[j], c, b)
        first = axpy6(first, f[j], row)
        second = axpy6(second, g[j], row)
    return first, second


@compile_inline
def combined9(table, f, n, b):
    """Return ``sum_j f_j table[j]`` of nine rows."""
    total = zero9()
    for j in range(n):
        total = axpy9(total, f[j], rows9(table[j], b))
    return total


@compile_inline
def dots4(x, c, f, n):
    """Products of f (n,) with four rows from c on."""
    z = four(0.0)
    s, t, u, v = z, z, z, z
    for b in range(0, n, WIDTH):
        g = get_lanes(f, b)
        s = s + g * get_lanes(x[c], b)
        t = t + g * get_lanes(x[c + 1], b)
        u = u + g * get_lanes(x[c + 2], b)
        v = v + g * get_lanes(x[c + 3], b)
    return sum_lanes(s, t, u, v)


@compile_inline
def dots6(x, f, n):
    """Products of f (n,) with six rows, as a tuple of numbers."""
    u = numbers(dots4(x, 0, f, n))
    v = numbers(dots4(x, 2, f, n))
    return u[0], u[1], u[2], u[3], v[2], v[3]


@compile_inline
def twice_dots6(x, f, g, n):
    """Products of f (n,) and of g (n,) with six rows, as two tuples of numbers."""
    first = zero6()
    second = zero6()
    for b in range(0, n, WIDTH):
        row = rows6(x, 0, b)
        first = axpy6(first, get_lanes(f, b), row)
        second = axpy6(second, get_lanes(g, b), row)
    a = numbers(sum_lanes(first[0], first[1], first[2], first[3]))
    c = numbers(sum_lanes(first[4], first[5], second[4], second[5]))
    d = numbers(sum_lanes(second[0], second[1], second[2], second[3]))
    return (a[0], a[1], a[2], a[3], c[0], c[1]), (d[0], d[1], d[2], d[3], c[2], c[3])


@compile_inline
def dots9(x, f, n):
    """Products of f (n,) with nine rows, of twelve that are there, as a tuple of numbers."""
    u = numbers(dots4(x, 0, f, n))
    v = numbers(dots4(x, 4, f, n))
    w = numbers(dots4(x, 8, f, n))
    return u[0], u[1], u[2], u[3], v[0], v[1], v[2], v[3], w[0]


@compile_inline
def put_dots12(x, f, n, out):
    """Write the products of f (n,) with twelve rows to ``out (12,)``."""
    put_lanes(out, 0, dots4(x, 0, f, n))
    put_lanes(out, 4, dots4(x, 4, f, n))
    put_lanes(out, 8, dots4(x, 8, f, n))


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
