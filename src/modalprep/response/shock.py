"""Shock response spectra of histories, and the vibration response spectrum of a random acceleration, by pyYeti."""

from __future__ import annotations

from dataclasses import dataclass
from types import ModuleType

import numpy as np

from modalprep.drawing import Plotted
from modalprep.errors import InputError
from modalprep.extras import need
from modalprep.records import Record
from modalprep.suggest import suggestion
from modalprep.verdicts.notes import told

KINDS = {  # of the oscillator's response, by pyYeti's names
    "absolute_acceleration": "absacce",
    "relative_displacement": "reldisp",
    "pseudo_velocity": "pvelo",
    "pseudo_acceleration": "pacce",
}
STARTS = {"rest": "zero", "steady": "steady"}
PER_CYCLE = 50  # points of a cycle of the highest frequency, between which a peak is missed by 1 - cos(pi/50) = 0.2 %
FEWEST = 10  # samples of a cycle, below which straight lines between them lose 1 - (sin(x)/x)^2 = 3 % at x = pi/10
QUIET = 0.05  # of the largest value: what a history may start or end with before a note says so


@dataclass(frozen=True, eq=False, kw_only=True)
class ShockSpectrum(Record, Plotted):
    """The largest responses of damped oscillators whose base follows a history.

    Attributes
    ----------
    frequency : (nf,) float
        Of the undamped oscillators, Hz.
    positive, negative : (nf,) or (nf, k) float
        The largest and the smallest response during the history and one cycle of the lowest frequency after it.
    kind : str
        What responds: see `shock_spectrum`.
    Q : float
        ``1 / (2 damping ratio)``.
    notes : tuple of str
        Where the history is too short or too coarse.

    References
    ----------
    Theory 12.1.
    """

    frequency: np.ndarray
    positive: np.ndarray
    negative: np.ndarray
    kind: str
    Q: float
    notes: tuple[str, ...] = ()

    @property
    def maximax(self) -> np.ndarray:
        """The largest magnitude, the spectrum that is usually meant.

        Returns
        -------
        (nf,) or (nf, k) float
            In the unit of `positive`.
        """
        return np.maximum(np.abs(self.positive), np.abs(self.negative))


@told
def shock_spectrum(
    time: np.ndarray,
    acceleration: np.ndarray,
    frequency: np.ndarray,
    *,
    Q: float = 10.0,
    kind: str = "absolute_acceleration",
    start: str = "rest",
) -> ShockSpectrum:
    """Return the shock response spectrum of a base acceleration.

    Between the samples the acceleration runs in straight lines, for which each oscillator is integrated exactly; after
    the last sample it is zero.

    Parameters
    ----------
    time : (nt,)
        s, in equal steps.
    acceleration : (nt,) or (nt, k)
        m/s^2, or another unit in which the spectrum then is.
    frequency : (nf,)
        Of the oscillators, Hz, ascending.
    Q : float
        Amplification ``1 / (2 damping ratio)``, above 0.5.
    kind : str
        ``absolute_acceleration``, ``relative_displacement`` (m), ``pseudo_velocity`` (its product with ``w``, m/s) or
        ``pseudo_acceleration`` (with ``w^2``).
    start : str
        ``rest``, or ``steady`` when the first value has acted for ever, as gravity does on an accelerometer.

    Returns
    -------
    ShockSpectrum

    Raises
    ------
    InputError
        When times or frequencies are not as said, or a frequency is beyond half the sampling rate.

    References
    ----------
    D. O. Smallwood, An improved recursive formula for calculating shock response spectra, Shock and Vibration Bulletin
    51 (1981). ISO 18431-4. Theory 12.1.

    Examples
    --------
    >>> time = np.linspace(0, 0.1, 1001)
    >>> half_sine = np.where(time < 0.01, 100 * np.sin(np.pi * time / 0.01), 0.0)
    >>> shock_spectrum(time, half_sine, np.array([10.0, 80.0]), Q=1e6).maximax.round(0)
    array([ 40., 177.])
    """
    time = np.asarray(time, dtype=float)
    values = np.asarray(acceleration, dtype=float)
    frequency = np.atleast_1d(np.asarray(frequency, dtype=float))
    _refuse(kind, start, Q, frequency)
    rate = sampling_rate(time, values)
    if frequency[-1] > rate / 2:
        raise InputError(
            f"the shock spectrum goes to {frequency[-1]:g} Hz, but {rate:g} samples a second know nothing beyond "
            f"{rate / 2:g} Hz; lower the highest frequency, or the output step"
        )
    columns = values.reshape(len(values), -1)
    finer = int(np.ceil(PER_CYCLE * frequency[-1] / rate))
    both = _finer(np.hstack([columns, -columns]), finer)
    positive, negative = np.split(
        pyyeti_srs().srs(
            both,
            rate * finer,
            frequency,
            Q,
            ic=STARTS[start],
            stype=KINDS[kind],
            peak="poss",
            rolloff=None,
            time="total",
            parallel="no",
        ),
        2,
        axis=1,
    )
    shape = (len(frequency), *values.shape[1:])
    return ShockSpectrum(
        frequency=frequency,
        positive=positive.reshape(shape),
        negative=-negative.reshape(shape),
        kind=kind,
        Q=Q,
        notes=tuple(_notes(columns, rate, frequency[-1], start)),
    )


