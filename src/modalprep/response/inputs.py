"""What drives a body: amplitudes and power spectral densities over frequency."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from modalprep.errors import InputError
from modalprep.records import Record, given, optional
from modalprep.vectors import VectorLike, vector

DECIBEL = " dB/oct"
PER_CYCLE = 100  # samples: straight lines between them miss a sine by (2 pi / 100)^2 / 8 = 5e-4 of its amplitude
MOST_SAMPLES = 20_000_000
BINS = 60  # of the axis, in an octave
Rate = tuple[float, Literal["oct/min", "Hz/s"]]


def _numbers(value: float | VectorLike, what: str = "") -> np.ndarray:
    return np.atleast_1d(np.asarray(value, dtype=float))


@dataclass(frozen=True, eq=False, kw_only=True)
class Spectrum(Record):
    """An amplitude or a power spectral density over frequency: straight lines in logarithmic axes, zero outside.

    Where an end of a piece is not positive, the line is straight in linear axes. A frequency named twice is a jump.

    Attributes
    ----------
    value : (n,)
        Of each frequency, in the unit of the input; of densities its square per Hz.
    frequency : (n,) or None
        Hz, ascending; None for one value at all frequencies.
    phase : (n,) or None
        rad, linear between the frequencies; None is 0.

    Raises
    ------
    InputError
        When the lengths differ, frequencies descend or a value is no number.

    Examples
    --------
    >>> Spectrum(frequency=np.array([10.0, 40.0]), value=np.array([1.0, 4.0])).values_at(np.array([5.0, 20.0]))
    array([0., 2.])
    """

    value: np.ndarray = given(converter=_numbers)
    frequency: np.ndarray | None = given(converter=optional(_numbers), default=None)
    phase: np.ndarray | None = given(converter=optional(_numbers), default=None)

    def __post_init__(self) -> None:
        """Check what was given."""
        super().__post_init__()
        n = 1 if self.frequency is None else len(self.frequency)
        if len(self.value) != n or (self.phase is not None and len(self.phase) != n):
            raise InputError(f"a spectrum of {n} frequencies has {len(self.value)} values; give as many, and phases")
        if self.frequency is not None and (n < 2 or self.frequency[0] <= 0 or np.any(np.diff(self.frequency) < 0)):
            raise InputError("the frequencies of a spectrum must be above 0 and ascend, and there must be two or more")
        if not np.all(np.isfinite(self.value)):
            raise InputError("a spectrum has values that are no numbers; correct them")

    @classmethod
    def with_slopes(cls, frequency: Sequence[float], levels: Sequence[float | str]) -> Spectrum:
        """Return a density of which some levels are slopes towards their neighbour, such as ``"3 dB/oct"``.

        Parameters
        ----------
        frequency : sequence of float
            Hz.
        levels : sequence of float or str
            Density at each frequency; a text is the slope of the piece between it and the nearest number.

        Returns
        -------
        Spectrum
            With a number at each frequency.

        Raises
        ------
        InputError
            When there is no number, or a text is no slope.

        Examples
        --------
        >>> Spectrum.with_slopes([20, 40, 80], ["3 dB/oct", 1.0, "-6 dB/oct"]).value.round(3)
        array([0.501, 1.   , 0.251])
        """
        known = [k for k, level in enumerate(levels) if not isinstance(level, str)]
        if not known or len(levels) != len(frequency):
            raise InputError("a spectrum needs a level for each frequency, and one of them as a number")
        value = np.array([0.0 if isinstance(level, str) else level for level in levels])
        for k in [*range(known[0] - 1, -1, -1), *range(known[0] + 1, len(levels))]:
            if isinstance(level := levels[k], str):
                near = k + 1 if k < known[0] else k - 1
                octaves = np.log2(frequency[k] / frequency[near])
                value[k] = value[near] * 10 ** (_slope(level) * octaves / 10)
        return cls(frequency=np.array(frequency, dtype=float), value=value)

    def values_at(self, f: np.ndarray) -> np.ndarray:
        """Return the values at frequencies ``f (m,)`` in Hz.

        Returns
        -------
        (m,) float or complex
            Complex where there is a phase.
        """
        f = np.asarray(f, dtype=float)
        if self.frequency is None:
            found = np.full(f.shape, self.value[0])
        else:
            found = np.where((f >= self.frequency[0]) & (f <= self.frequency[-1]), self._inside(f, self.frequency), 0.0)
        if self.phase is None:
            return found
        turn = self.phase[0] if self.frequency is None else np.interp(f, self.frequency, self.phase)
        return found * np.exp(1j * turn)

    def _inside(self, f: np.ndarray, own: np.ndarray) -> np.ndarray:
        k = np.clip(np.searchsorted(own, f, side="right") - 1, 0, len(own) - 2)
        (f0, f1), (a, b) = (x[np.stack([k, k + 1])] for x in (own, self.value))
        wide = f1 > f0
        f1, f = np.where(wide, f1, 2 * f0), np.clip(f, f0, np.where(wide, f1, f0))
        straight = a + (b - a) * (f - f0) / (f1 - f0)
        with np.errstate(divide="ignore", invalid="ignore"):
            power = np.log(f / f0) / np.log(f1 / f0)
            curved = a ** (1 - power) * b**power
        return np.where((a > 0) & (b > 0), curved, straight)

    @property
    def band(self) -> tuple[float, float]:
        """Lowest and highest frequency, Hz; 0 and infinity of a constant."""
        return (0.0, np.inf) if self.frequency is None else (float(self.frequency[0]), float(self.frequency[-1]))


@dataclass(frozen=True, eq=False, kw_only=True)
class History(Record):
    """An input over time: straight lines between its points, zero before and after.

    Attributes
    ----------
    time : (n,)
        s, ascending from 0 or later.
    value : (n,)
        In the unit of the input.

    Raises
    ------
    InputError
        When the lengths differ, or times do not ascend.

    Examples
    --------
    >>> History(time=np.array([0.0, 1.0]), value=np.array([0.0, 2.0])).values_at(np.array([0.5, 3.0]))
    array([1., 0.])
    """

    time: np.ndarray = given(converter=vector)
    value: np.ndarray = given(converter=vector)

    def __post_init__(self) -> None:
        """Check what was given."""
        super().__post_init__()
        if self.time.ndim != 1 or self.time.shape != self.value.shape or len(self.time) < 2:
            raise InputError("a history needs two or more times, and as many values")
        if self.time[0] < 0 or np.any(np.diff(self.time) <= 0) or not np.all(np.isfinite(self.value)):
            raise InputError("the times of a history must ascend from 0 or later, and its values be numbers")

    def values_at(self, t: np.ndarray) -> np.ndarray:
        """Return the values at times ``t (m,)`` in s.

        Returns
        -------
        (m,) float
            In the unit of the input.
        """
        return np.interp(t, self.time, self.value, left=0.0, right=0.0)


def _slope(text: str) -> float:
    """Return dB/oct of a text."""
    try:
        if text.endswith(DECIBEL):
            return float(text.removesuffix(DECIBEL))
    except ValueError:
        pass
    raise InputError(f"{text!r} is neither a level nor a slope; write a number, or for example '3 dB/oct'")


class Sweep:
    """Frequency and phase of a sweep over time.

    Examples
    --------
    >>> up = Sweep(10.0, 40.0, (2.0, "oct/min"), "up")
    >>> up.duration, round(up.cycles, 3)
    (60.0, 1298.426)
    """

    def __init__(self, lowest: float, highest: float, rate: Rate, direction: str) -> None:
        if not (0 < lowest < highest and rate[0] > 0):
            raise InputError(f"a sweep from {lowest:g} to {highest:g} Hz at {rate[0]:g} {rate[1]} is none; give others")
        if rate[1] not in ("oct/min", "Hz/s"):
            raise InputError(f"a sweep at {rate[0]:g} {rate[1]} is not known; give its rate in 'oct/min' or 'Hz/s'")
        if direction not in ("up", "down"):
            raise InputError(f"a sweep goes 'up' or 'down', not {direction!r}")
        down = direction == "down"
        self.first, self.last = (highest, lowest) if down else (lowest, highest)
        self.octaves = rate[1] == "oct/min"
        self.speed = (-1 if down else 1) * (rate[0] / 60 * np.log(2) if self.octaves else rate[0])
        self.duration = float(self.time(np.array(self.last)))
        self.cycles = abs(float(self.phase(np.array(self.duration)))) / (2 * np.pi)

    def refuse_long(self, samples: int) -> None:
        """Refuse a sweep with too many samples, so many in each cycle."""
        if self.cycles * samples > MOST_SAMPLES:
            raise InputError(f"the sweep has {self.cycles:.3g} cycles of {samples} samples, too many; sweep faster")

    def time(self, f: np.ndarray) -> np.ndarray:
        """Return when the frequency is f (Hz)."""
        return np.log(f / self.first) / self.speed if self.octaves else (f - self.first) / self.speed

    def frequency(self, t: np.ndarray) -> np.ndarray:
        """Return the frequency (Hz) at times t (s)."""
        return self.first * np.exp(self.speed * t) if self.octaves else self.first + self.speed * t

    def phase(self, t: np.ndarray) -> np.ndarray:
        """Return the phase (rad) at times t (s): the integral of the frequency."""
        if self.octaves:
            return 2 * np.pi * self.first * np.expm1(self.speed * t) / self.speed
        return 2 * np.pi * (self.first * t + self.speed * t**2 / 2)

    def ends(self) -> np.ndarray:
        """Return the ends of intervals of frequency, in the order of the sweep; each has a cycle at least."""
        count = max(1, int(np.ceil(BINS * abs(np.log2(self.last / self.first)))))
        f = np.geomspace(self.first, self.last, count + 1)
        whole = np.floor(np.abs(self.phase(self.time(f))) / (2 * np.pi))
        some = np.concatenate([[True], np.diff(np.maximum.accumulate(whole)) >= 1])
        some[-1] = True
        return f[some]


def as_spectra(inputs: Mapping[str, float | Spectrum]) -> dict[str, Spectrum]:
    """Return the inputs as spectra; a number is one value at all frequencies.

    Raises
    ------
    InputError
        When there is none.

    Examples
    --------
    >>> as_spectra({"base.x": 2.0})["base.x"].values_at(np.array([7.0]))
    array([2.])
    """
    if not inputs:
        raise InputError("a response needs an input, such as 'base.x'")
    return {key: x if isinstance(x, Spectrum) else Spectrum(value=np.array([x])) for key, x in inputs.items()}


def uncovered(spectra: Mapping[str, Spectrum], low: float, high: float) -> list[str]:
    """Return a sentence for each input that is zero in a part of the band because its table does not cover it.

    Examples
    --------
    >>> table = Spectrum(frequency=np.array([10.0, 20.0]), value=np.ones(2))
    >>> uncovered({"base.x": table}, 10.0, 50.0)
    ['the input base.x is zero outside its table, which goes from 10 to 20 Hz']
    """
    return [
        f"the input {name} is zero outside its table, which goes from {x.band[0]:g} to {x.band[1]:g} Hz"
        for name, x in spectra.items()
        if x.band[0] > low * (1 + 1e-9) or x.band[1] < high * (1 - 1e-9)
    ]
