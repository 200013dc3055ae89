"""How much memory a factorisation may take."""

from __future__ import annotations

import os

from modalprep.errors import InputError

BUDGET = "MODALPREP_MEMORY"  # GiB; the limit that a user sets
SHARE = 0.9  # of what is free


def available_memory() -> float:
    """Return the bytes that may be taken: of `MODALPREP_MEMORY` (GiB) and 90 % of the free memory the lesser.

    Raises
    ------
    InputError
        When the variable is not a positive number.

    Examples
    --------
    >>> available_memory() > 1e6
    True
    """
    import psutil  # here: who reads files of matrices alone goes without

    return min(_budget(), SHARE * psutil.virtual_memory().available)


def _budget() -> float:
    text = os.environ.get(BUDGET, "inf")
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not value > 0:
        raise InputError(f"{BUDGET} = {text!r} must be a positive number, the memory to use in GiB")
    return value * 2**30
