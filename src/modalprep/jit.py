"""One way to compile kernels: cached between runs, also where no cache folder can be written."""

from __future__ import annotations

from collections.abc import Callable

from numba import njit

# no flag that assumes finite numbers: a NaN must stay a NaN
FAST = {"contract", "reassoc", "nsz", "arcp"}


def compile_kernel(function: Callable) -> Callable:
    """Return ``njit(cache=True)`` of the function; without a writable cache it compiles in every process."""
    try:
        return njit(cache=True, fastmath=FAST, error_model="numpy", nogil=True)(function)
    except RuntimeError:  # numba: "no locator available"
        return njit(cache=False, fastmath=FAST, error_model="numpy", nogil=True)(function)
