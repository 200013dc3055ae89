"""Fatigue: rainflow counts of histories, Miner's sum, and the damage of random stress."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy

from modalprep.errors import InputError
from modalprep.records import Record
from modalprep.response.sn_curve import SNCurve
from modalprep.suggest import suggestion
from modalprep.verdicts.notes import told

METHODS = ("dirlik", "narrow_band")
NARROW = 1e-4  # 1 - irregularity below which Dirlik's formula divides small differences
TAIL = 60.0  # standard deviations beyond which no cycle counts: the longest tail of Dirlik falls as exp(-S/sigma)


@dataclass(frozen=True, eq=False, kw_only=True)
class Fatigue(Record):
    """The damage of a history or of a random stress.

    Attributes
    ----------
    damage : float
        Miner's sum: 1 is failure. Of a random stress that of `duration`.
    duration : float
        s, of the history.
    cycles : float
        Counted, half cycles as one half; of a random stress the expected peaks.
    ranges, means, counts : (n,)
        The cycles of a history; empty for a random stress.
    largest : float
        The largest amplitude that was counted, the mean stress included; of a random stress three standard deviations.
    method : str
        ``rainflow``, ``dirlik`` or ``narrow_band``.
    notes : tuple of str
        What was taken otherwise than asked for, or left open.
    unit : str
        Of the amplitudes, such as ``Pa``; empty where it is not known.

    References
    ----------
    Theory 12.2.
    """

    damage: float
    duration: float
    cycles: float
    ranges: np.ndarray
    means: np.ndarray
    counts: np.ndarray
    largest: float
    method: str
    notes: tuple[str, ...] = ()
    unit: str = ""

    @property
    def life(self) -> float:
        """The time to failure when the load goes on as it is.

        Returns
        -------
        float
            s; infinite without damage.
        """
        return self.duration / self.damage if self.damage else np.inf


@told
def rainflow_damage(time: np.ndarray, stress: np.ndarray, curve: SNCurve) -> Fatigue:
    """Return the damage of a history by rainflow counting and Miner's sum.

    Parameters
    ----------
    time : (nt,)
        s, ascending.
    stress : (nt,)
        In the unit of the curve. Von Mises stress has no sign and hides half of the cycles: take a component, or give
        it the sign of the largest principal stress (`signed_von_mises`).
    curve : SNCurve

    Returns
    -------
    Fatigue

    Raises
    ------
    InputError
        When the history has less than two values, or one that is not finite.

    References
    ----------
    ASTM E1049-85, section 5.4.4. M. A. Miner, Cumulative damage in fatigue, Journal of Applied Mechanics 12 (1945).
    Theory 12.2.

    Examples
    --------
    >>> time = np.linspace(0, 10, 4001)
    >>> found = rainflow_damage(time, 100e6 * np.cos(2 * np.pi * time), SNCurve(stress=100e6, cycles=1e6, slope=5))
    >>> found.cycles, round(found.damage * 1e6, 9), round(found.life)
    (10.0, 10.0, 1000000)
    """
    time, stress = np.asarray(time, dtype=float), np.asarray(stress, dtype=float)
    if stress.ndim != 1 or stress.shape != time.shape or len(time) < 2 or not np.all(np.isfinite(stress)):
        raise InputError(f"rainflow counting needs a history of two finite values or more; {stress.shape} came")
    import rainflow

    series = [stress[0], *stress.tolist()]  # of two values alone the library counts nothing; one more is no reversal
    cycles = np.array([c[:3] for c in rainflow.extract_cycles(series)]).reshape(-1, 3)
    ranges, means, counts = cycles.T
    amplitude = curve.amplitude(ranges, means)
    return Fatigue(
        damage=float(np.sum(counts / curve.life(amplitude))),
        duration=float(time[-1] - time[0]),
        cycles=float(counts.sum()),
        ranges=ranges,
        means=means,
        counts=counts,
        largest=float(amplitude.max(initial=0.0)),
        method="rainflow",
    )


@told
def random_damage(
    frequency: np.ndarray, psd: np.ndarray, curve: SNCurve, *, duration: float, method: str = "dirlik"
) -> Fatigue:
    """Return the expected damage of a stationary Gaussian stress of zero mean.

    Parameters
    ----------
    frequency : (nf,)
        Hz, ascending and fine enough for the trapezoidal rule.
    psd : (nf,)
        One-sided, the square of the curve's unit per Hz.
    curve : SNCurve
        Its tensile strength is not used, because the mean stress is zero.
    duration : float
        s.
    method : str
        ``dirlik``, from rainflow counts of simulated histories, or ``narrow_band`` (Rayleigh), which is exact for one
        narrow peak and on the safe side otherwise.

    Returns
    -------
    Fatigue

    Raises
    ------
    InputError
        When the spectrum is not one, or the method is not known.

    References
    ----------
    T. Dirlik, Application of Computers in Fatigue Analysis, PhD thesis, University of Warwick, 1985. J. W. Miles,
    Journal of the Aeronautical Sciences 21 (1954). Theory 12.2.

    Examples
    --------
    >>> f = np.linspace(49, 51, 201)
    >>> psd = np.full(201, 0.5 * (30e6) ** 2)  # 30 MPa RMS
    >>> curve = SNCurve(stress=100e6, cycles=1e6, slope=4)
    >>> random_damage(f, psd, curve, duration=60.0, method="narrow_band").damage * 1e6  # 3000 8 0.3^4
    194.4
    """
    frequency = np.asarray(frequency, dtype=float)
    psd = np.asarray(psd, dtype=float)
    if curve.ultimate is not None:
        raise InputError("a random stress has no mean, on which 'ultimate' has an effect; leave it out of the curve")
    if method not in METHODS:
        raise InputError(f"random damage knows no method {method!r}; {suggestion(method, METHODS, 'it knows')}")
    if len(frequency) < 2 or psd.shape != frequency.shape or not np.all(np.diff(frequency) > 0) or frequency[0] < 0:
        raise InputError("a random stress needs two or more ascending frequencies, with one value of the spectrum each")
    if not np.all(np.isfinite(psd)) or not psd.min() >= 0 or not duration >= 0:
        raise InputError("the spectrum of a random stress and its duration must be finite and not negative")
    if not psd.max() > 0:
        return _random(0.0, duration, 0.0, 0.0, method, ())
    return _expected(frequency, psd, curve, duration, method)


def _expected(frequency: np.ndarray, psd: np.ndarray, curve: SNCurve, duration: float, method: str) -> Fatigue:
    from FLife import Dirlik, Narrowband, SpectralData

    data = SpectralData(input={"PSD": psd, "f": frequency})
    notes = ()
    sigma = float(np.sqrt(data.moments[0]))
    if method == "dirlik" and 1 - data.alpha2 < NARROW:
        method = "narrow_band"
        notes = ("the stress has one narrow peak, of which cycles are Rayleigh's, not Dirlik's",)
    density, peaks = (Dirlik(data), data.m_p) if method == "dirlik" else (Narrowband(data), data.nu)
    low = curve.limit
    high = TAIL * sigma

    def rate(S: float) -> float:
        return float(density.get_PDF(S) / curve.life(S))

    breaks = [low, *(S for S in sorted((curve.knee_stress, 5 * sigma)) if low < S < high), max(low, high)]
    share = sum(scipy.integrate.quad(rate, a, b, epsabs=0.0, epsrel=1e-10, limit=200)[0] for a, b in pairwise(breaks))
    return _random(float(peaks * duration * share), duration, float(peaks * duration), 3 * sigma, method, notes)


def _random(damage: float, duration: float, cycles: float, largest: float, method: str, notes: tuple) -> Fatigue:
    none = np.zeros(0)
    return Fatigue(
        damage=damage,
        duration=duration,
        cycles=cycles,
        ranges=none,
        means=none,
        counts=none,
        largest=largest,
        method=method,
        notes=notes,
    )


def signed_von_mises(stress: np.ndarray) -> np.ndarray:
    """Return von Mises stress with the sign of the principal stress of the largest magnitude, for rainflow counts.

    Where two principal stresses of opposite signs are equal in size, as in pure shear, the sign jumps: the count is
    then on the safe side.

    Parameters
    ----------
    stress : (nt, 6)
        xx, yy, zz, xy, yz, xz, Pa.

    Returns
    -------
    (nt,) float
        Pa.

    References
    ----------
    Theory 12.2.

    Examples
    --------
    >>> signed_von_mises(np.array([[-3.0, 0, 0, 0, 0, 0], [0, 2.0, 0, 0, 0, 0]]))
    array([-3.,  2.])
    """
    x, y, z, xy, yz, xz = np.asarray(stress, dtype=float).T
    tensor = np.stack([np.stack([x, xy, xz], -1), np.stack([xy, y, yz], -1), np.stack([xz, yz, z], -1)], -2)
    principal = np.linalg.eigvalsh(tensor)
    a, b, c = principal.T
    size = np.sqrt(((a - b) ** 2 + (b - c) ** 2 + (c - a) ** 2) / 2)
    return np.where(principal[:, 2] >= -principal[:, 0], size, -size)
