"""Force limits of vibration tests, and the notches that they and other limits cut into an input spectrum."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy

from modalprep.errors import InputError
from modalprep.records import Record

MAX_DEPTH = 14.0  # dB of a notch that nothing else is said of: a fifth of the amplitude
ABOVE = 1e-9  # relative, of a response over its limit that is not round-off
SIGMAS = 3.0  # standard deviations that count as the peak of a random response


@dataclass(frozen=True, eq=False, kw_only=True)
class Notch(Record):
    """A range of frequencies where one limit lowered an input.

    Attributes
    ----------
    start, end : float
        Hz, of the input's points that were lowered.
    frequency : float
        Of the deepest point, Hz.
    depth : float
        There, dB below the input: ``20 log10`` of the ratio of amplitudes.
    reason : str
        The limit that rules there.
    limited : bool
        Whether its largest depth stops it, so that the response exceeds the limit.
    """

    start: float
    end: float
    frequency: float
    depth: float
    reason: str
    limited: bool = False


@dataclass(frozen=True, eq=False, kw_only=True)
class NotchedInput(Record):
    """An input and what limits on responses leave of it.

    Attributes
    ----------
    frequency : (nf,) float
        Hz.
    given, notched : (nf,) float
        The input, as it was given: an amplitude, or a spectral density where `density`.
    density : bool
        Whether both are spectral densities.
    responses, limits : {name: (nf,)}
        Of each limited quantity the response to the notched input and its limit, in the same kind.
    notches : tuple of Notch
        From the lowest frequency to the highest.

    References
    ----------
    Theory 12.3.
    """

    frequency: np.ndarray
    given: np.ndarray
    notched: np.ndarray
    density: bool
    responses: dict[str, np.ndarray]
    limits: dict[str, np.ndarray]
    notches: tuple[Notch, ...]

    @property
    def depth(self) -> np.ndarray:
        """How far the notched input is below the given one.

        Returns
        -------
        (nf,) float
            dB, zero outside the notches.
        """
        share = np.divide(self.notched, self.given, out=np.ones_like(self.given), where=self.given > 0)
        return -(10 if self.density else 20) * np.log10(share) + 0.0

    @property
    def exceeded(self) -> dict[str, tuple[float, float]]:
        """Limits that responses to the notched input still exceed, as their notches would be deeper than allowed.

        Returns
        -------
        {name: (dB, Hz)}
            By how much, and where, at most.
        """
        found = {}
        for name, response in self.responses.items():
            ratio = response / self.limits[name]
            if ratio.max(initial=0.0) > 1 + ABOVE:
                k = int(np.argmax(ratio))
                found[name] = float((10 if self.density else 20) * np.log10(ratio[k])), float(self.frequency[k])
        return found


def notch(
    frequency: np.ndarray,
    given: np.ndarray,
    transfers: Mapping[str, np.ndarray],
    limits: Mapping[str, np.ndarray | float],
    *,
    density: bool,
    max_depth: float | Mapping[str, float] = MAX_DEPTH,
) -> NotchedInput:
    """Lower an input where a response would exceed its limit, so far that it equals it there.

    Parameters
    ----------
    frequency : (nf,)
        Hz, ascending.
    given : (nf,)
        The input: amplitudes (m/s^2), or its spectral density ((m/s^2)^2/Hz).
    transfers : {name: (nf,)}
        Response per input, such as interface force per base acceleration; complex or its magnitude.
    limits : {name: (nf,) or float}
        Of the responses: amplitudes (N, ...), or spectral densities; infinite where there is none.
    density : bool
        Whether the input and the limits are spectral densities.
    max_depth : float or {name: float}
        dB, of the notches that each limit may cut. Where it would need more, the response exceeds the limit
        (`NotchedInput.exceeded`).

    Returns
    -------
    NotchedInput

    Raises
    ------
    InputError
        When a limit has no transfer, shapes differ, or a limit or a depth is not positive.

    References
    ----------
    NASA-HDBK-7004C, Force Limited Vibration Testing, 2012. Theory 12.3.

    Examples
    --------
    >>> f, one = np.array([10.0, 20.0, 30.0]), np.ones(3)
    >>> found = notch(f, one, {"base": np.array([100.0, 2000.0, 50.0])}, {"base": 500.0}, density=False)
    >>> found.notched, found.notches[0].depth
    (array([1.  , 0.25, 1.  ]), 12.041199826559248)
    """
    frequency = np.asarray(frequency, dtype=float)
    given = np.asarray(given, dtype=float)
    power = 2 if density else 1
    gains = {name: np.abs(np.asarray(transfers[name])) ** power for name in _known(limits, transfers)}
    bounds = {name: np.broadcast_to(np.asarray(limits[name], dtype=float), given.shape) for name in limits}
    for name in limits:
        if gains[name].shape != given.shape or frequency.shape != given.shape:
            raise InputError(f"notch {name!r}: frequency, input and transfer need as many values; interpolate them")
        if not bounds[name].min() > 0:
            raise InputError(f"notch {name!r}: a limit of {bounds[name].min():g} allows no input; give a positive one")
    ceilings = np.array(
        [np.divide(bounds[n], gains[n], out=np.full(given.shape, np.inf), where=gains[n] > 0) for n in limits]
    ).reshape(len(limits), len(given))
    ceilings = np.maximum(ceilings, _floors(given, limits, max_depth, density))
    notched = np.minimum(given, ceilings.min(axis=0, initial=np.inf))
    ruling = np.argmin(ceilings, axis=0) if limits else np.zeros(len(given), dtype=int)
    found = NotchedInput(
        frequency=frequency,
        given=given,
        notched=notched,
        density=density,
        responses={name: gains[name] * notched for name in limits},
        limits=dict(bounds),
        notches=(),
    )
    return found.with_(notches=_notches(found, ruling, list(limits)))


def _known(limits: Mapping, transfers: Mapping) -> list[str]:
    for name in limits:
        if name not in transfers:
            raise InputError(f"the limit {name!r} has no transfer; there are {', '.join(transfers) or 'none'}")
    return list(limits)


def _floors(given: np.ndarray, names: Mapping, max_depth: float | Mapping[str, float], density: bool) -> np.ndarray:
    """Return the lowest inputs (limits, nf) to which each limit may cut."""
    depths = np.array([max_depth[n] if isinstance(max_depth, Mapping) else max_depth for n in names], dtype=float)
    if not np.all(depths > 0):
        raise InputError(f"the largest depth of a notch is {depths.min():g} dB; give a positive one")
    return given * 10.0 ** (-depths[:, None] / (10 if density else 20))


def _notches(notched: NotchedInput, ruling: np.ndarray, names: list[str]) -> tuple[Notch, ...]:
    lowered = notched.notched < notched.given
    depth = notched.depth
    rules = np.where(lowered, ruling, -1)
    edges = np.concatenate([[0], np.flatnonzero(np.diff(rules)) + 1, [len(rules)]])
    notches = []
    for first, after in ((a, b) for a, b in pairwise(edges.tolist()) if lowered[a]):
        k = first + int(np.argmax(depth[first:after]))
        ends = {
            "start": notched.frequency[first],
            "end": notched.frequency[after - 1],
            "frequency": notched.frequency[k],
        }
        numbers = {key: float(value) for key, value in (ends | {"depth": depth[k]}).items()}
        name = names[ruling[k]]
        over = notched.responses[name][k] > notched.limits[name][k] * (1 + ABOVE)
        notches.append(Notch(**numbers, reason=name, limited=bool(over)))
    return tuple(notches)


def force_limit(
    frequency: np.ndarray,
    acceleration: np.ndarray,
    *,
    mass: float,
    factor: float,
    break_frequency: float,
    rolloff: float = 1.0,
    density: bool,
) -> np.ndarray:
    """Return the semi-empirical limit of the interface force of a test article.

    The amplitude is ``C m A`` up to the break frequency and falls with ``(f_b / f)^n`` beyond; the spectral density is
    its square, ``C^2 m^2 S_A (f_b / f)^(2 n)``.

    Parameters
    ----------
    frequency : (nf,)
        Hz.
    acceleration : (nf,)
        The input at the interface: amplitudes (m/s^2) or its spectral density ((m/s^2)^2/Hz).
    mass : float
        Of the test article, kg.
    factor : float
        C, often from 1 to 1.5.
    break_frequency : float
        Usually that of the first mode of significant effective mass in this direction, Hz.
    rolloff : float
        n of the amplitude; the handbook's exponent of the spectral density is 2 n.
    density : bool
        Whether `acceleration` is a spectral density.

    Returns
    -------
    (nf,) float
        N, or N^2/Hz.

    Raises
    ------
    InputError
        When a number is not positive.

    References
    ----------
    T. D. Scharton, Force Limited Vibration Testing Monograph, NASA RP-1403, 1997. NASA-HDBK-7004C, 2012. Theory 12.3.

    Examples
    --------
    >>> f = np.array([20.0, 50.0, 100.0])
    >>> force_limit(f, np.ones(3), mass=10.0, factor=2.0, break_frequency=50.0, density=False)
    array([20., 20., 10.])
    """
    numbers = {"mass": mass, "factor": factor, "break_frequency": break_frequency}
    for name, value in numbers.items():
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"{name} of a force limit must be a positive number, not {value}")
    if not rolloff >= 0:
        raise InputError(f"rolloff of a force limit is {rolloff}, but it is zero or more")
    share = factor * mass * np.minimum(1.0, break_frequency / np.asarray(frequency, dtype=float)) ** rolloff
    return np.asarray(acceleration, dtype=float) * share ** (2 if density else 1)


def quasi_static_limit(
    frequency: np.ndarray,
    force: np.ndarray,
    *,
    mass: float,
    acceleration: float,
    density: bool,
    weight: np.ndarray | None = None,
) -> np.ndarray:
    """Return the limit that keeps the interface force within mass times the design acceleration.

    Parameters
    ----------
    frequency : (nf,)
        Hz, ascending.
    force : (nf,)
        Of the interface under the given input: amplitudes (N) or the spectral density (N^2/Hz).
    mass : float
        kg.
    acceleration : float
        Of the design, m/s^2.
    density : bool
        With a spectral density the limit is a level, at which the density is cut so that three standard deviations are
        the design force; it is infinite where they are less without a cut.
    weight : (nf,) or None
        Hz: ``weight @ force`` is the integral of a density, as in a `Response`; default the trapezoidal rule.

    Returns
    -------
    (nf,) float
        N, or N^2/Hz.

    Raises
    ------
    InputError
        When mass or acceleration are not positive.

    References
    ----------
    Theory 12.3.

    Examples
    --------
    >>> f = np.array([10.0, 20.0])
    >>> quasi_static_limit(f, np.array([100.0, 900.0]), mass=10.0, acceleration=50.0, density=False)
    array([500., 500.])
    """
    if not (mass > 0 and acceleration > 0):
        raise InputError(f"a quasi-static limit needs a positive mass and acceleration, not {mass} and {acceleration}")
    frequency = np.asarray(frequency)
    force = np.asarray(force, dtype=float)
    most = mass * acceleration
    if not density:
        return np.full(force.shape, most)

    def excess(level: float) -> float:
        cut = np.minimum(force, level)
        return float(SIGMAS * np.sqrt(np.trapezoid(cut, frequency) if weight is None else weight @ cut) - most)

    if excess(np.inf) <= 0:
        return np.full(force.shape, np.inf)
    return np.full(force.shape, scipy.optimize.brentq(excess, 0.0, float(force.max()), rtol=1e-14))
