"""One helper for sentences that name what exists."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


def suggestion(wrong: str, known: Iterable[str], intro: str) -> str:
    """Say which names exist, the closest first when one is close.

    Examples
    --------
    >>> suggestion("bolt_c", ["body", "bolt_a"], "it has")
    "did you mean 'bolt_a'? it has body, bolt_a"
    """
    known = list(known)
    close = difflib.get_close_matches(wrong, known, n=1)
    guess = f"did you mean {close[0]!r}? " if close else ""
    return f"{guess}{intro} {', '.join(known) or 'none'}"
