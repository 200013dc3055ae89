"""Whether kernels are compiled with private parts of numba, or by its public interface alone.

With a version of numba that was tried, the code of large kernels is shared (`linking`) and kept between processes
(`cache`). Another version may have other private parts: kernels are then compiled by plain ``njit``, anew in every
process. Results are the same. ``MODALPREP_COMPILER=plain`` or ``fast`` chooses.
"""

from __future__ import annotations

import os
from functools import lru_cache

TRIED = ("0.68",)  # versions of numba: add one when tests/multibody/kernels pass with it


def is_fast(version: str, wanted: str) -> bool:
    """Return whether to use the private parts of a version of numba.

    Examples
    --------
    >>> is_fast("0.68.1", ""), is_fast("0.70.0", ""), is_fast("0.70.0", "fast"), is_fast("0.68.1", "plain")
    (True, False, True, False)
    """
    return wanted == "fast" or (wanted != "plain" and ".".join(version.split(".")[:2]) in TRIED)


@lru_cache
def fast() -> bool:
    """Return whether the private parts of the numba that is installed are used."""
    import numba

    return is_fast(numba.__version__, os.environ.get("MODALPREP_COMPILER", ""))


def how_long() -> str:
    """Return how long compilation takes, for a user."""
    if fast():
        return "once: up to a minute"
    return "for minutes in every process, since this modalprep does not know the insides of this version of numba"
