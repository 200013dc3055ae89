"""Four numbers that one vector instruction treats alike, as a number of compiled code: one for each of four rows.

Numba has no such type, and does not find the vector instructions by itself where there are three or four numbers. The
functions on tuples (tuples.py, matrices.py) take lanes in place of numbers.
"""

from __future__ import annotations

from numba.core import config

from modalprep.compiler.jit import compile_inline

if config.DISABLE_JIT:
    from modalprep.multibody.kernels.algebra import plain_lanes as instructions
else:
    from modalprep.multibody.kernels.algebra import vector_instructions as instructions

WIDTH = 4


@compile_inline
def add_lanes(v):
    """Return the sum of four numbers."""
    return instructions.total(v)


@compile_inline
def numbers(v):
    """Return four numbers as a tuple."""
    return instructions.numbers(v)


@compile_inline
def sum_lanes(a, b, c, d):
    """Return the sums of a, of b, of c and of d."""
    return instructions.sums(a, b, c, d)


@compile_inline
def transposed(a, b, c, d):
    """Return the first numbers of a, b, c, d, then their second ones, and so on."""
    return instructions.transpose(a, b, c, d)


@compile_inline
def larger(a, b):
    """Return the larger of two numbers in each of four lanes."""
    return instructions.larger(a, b)


@compile_inline
def largest(v):
    """Return the largest of four numbers."""
    return instructions.largest(v)


@compile_inline
def first_at_least(v, value):
    """Return which of four numbers is the first that is not less than a value; beyond them if none is."""
    return instructions.first_at_least(v, value)


@compile_inline
def above(v, bounds, other):
    """Return four numbers, the other one in place of those that are not larger than their bounds."""
    return instructions.above(v, bounds, other)


@compile_inline
def with_lane(v, k, value):
    """Return four numbers, a value in place of number k; all as they are where there is none."""
    return instructions.with_lane(v, k, value)


@compile_inline
def four(value):
    """Return four times the same number."""
    return instructions.spread(value)


@compile_inline
def lanes(a, b, c, d):
    """Return four numbers in one."""
    return instructions.join(a, b, c, d)


@compile_inline
def get_lanes(a, i):
    """Four numbers ``a[i:i + 4]``."""
    return instructions.load(a, i)


@compile_inline
def put_lanes(a, i, v):
    """Write four numbers to ``a[i:i + 4]``."""
    instructions.store(a, i, v)


@compile_inline
def get_lanes3(a, i):
    """A vector of lanes: ``a[i:i + 12]``."""
    return get_lanes(a, i), get_lanes(a, i + 4), get_lanes(a, i + 8)


@compile_inline
def put_lanes3(a, i, v):
    """Write a vector of lanes to ``a[i:i + 12]``."""
    put_lanes(a, i, v[0])
    put_lanes(a, i + 4, v[1])
    put_lanes(a, i + 8, v[2])


@compile_inline
def get_lanes6(a):
    """A spatial vector of lanes: ``a[:24]``."""
    f, t = get_lanes3(a, 0), get_lanes3(a, 12)
    return f[0], f[1], f[2], t[0], t[1], t[2]


@compile_inline
def put_lanes6(a, v):
    """Write a spatial vector of lanes to ``a[:24]``."""
    put_lanes3(a, 0, (v[0], v[1], v[2]))
    put_lanes3(a, 12, (v[3], v[4], v[5]))


@compile_inline
def get_rows9(a):
    """The rows of a matrix ``a[:9]``, each in the first three of four numbers."""
    return get_lanes(a, 0), get_lanes(a, 3), instructions.earlier(get_lanes(a, 5))


@compile_inline
def put_rows9(a, rows):
    """Write the rows of a matrix, each in the first three of four numbers, to ``a[:9]``."""
    put_lanes(a, 0, rows[0])
    put_lanes(a, 3, rows[1])
    put_lanes(a, 5, instructions.after_third(rows[1], rows[2]))


@compile_inline
def get_lane6(a, k):
    """A spatial vector of numbers: lane k of `get_lanes6`."""
    return a[k], a[4 + k], a[8 + k], a[12 + k], a[16 + k], a[20 + k]
