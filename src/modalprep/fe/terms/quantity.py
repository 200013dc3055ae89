"""What foundations and added masses refuse alike."""

from __future__ import annotations

from typing import Any

import numpy as np

from modalprep.errors import InputError


def refuse_both(what: str, record: Any, names: tuple[str, ...]) -> None:
    """Refuse a record that does not have exactly one of some attributes."""
    given = [name for name in names if getattr(record, name) is not None]
    if len(given) != 1:
        raise InputError(f"{what} needs exactly one of {', '.join(names)}; it has {' and '.join(given) or 'none'}")


def refuse_negative(what: str, value: Any) -> None:
    """Refuse numbers that are negative or not finite."""
    if not np.all(np.isfinite(value)) or np.any(np.asarray(value) < 0):
        raise InputError(f"{what} {np.asarray(value).tolist()} must not be negative or infinite")
