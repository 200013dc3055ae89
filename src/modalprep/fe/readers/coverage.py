"""What a reader does with each keyword or card of its format: it dispatches by it, the docs list it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal, NamedTuple

Treatment = Literal["read", "approximated", "no effect", "refused"]


class Entry(NamedTuple):
    """One keyword or card.

    Attributes
    ----------
    treatment : {"read", "approximated", "no effect", "refused"}
        "no effect": nothing that the model needs, such as a request for output; "refused": it carries stiffness, mass
        or constraints that cannot be read, so that the deck is refused unless the user names it as ignored.
    remark : str
        What is approximated, or why it is refused; a whole sentence.
    handle : callable
        The function of the reader that reads it; None for what is not read.
    """

    treatment: Treatment
    remark: str = ""
    handle: Callable[..., Any] | None = None
