"""oneMKL's library, which pypardiso finds."""

from __future__ import annotations

import os
from contextlib import suppress
from ctypes import CDLL, c_void_p
from functools import cache
from importlib.metadata import PackageNotFoundError, files
from pathlib import Path

import numpy as np

SYMMETRIC_INDEFINITE = -2  # its name of such matrices
REPRODUCIBLE = "AUTO"  # oneMKL's conditional numerical reproducibility: else its sums depend on where arrays lie
WAITING = "5"  # ms that idle threads of the library keep a core; its 200 keep loops of other threads waiting


def address(array: np.ndarray | None) -> c_void_p | None:
    """Return the address of an array, for the library.

    Examples
    --------
    >>> address(None) is None
    True
    """
    return None if array is None else c_void_p(array.ctypes.data)


@cache
def library() -> CDLL | None:
    """Return oneMKL's library where pypardiso and its wheel are installed, else None."""
    _remove_empty_registration()
    os.environ.setdefault("KMP_BLOCKTIME", WAITING)
    os.environ.setdefault("MKL_CBWR", REPRODUCIBLE)
    if path := _listed():
        os.environ.setdefault("PYPARDISO_MKL_RT", path)
    try:
        from pypardiso import PyPardisoSolver

        path = PyPardisoSolver(mtype=SYMMETRIC_INDEFINITE).libmkl._name
    except (ImportError, OSError):
        return None
    os.environ.setdefault("PYPARDISO_MKL_RT", path)
    return CDLL(path)


def installed_library() -> CDLL:
    """Return the library, for callers who have asked whether it is there."""
    mkl = library()
    assert mkl is not None
    return mkl


def _remove_empty_registration() -> None:
    """Remove the empty file that an ended process of the same number has left, for instance on a full disk.

    The OpenMP library of oneMKL registers itself in shared memory by the number of its process; it takes a file that
    is there for whole, and reading an empty one ends the process by a bus error.
    """
    left = Path(f"/dev/shm/__KMP_REGISTERED_LIB_{os.getpid()}_{getattr(os, 'getuid', int)()}")
    with suppress(OSError):
        if left.stat().st_size == 0:
            left.unlink()


def _listed() -> str | None:
    """Return the library's file by the list of its wheel; pypardiso would search the whole environment for it."""
    with suppress(PackageNotFoundError):
        for file in files("mkl") or ():
            if "mkl_rt" in file.name and (found := Path(file.locate())).is_file():
                return str(found.resolve())
    return None
