"""Four numbers that one vector instruction treats alike, as one number of compiled code: the only vector code by hand.

Numba has no such type, and LLVM finds no vector instructions by itself in loops over three to twenty numbers: the
elimination of a body's modes takes 2.2 to 2.8 times as long in plain loops. The functions on tuples (`tuples.py`,
`matrices.py` of the kernels) take lanes in place of numbers. Each function here has two forms: LLVM's instructions
(`lane_code`), and Python on arrays of four numbers, which holds where nothing is compiled; there an access beyond an
array is an error.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, update_wrapper
from typing import Any

import numpy as np

from modalprep.compiler.jit import compile_inline
from modalprep.compiler.sizes import WIDTH as WIDTH


class Instruction:
    """A function on lanes: Python here, instructions of LLVM in compiled code (`lane_code`)."""

    def __init__(self, function: Callable, places: tuple[int, ...] = ()) -> None:
        self.function, self.places = function, places
        update_wrapper(self, function)

    def __call__(self, *args: Any) -> Any:
        """Return what the function returns."""
        return self.function(*args)

    @cached_property
    def _numba_type_(self) -> Any:
        from modalprep.compiler.lane_code import type_of

        return type_of(self.function, self.places)


instruction: Any = Instruction  # the decorator of a function whose signature stays


class Lanes(np.ndarray):
    """Four numbers in Python, a value like a number: ``v += w`` leaves other names of v alone."""

    def __iadd__(self, other: Any) -> Any:
        return self + other


@instruction
def four(value):
    """Return four times the same number."""
    return np.full(4, value).view(Lanes)


@instruction
def lanes(a, b, c, d):
    """Return four numbers in one."""
    return np.array([a, b, c, d]).view(Lanes)


@instruction
def numbers(v):
    """Return four numbers as a tuple."""
    return tuple(v.tolist())


@instruction
def add_lanes(v):
    """Return the sum of four numbers."""
    return float(v.sum())


@instruction
def sum_lanes(a, b, c, d):
    """Return the sums of a, of b, of c and of d."""
    return np.sum((a, b, c, d), axis=1).view(Lanes)


@instruction
def transposed_lanes(a, b, c, d):
    """Return the first numbers of a, of b, of c and of d, then their second ones, and so on."""
    return tuple(row.view(Lanes) for row in np.array((a, b, c, d)).T.copy())


@instruction
def larger(a, b):
    """Return the larger of two numbers in each of four lanes."""
    return np.where(a > b, a, b).view(Lanes)


@instruction
def largest(v):
    """Return the largest of four numbers."""
    return float(v.max())


@instruction
def first_at_least(v, value):
    """Return which of four numbers is the first that is not less than a value; 64 if none is."""
    return int(np.argmax(v >= value)) if (v >= value).any() else 64


@instruction
def above(v, bounds, other):
    """Return four numbers, the other one in place of those that are not larger than their bounds."""
    return np.where(v > bounds, v, other).view(Lanes)


@instruction
def with_lane(v, k, value):
    """Return four numbers, a value in place of number k; all as they are where there is none."""
    return np.where(np.arange(4) == k, value, v).view(Lanes)


def arrangement(*places: int) -> Callable:
    """Return the function that arranges four numbers anew: those at these places, a zero for 4."""

    def arranged(v):
        return np.append(v, 0.0)[list(places)].view(Lanes)

    return Instruction(arranged, places)


@instruction
def get_lanes(a, i):
    """Four numbers ``a[i:i + 4]``."""
    return np.array(np.reshape(a[i : i + 4], 4)).view(Lanes)


@instruction
def put_lanes(a, i, v):
    """Write four numbers to ``a[i:i + 4]``."""
    a[i : i + 4] = np.reshape(v, 4)


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
def get_lane6(a, k):
    """A spatial vector of numbers: lane k of `get_lanes6`."""
    return a[k], a[4 + k], a[8 + k], a[12 + k], a[16 + k], a[20 + k]


_last_three = arrangement(1, 2, 3, 3)


@instruction
def _after_third(u, v):
    """Return the third number of u, then the first three of v."""
    return np.concatenate([u[2:3], v[:3]]).view(Lanes)


@compile_inline
def get_rows9(a):
    """The rows of a matrix ``a[:9]``, each in the first three of four numbers."""
    return get_lanes(a, 0), get_lanes(a, 3), _last_three(get_lanes(a, 5))


@compile_inline
def put_rows9(a, rows):
    """Write the rows of a matrix, each in the first three of four numbers, to ``a[:9]``."""
    put_lanes(a, 0, rows[0])
    put_lanes(a, 3, rows[1])
    put_lanes(a, 5, _after_third(rows[1], rows[2]))
