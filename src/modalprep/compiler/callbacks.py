"""Compiled loops that ask Python: a function pointer, called from compiled code by its address."""

from __future__ import annotations

import ctypes
from collections.abc import Callable

import numpy as np

SIGNATURE = ctypes.CFUNCTYPE(None, ctypes.c_double)


class Pointer:
    """A Python function ``f(t)`` with an address; what it raises is kept, and `raised` (1,) set to one.

    Attributes
    ----------
    address : int
    error : BaseException or None
        The first exception; later calls do nothing.

    Examples
    --------
    >>> seen = []
    >>> pointer = Pointer(seen.append, np.zeros(1))
    >>> call_address(pointer.address, 2.5)
    >>> seen
    [2.5]
    """

    def __init__(self, function: Callable[[float], None], raised: np.ndarray) -> None:
        self.function, self.raised = function, raised
        self.error: BaseException | None = None
        self.pointer = SIGNATURE(self._call)
        self.address = ctypes.cast(self.pointer, ctypes.c_void_p).value

    def _call(self, t: float) -> None:
        if self.error is None:
            try:
                self.function(t)
            except BaseException as error:
                self.error = error
                self.raised[0] = 1.0


def call_address(address: int, t: float) -> None:
    """Call the function ``f(t)`` at an address, from Python or from compiled code."""
    SIGNATURE(int(address))(t)  # as Python reads it from an array
