"""MUMPS: symmetric indefinite factorisation whose numbers lie in files, called by the thin layer of python-mumps.

Amestoy, Duff, L'Excellent, Koster, SIAM J. Matrix Anal. Appl. 23 (2001) 15; Agullo, Guermouche, L'Excellent, Parallel
Computing 34 (2008) 296, for the files.
"""

from __future__ import annotations

import os
import shutil
from ctypes import CDLL, RTLD_GLOBAL
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from tempfile import gettempdir
from threading import Lock
from typing import Any

import numpy as np

from modalprep.linalg.onemkl import library
from modalprep.linalg.pardiso import LackOfMemory
from modalprep.linalg.scratch import ScratchFolder

SYMMETRIC = 2  # its name of indefinite matrices
ANALYSE, FACTORISE, SOLVE = 1, 2, 3
SILENT, PERMUTE, SCALE, ROOM, ON_DISK, COLUMNS = 2, 6, 8, 14, 22, 27  # places in its options, counted from 1
NEGATIVE, ENTRIES, MEGABYTES = 12, 20, 27  # it reports: pivots, numbers of the factor, memory
WIDER = (20, 50, 150)  # per cent of room for exchanged pivots, one after the other
TOO_TIGHT = (-8, -9, -14, -17, -20)  # its errors: more room helps
LACKS = {
    -7: "needs more memory than the system gave",
    -13: "needs more memory than the system gave",
    -90: "could not be written to the disk or read (is it full?)",
}
ERRORS = {-6: "its pattern is singular", -10: "zero pivot"}
IN_MEMORY = ("tmpfs", "ramfs")
FOLDER = "MUMPS_OOC_TMPDIR"
HOW_TO_INSTALL = "apt-get install libmumps-seq-dev gcc, and pip install 'modalprep[mumps]' (conda: python-mumps)"
_calls = Lock()  # what MUMPS knows of its files it keeps once for the whole process


@cache
def module() -> Any:
    """Return python-mumps' thin layer, None where it is not installed.

    MUMPS' products are those of oneMKL where that is installed, several times faster than the reference BLAS.

    Examples
    --------
    >>> module() is module()
    True
    """
    if find_spec("mumps") is None:
        return None
    if (mkl := library()) is not None:
        CDLL(mkl._name, mode=RTLD_GLOBAL)
    try:
        return import_module("mumps._mumps")
    except ImportError:
        return None


class Mumps:
    """A symmetric matrix, analysed, and the files of its factor.

    Parameters
    ----------
    n : int
        Rows.
    rows, columns : (m,) int32
        Of the entries of one triangle, counted from 1.
    entries : (m,) float

    Attributes
    ----------
    operations, memory, disk : float
        Floating-point operations and bytes that the factor needs, by its pattern.

    Raises
    ------
    LackOfMemory
        Of memory or disk; its text follows "the factor of the matrix".
    RuntimeError
        When the matrix is singular.
    """

    def __init__(self, n: int, rows: np.ndarray, columns: np.ndarray, entries: np.ndarray) -> None:
        self._matrix = (rows, columns, entries)  # which the library does not copy
        _refuse_memory(gettempdir())
        self._instance: Any = module().dmumps(sym=SYMMETRIC)
        self._folder = ScratchFolder("modalprep-factor-")
        for option, value in ((SILENT, 0), (PERMUTE, 0), (SCALE, 0), (ON_DISK, 1)):
            self._instance.icntl[option] = value
        self._instance.set_assembled_matrix(n, *self._matrix)
        self._call(ANALYSE)
        self.operations = float(self._instance.rinfog[1])
        self.memory = 1e6 * self._instance.infog[MEGABYTES]
        count = float(self._instance.infog[ENTRIES])
        self.disk = 8.0 * (count if count >= 0 else -1e6 * count)  # it counts many by the million

    @property
    def negative(self) -> int:
        """Number of negative pivots."""
        return int(self._instance.infog[NEGATIVE])

    def factorise(self) -> None:
        """Compute the factor."""
        error = TOO_TIGHT[0]
        for wider in WIDER:
            if error in TOO_TIGHT:
                self._instance.icntl[ROOM] = wider
                error = self._run(FACTORISE)
        _check(error)
        self._matrix = ()

    def solve(self, X: np.ndarray) -> None:
        """Put the solution ``A^-1 X (n, k)`` into X, stored by columns."""
        self._instance.icntl[COLUMNS] = X.shape[1]
        self._instance.set_dense_rhs(X)
        self._call(SOLVE)

    def close(self) -> None:
        """Delete the files."""
        with _calls:
            self._instance = None
        self._folder.remove()

    def _call(self, job: int) -> None:
        _check(self._run(job))

    def _run(self, job: int) -> int:
        """Return what the library says of a job: below zero that it failed."""
        with _calls:
            os.environ[FOLDER] = self._folder.path
            self._instance.job = job
            self._instance.call()
        return int(self._instance.infog[1])


def _check(error: int) -> None:
    if error in LACKS:
        raise LackOfMemory(LACKS[error])
    if error < 0:
        raise RuntimeError(ERRORS.get(error, f"MUMPS error {error}"))


def _refuse_memory(folder: str) -> None:
    """Refuse a folder whose files lie in memory."""
    import psutil

    inside = [part for part in psutil.disk_partitions(all=True) if Path(folder).is_relative_to(part.mountpoint)]
    if inside and max(inside, key=lambda part: len(part.mountpoint)).fstype in IN_MEMORY:
        raise LackOfMemory(f"has no disk: files of {folder} lie in memory, TMPDIR sets another folder for them")


def room() -> float:
    """Return the bytes of the folder of temporary files that are free.

    Examples
    --------
    >>> room() > 0
    True
    """
    return float(shutil.disk_usage(gettempdir()).free)
