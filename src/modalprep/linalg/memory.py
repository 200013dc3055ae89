"""How much memory a factorisation may take."""

from __future__ import annotations

import os
from pathlib import Path

from modalprep.errors import InputError

BUDGET = "MODALPREP_MEMORY"  # GiB; the limit that a user sets
SHARE = 0.9  # of what is free


def available_memory() -> float:
    """Return the bytes that may be taken: of `MODALPREP_MEMORY` (GiB) and 90 % of the free memory the lesser.

    Infinite where the system does not tell.

    Raises
    ------
    InputError
        When the variable is not a positive number.

    Examples
    --------
    >>> available_memory() > 1e6
    True
    """
    return min(_budget(), SHARE * _free())


def _budget() -> float:
    text = os.environ.get(BUDGET, "inf")
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not value > 0:
        raise InputError(f"{BUDGET} = {text!r} must be a positive number, the memory to use in GiB")
    return value * 2**30


def _free() -> float:
    try:
        lines = Path("/proc/meminfo").read_text().splitlines()
    except OSError:
        return float("inf")
    sizes = dict(line.split(":") for line in lines)
    return 1024.0 * int(sizes["MemAvailable"].split()[0])
