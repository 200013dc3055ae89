"""How many stations a deflection needs (theory 4.10)."""

from __future__ import annotations

from math import ceil, sqrt

from modalprep.errors import InputError

SLOPE = 1.75  # rad per deflection over length: 1.5 of a slightly bent cantilever, 1.8 of one bent by .6 of its length
SHARE = 0.05  # error over the square of the turn between neighbours
LEAST = 4


def stations_for(reach: float = 0.4, error: float = 1e-4) -> int:
    """Return the number of stations that a deflection needs.

    N stations along a line that turns by th leave an error of about ``.05 (th / N)^2`` of its length.

    Parameters
    ----------
    reach : float
        Largest deflection over the length of the body, as of a cantilever.
    error : float
        Error of the place of its end over the length.

    Returns
    -------
    int
        Even, so that half of them can be compared, and at least 4.

    Raises
    ------
    InputError
        When a number is not positive, or the reach is above 1.

    Examples
    --------
    >>> stations_for(), stations_for(0.6, 1e-3)
    (16, 8)
    """
    if not 0 < reach <= 1:
        raise InputError(f"reach = {reach:g} must be above 0 and at most 1, the length of the body")
    if not 0 < error < 1:
        raise InputError(f"deflection_error = {error:g} must be between 0 and 1, of the length of the body")
    return max(LEAST, 2 * ceil(SLOPE * reach * sqrt(SHARE / error) / 2))
