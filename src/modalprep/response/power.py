"""Power spectral density of a history, by Welch's mean over segments."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from modalprep.drawing import Plotted
from modalprep.errors import InputError
from modalprep.records import Record
from modalprep.response.shock import sampling_rate
from modalprep.vectors import VectorLike
from modalprep.verdicts.notes import told

SHARE = 8  # of the history is a segment
FEW = 10  # segments, below which a note says how far a density scatters
LEAST = 8  # samples of a segment


@dataclass(frozen=True, eq=False, kw_only=True)
class PowerSpectrum(Record, Plotted):
    """One-sided power spectral density of a history without its mean.

    Attributes
    ----------
    frequency : (nf,) float
        Hz, in steps of 1 / segment.
    density : (nf,) or (nf, k) float
        Unit of the history squared per Hz.
    segments : int
        Over how many, half overlapping, the mean was taken.
    notes : tuple of str
        Where few segments leave scatter.

    Examples
    --------
    >>> flat = PowerSpectrum(frequency=np.arange(5.0), density=np.ones(5), segments=20)
    >>> float(flat.rms)
    2.0
    """

    frequency: np.ndarray
    density: np.ndarray
    segments: int
    notes: tuple[str, ...] = ()

    @property
    def rms(self) -> np.ndarray:
        """Root of the integral of the density over frequency.

        Returns
        -------
        () or (k,) float
            In the unit of the history.
        """
        return np.sqrt(np.trapezoid(self.density, self.frequency, axis=0))


@told
def power_spectrum(time: VectorLike, values: VectorLike, *, segment: float | None = None) -> PowerSpectrum:
    """Return the power spectral density of a history, such as a channel of a run.

    Each segment loses its mean and is weighted by a Hann window; the segments overlap by half.

    Parameters
    ----------
    time : (nt,)
        s, in equal steps.
    values : (nt,) or (nt, k)
        In any unit.
    segment : float, optional
        s, the duration of a segment: lines are ``1.5 / segment`` wide in Hz. An eighth of the history by default.

    Returns
    -------
    PowerSpectrum

    Raises
    ------
    InputError
        When the steps differ, values are not finite, or a segment is longer than the history or of few samples.

    References
    ----------
    P. D. Welch, The use of fast Fourier transform for the estimation of power spectra, IEEE Transactions on Audio and
    Electroacoustics 15 (1967).

    Examples
    --------
    >>> time = np.arange(8001) / 1000
    >>> power_spectrum(time, 3 * np.sin(2 * np.pi * 50 * time), segment=0.8).rms.round(3)
    np.float64(2.121)
    """
    moments, history = np.asarray(time, dtype=float), np.asarray(values, dtype=float)
    rate = sampling_rate(moments, history)
    duration = (moments[-1] - moments[0]) / SHARE if segment is None else float(segment)
    count = _samples(duration, rate, len(moments))
    frequency, density = scipy.signal.welch(history, rate, nperseg=count, axis=0)
    segments = 1 + (len(moments) - count) // (count - count // 2)
    return PowerSpectrum(frequency=frequency, density=density, segments=segments, notes=tuple(_notes(segments)))


def _samples(duration: float, rate: float, known: int) -> int:
    """Return the samples of a segment."""
    if not LEAST <= round(duration * rate) <= known:
        raise InputError(
            f"power spectrum: a segment of {duration:g} s has {duration * rate:.0f} samples; it needs {LEAST} or more "
            f"and the history has {known}: change segment, or lower the output step"
        )
    return round(duration * rate)


def _notes(segments: int):
    if segments < FEW:
        yield (
            f"the density is the mean of {segments} segments: of a random history it scatters by about "
            f"{100 / np.sqrt(segments):.0f} %; shorten the segments, or run longer"
        )