def vibration_spectrum(frequency: np.ndarray, psd: np.ndarray, natural: np.ndarray, Q: float = 10.0) -> np.ndarray:
    """Return the RMS response of oscillators to a random acceleration of their base.

    Parameters
    ----------
    frequency : (nf,)
        Hz, ascending; steps of a quarter of ``natural / Q`` are fine enough.
    psd : (nf,)
        One-sided, (m/s^2)^2/Hz; straight between its points in double-logarithmic axes.
    natural : (n,)
        Frequencies of the oscillators, Hz.
    Q : float
        Amplification, above 0.5.

    Returns
    -------
    (2, n) float
        RMS of the absolute acceleration: of the spectrum as it is, and by Miles' equation, which takes it as flat.

    Raises
    ------
    InputError
        When frequencies do not ascend or Q is too small.

    References
    ----------
    J. W. Miles, On structural fatigue under random loading, Journal of the Aeronautical Sciences 21 (1954): the second
    row is ``sqrt(pi/2 f Q S(f))``. Theory 12.1.

    Examples
    --------
    >>> f = np.geomspace(1, 1e4, 20000)
    >>> vibration_spectrum(f, np.ones(20000), np.array([100.0]), Q=20).round(1).ravel()
    array([56.1, 56. ])
    """
    frequency, natural = (np.atleast_1d(np.asarray(x, dtype=float)) for x in (frequency, natural))
    _refuse("absolute_acceleration", "rest", Q, frequency)
    return np.array(pyyeti_srs().vrs((frequency, psd), frequency, Q, False, Fn=natural, getmiles=True))


def sampling_rate(time: np.ndarray, values: np.ndarray) -> float:
    """Return the samples per second of a history.

    Raises
    ------
    InputError
        When there are less than two times, the steps differ, or values are not finite.
    """
    if time.ndim != 1 or len(time) < 2 or values.shape[:1] != time.shape:
        raise InputError(f"a history needs two times or more, with one value each; {len(time)} times came")
    step = np.diff(time)
    if not step.min() > 0 or np.ptp(step) > 1e-6 * step.mean():
        raise InputError(
            f"the times of the history are not equally spaced (steps from {step.min():g} to {step.max():g} s); "
            f"interpolate it to equal steps"
        )
    if not np.all(np.isfinite(values)):
        raise InputError("the history has values that are not finite; end it before them")
    return float((len(time) - 1) / (time[-1] - time[0]))


def pyyeti_srs() -> ModuleType:
    """Return ``pyyeti.srs``; importing it would change how numpy prints arrays."""
    need("pyyeti", "a shock spectrum")
    with np.printoptions():
        from pyyeti import srs
    return srs


def _refuse(kind: str, start: str, Q: float, frequency: np.ndarray) -> None:
    for word, known in ((kind, KINDS), (start, STARTS)):
        if word not in known:
            raise InputError(f"a shock spectrum knows no {word!r}; {suggestion(word, tuple(known), 'it knows')}")
    if not Q > 0.5:
        raise InputError(f"Q is {Q:g}, but oscillators vibrate above 0.5 only; Q is 1 / (2 damping ratio)")
    if not len(frequency) or not frequency[0] > 0 or not np.all(np.diff(frequency) > 0):
        raise InputError("the frequencies of the oscillators must be positive and ascend")


def _finer(columns: np.ndarray, factor: int) -> np.ndarray:
    """Return columns with `factor` steps in place of each, on straight lines."""
    if factor < 2:
        return columns
    at = np.arange((len(columns) - 1) * factor + 1) / factor
    return np.stack([np.interp(at, np.arange(len(columns)), column) for column in columns.T], axis=1)


def _notes(columns: np.ndarray, rate: float, highest: float, start: str):
    largest = np.abs(columns).max(axis=0)
    first, last = (np.max(np.abs(row) / np.where(largest > 0, largest, 1.0)) for row in (columns[0], columns[-1]))
    if rate < FEWEST * highest:
        yield (
            f"{rate / highest:.3g} samples in a cycle of {highest:g} Hz, of {FEWEST} or more that the shock spectrum "
            f"needs: its upper end is too low; lower the output step"
        )
    if last > QUIET:
        yield (
            f"the history ends at {100 * last:.0f} % of its largest value, and the shock spectrum takes it as zero "
            f"from there on; extend it until it has died away"
        )
    if first > QUIET and start == "rest":
        yield (
            f"the history starts at {100 * first:.0f} % of its largest value, which the shock spectrum takes as a "
            f"sudden start from zero; start = 'steady' takes it as lasting before"
        )
