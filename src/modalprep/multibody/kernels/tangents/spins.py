"""The operator of rotation vectors v that takes a rate of v to the angular velocity, and its derivatives by v.

    W(v) z = a z + b (v.z) v + c v x z

with factors that depend on ``v.v`` alone. `f` (12,) are a, b, c with three derivatives each by it. Vectors may be four
in one (lanes).
"""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline
from modalprep.multibody.kernels.algebra.tuples import add3, axpy3, combined, cross, dot3, scaled3

A, B, C = 0, 4, 8  # first factors


@compile_inline
def spin(f, order, v, z):
    """Return ``W z``, or a derivative of it by v.v, for one z or four."""
    return axpy3(combined(f[A + order], z, f[C + order], cross(v, z)), f[B + order] * dot3(v, z), v)


@compile_inline
def spin_transposed(f, order, v, z):
    """Return ``W' z``, or a derivative of it by v.v."""
    return axpy3(combined(f[A + order], z, -f[C + order], cross(v, z)), f[B + order] * dot3(v, z), v)


@compile_inline
def _straight(f, order, v, z, y):
    """Return what a change y of v does to ``W z`` where the factors, derivatives of some order, stay."""
    found = combined(f[B + order] * dot3(v, z), y, -f[C + order], cross(z, y))
    return add3(found, scaled3(f[B + order] * dot3(z, y), v))


@compile_inline
def spin_slope(f, order, v, z, y):
    """Return the derivative by v of ``W z``, or of a derivative of it by v.v, at a constant z, for a change y of v."""
    return add3(_straight(f, order, v, z, y), scaled3(2.0 * dot3(v, y), spin(f, order + 1, v, z)))


@compile_inline
def back_slope(f, v, T, y):
    """Return the derivative of ``W' T`` by v at a constant T, for a change y of v."""
    found = combined(f[B] * dot3(v, T), y, f[C], cross(T, y))
    found = add3(found, scaled3(2.0 * dot3(v, y), spin_transposed(f, 1, v, T)))
    return add3(found, scaled3(f[B] * dot3(T, y), v))


@compile_inline
def spin_curve(f, v, z, x, y):
    """Return the second derivative of ``W z`` by v, for changes x and y."""
    m, n = dot3(v, x), dot3(v, y)
    found = combined(f[B] * dot3(x, z), y, f[B] * dot3(y, z), x)
    found = add3(found, scaled3(2.0 * dot3(x, y), spin(f, 1, v, z)))
    found = add3(found, scaled3(2.0 * m, _straight(f, 1, v, z, y)))
    found = add3(found, scaled3(2.0 * n, _straight(f, 1, v, z, x)))
    return add3(found, scaled3(4.0 * m * n, spin(f, 2, v, z)))


@compile_inline
def spin_third(f, v, z, x, y):
    """Return the third derivative of ``W z`` by v, for x twice and y."""
    m, n, mixed, along = dot3(v, x), dot3(v, y), dot3(x, y), dot3(x, z)
    found = combined(4.0 * f[B + 1] * (m * dot3(y, z) + n * along), x, 4.0 * f[B + 1] * m * along, y)
    found = add3(found, scaled3(2.0 * dot3(x, x), spin_slope(f, 1, v, z, y)))
    found = add3(found, scaled3(4.0 * mixed, _straight(f, 1, v, z, x)))
    found = add3(found, scaled3(8.0 * m * mixed, spin(f, 2, v, z)))
    found = add3(found, scaled3(8.0 * m * n, _straight(f, 2, v, z, x)))
    return add3(found, scaled3(4.0 * m * m, spin_slope(f, 2, v, z, y)))
