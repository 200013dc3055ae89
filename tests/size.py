"""How much the tests do: the full size by `MODALPREP_FULL=1 make test`, a reduced one without it.

`MODALPREP_FULL=10` makes ten times as many random cases, and others each time.
"""

import os

FULL = float(os.environ.get("MODALPREP_FULL") or 0)
REDUCED = 0.3  # share of the random cases
KILLS = round(20 * FULL) or 2  # of `run`, as many of `simulate` and of `batch`


def cases(count):
    """Return of so many random cases those of this size."""
    return max(1, round(count * (FULL or REDUCED)))


def seeds(count):
    """Return the seeds of a test that has been tried with so many."""
    return range(count if FULL else cases(count))


def some(found, count):
    """Return `count` of the cases of one claim, spread from the first to the last; all of them at the full size."""
    found = list(found)
    return found if FULL else [found[k * (len(found) - 1) // max(1, count - 1)] for k in range(count)]
