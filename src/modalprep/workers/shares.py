"""The processors of this machine, and the share of a worker."""

from __future__ import annotations

import math
import os

THREADS = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")


def processors() -> int:
    """Return the number of processors that this program may use.

    Examples
    --------
    >>> processors() >= 1
    True
    """
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def share_threads(threads: int) -> None:
    """Let the linear algebra of this process use its share of the processors, before numpy is loaded.

    Examples
    --------
    >>> before = dict(os.environ)
    >>> share_threads(1)
    >>> os.environ["OMP_NUM_THREADS"]
    '1'
    >>> os.environ.update(before)
    """
    for name in THREADS:
        os.environ[name] = str(min(threads, exported_threads(name)))


def exported_threads(name: str) -> float:
    """Return the number of threads that the user's environment allows; a share of the processors may be less.

    Examples
    --------
    >>> exported_threads("NO_SUCH_NAME")
    inf
    """
    text = os.environ.get(name, "")
    return max(1, int(text)) if text.isdecimal() else math.inf
