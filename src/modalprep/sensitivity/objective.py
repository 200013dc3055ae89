"""What a gradient is taken of: one number that the histories of channels make."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from modalprep.errors import InputError


@dataclass(frozen=True, kw_only=True)
class Objective:
    """A number that histories of channels make, with its own derivatives.

    Attributes
    ----------
    channels : tuple of str
        Single numbers among the channels of a `Result`.
    value : callable
        ``value(time, histories) -> (number, slopes)``: of the output times (nt,), s, and the channels (nt, nc); its
        derivatives by them are (nt, nc) too.

    Examples
    --------
    >>> def largest_at_end(time, histories):
    ...     slopes = np.zeros_like(histories)
    ...     slopes[-1] = 2 * histories[-1]
    ...     return float(np.sum(histories[-1] ** 2)), slopes
    >>> Objective(channels=("arm.modal.1", "arm.modal_rate.1"), value=largest_at_end).channels
    ('arm.modal.1', 'arm.modal_rate.1')
    """

    channels: tuple[str, ...]
    value: Callable[[np.ndarray, np.ndarray], tuple[float, np.ndarray]]

    def evaluate(self, time: np.ndarray, histories: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the number and its derivatives (nt, nc) by the channels.

        Returns
        -------
        (float, (nt, nc) float)
            Both.

        Raises
        ------
        InputError
            When they are not finite numbers, or as many.
        """
        value, slopes = self.value(time, histories)
        slopes = np.asarray(slopes, dtype=float)
        if slopes.shape != histories.shape or not (np.isfinite(value) and np.all(np.isfinite(slopes))):
            raise InputError(
                f"objective: give a finite number and its derivatives {histories.shape}, one for each output time and "
                f"channel; it returned {value} and derivatives {slopes.shape}"
            )
        return float(value), slopes


def last(channel: str) -> Objective:
    """Return the value of a channel at the end of the run.

    Returns
    -------
    Objective
        Of that channel.

    Examples
    --------
    >>> last("hinge.angle").evaluate(np.arange(2.0), np.array([[1.0], [3.0]]))
    (3.0, array([[0.],
           [1.]]))
    """

    def value(time: np.ndarray, histories: np.ndarray) -> tuple[float, np.ndarray]:
        slopes = np.zeros_like(histories)
        slopes[-1] = 1.0
        return float(histories[-1, 0]), slopes

    return Objective(channels=(channel,), value=value)


def squares(measured: Mapping[str, np.ndarray], weights: Mapping[str, float] | None = None) -> Objective:
    """Return half the sum of squares of channels less what they should be at the output times.

    Parameters
    ----------
    measured : {channel: (nt,)}
    weights : {channel: float} or None
        Factors on the squares, 1 by default: one over the variance of a measurement.

    Returns
    -------
    Objective
        Of these channels.

    Examples
    --------
    >>> fit = squares({"hinge.angle": np.array([0.0, 1.0])})
    >>> fit.evaluate(np.arange(2.0), np.array([[0.0], [3.0]]))
    (2.0, array([[0.],
           [2.]]))
    """
    wanted = np.array(list(measured.values()), dtype=float).T
    factor = np.array([(weights or {}).get(name, 1.0) for name in measured])

    def value(time: np.ndarray, histories: np.ndarray) -> tuple[float, np.ndarray]:
        if histories.shape != wanted.shape:
            raise InputError(f"objective: {len(wanted)} measured values of a channel, but {len(time)} output times")
        off = histories - wanted
        return float(0.5 * np.sum(factor * off**2)), factor * off

    return Objective(channels=tuple(measured), value=value)


def integral(channels: str | Sequence[str], *, square: bool = False) -> Objective:
    """Return the integral of channels, or of their squares, over the time, by trapezia between the outputs.

    Returns
    -------
    Objective
        Of the sum of these channels.

    Examples
    --------
    >>> integral("hinge.rate").evaluate(np.arange(3.0), np.ones((3, 1)))[0]
    2.0
    """
    names = (channels,) if isinstance(channels, str) else tuple(channels)

    def value(time: np.ndarray, histories: np.ndarray) -> tuple[float, np.ndarray]:
        width = np.diff(time, prepend=time[0]) / 2 + np.diff(time, append=time[-1]) / 2
        slopes = 2 * histories if square else np.ones_like(histories)
        return float(width @ (histories**2 if square else histories).sum(axis=1)), width[:, None] * slopes

    return Objective(channels=names, value=value)
