"""Measured histories: times, channels, what is missing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody.results.result import Result
from modalprep.suggest import refuse_unknown

TIME = "time"


@dataclass(frozen=True)
class Measurement:
    """Channels measured at common times.

    Attributes
    ----------
    time : (nt,)
        s.
    channels : tuple of str
    values : (nt, nc)
        NaN where nothing was measured.
    """

    time: np.ndarray
    channels: tuple[str, ...]
    values: np.ndarray

    @property
    def duration(self) -> float:
        """The last time, s."""
        return float(self.time[-1])

    @property
    def there(self) -> np.ndarray:
        """Where there is a number (nt, nc)."""
        return np.isfinite(self.values)

    @property
    def count(self) -> int:
        """How many numbers were measured."""
        return int(self.there.sum())

    @property
    def spread(self) -> np.ndarray:
        """Standard deviation (nc,) of each channel, or its size where it is constant."""
        found = np.nanstd(self.values, axis=0)
        return np.where(found > 0, found, np.maximum(np.nanmax(np.abs(self.values), axis=0), 1e-300))

    def deviations(self, noise: Mapping[str, float]) -> np.ndarray:
        """Return the standard deviations (nc,) given for the channels.

        Raises
        ------
        InputError
            When one is missing, unknown or not positive.
        """
        for name, value in noise.items():
            refuse_unknown(name, self.channels, "identify: noise of channel")
            if not 0 < value < float("inf"):
                raise InputError(f"identify: the noise of {name!r} is {value}; give its standard deviation")
        missing = [name for name in self.channels if name not in noise]
        if missing:
            raise InputError(
                f"identify: noise is given, but not that of {missing[0]!r}; give it of all channels or of none"
            )
        return np.array([noise[name] for name in self.channels], dtype=float)


def measurement(measured: Result | Mapping[str, Any], noise: Mapping[str, float] | None = None) -> Measurement:
    """Return measured histories, checked.

    Raises
    ------
    InputError
        When there are no times or channels, they differ in length, or times do not ascend from 0 or later.

    Examples
    --------
    >>> found = measurement({"time": [0.0, 0.5], "hinge.angle": [1.0, np.nan]})
    >>> found.channels, found.count, found.duration
    (('hinge.angle',), 1, 0.5)
    """
    table = {TIME: measured.time} | measured.table() if isinstance(measured, Result) else measured
    if not isinstance(table, Mapping) or TIME not in table or len(table) < 2:
        raise InputError(
            f'identify: the measurement needs "{TIME}" and channels: {{"{TIME}": [...], "hinge.angle": [...]}}, or a '
            "result that read_result reads"
        )
    time = _numbers(TIME, table[TIME])
    if not len(time) or time[0] < 0 or not np.all(np.diff(time) > 0) or not np.all(np.isfinite(time)):
        raise InputError("identify: measured times must ascend, from 0 or later")
    columns = {name: _numbers(name, values) for name, values in table.items() if name != TIME}
    for name, column in columns.items():
        if len(column) != len(time):
            raise InputError(f"identify: channel {name!r} has {len(column)} numbers, and there are {len(time)} times")
        if not np.any(np.isfinite(column)):
            raise InputError(f"identify: channel {name!r} has no number; leave it out")
    return Measurement(time, tuple(columns), np.column_stack(list(columns.values())))


def _numbers(name: str, values: Any) -> np.ndarray:
    try:
        found = np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"identify: {name!r} does not hold numbers") from None
    if found.ndim != 1:
        raise InputError(
            f"identify: {name!r} has the shape {found.shape}; give one number for each time, of a vector each component"
        )
    return found
