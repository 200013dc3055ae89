"""The deployed length over time: its smooth intervals, the initial stage, and when it leaves a range of lengths."""

from __future__ import annotations

import numpy as np
import scipy

from modalprep.errors import InputError
from modalprep.multibody.model.deployment import EXACT, IN, OUT, Change, Deployment, Stage
from modalprep.multibody.model.time_function import FOREVER, Piece, TimeFunction

SAMPLES = 20_000  # of the deployed length; between two of them it is assumed to cross a length at most once


def smooth_intervals(d: Deployment) -> list[tuple[float, TimeFunction]]:
    """Return the intervals ``(until, length)`` in which the deployed length has a continuous rate.

    Raises
    ------
    InputError
        When the length is discontinuous.

    Examples
    --------
    >>> law = [(2.0, "t"), (3.0, "2"), (float("inf"), "2")]
    >>> boom = Deployment(name="boom", parent="ground", length=9.0, segments=9, mass_per_length=1.0,
    ...                   deployed_length=law)
    >>> [until for until, _ in smooth_intervals(boom)]
    [2.0, inf]
    """
    found, pieces = [], []
    for k, (until, what) in enumerate(_law(d).given):
        pieces.append((until, what))
        if until == FOREVER or k == len(_law(d).pieces) - 1:
            found.append((FOREVER, TimeFunction(pieces)))
        elif _rate_jumps(d, until, *_law(d).pieces[k : k + 2]):
            found.append((until, TimeFunction([*pieces[:-1], (FOREVER, what)])))
            pieces = []
    return found


def _rate_jumps(d: Deployment, t: float, left: Piece, right: Piece) -> bool:
    a, b = (piece.evaluate(np.array([t]))[:, 0] for piece in (left, right))
    if abs(b[0] - a[0]) > EXACT * d.rod_length:
        raise InputError(f"deployment {d.name!r}: deployed_length jumps from {a[0]:g} to {b[0]:g} m at t = {t:g} s")
    return abs(b[1] - a[1]) > 1e-9 * max(abs(a[1]), abs(b[1]))


def first_stage(d: Deployment) -> Stage:
    """Return the stage of a deployment at the start.

    Raises
    ------
    InputError
        When the deployed length is not between zero and the total length.
    """
    out, speed = d.start
    if not -EXACT * d.rod_length <= out <= d.length + EXACT * d.rod_length:
        raise InputError(
            f"deployment {d.name!r}: deployed_length = {out:g} m at the start, but length = {d.length:g} m"
        )
    rods = int(np.floor(out / d.rod_length + EXACT)) + 1
    if abs(out / d.rod_length - (rods - 1)) < EXACT and speed <= 0:
        rods -= 1
    rods = min(max(rods, 1), d.segments)
    locked = out - (rods - 1) * d.rod_length < d.free_rod_length
    return Stage(rods=rods, locked=locked, length=smooth_intervals(d)[0][1] if d.deployed_length is not None else None)


def samples(d: Deployment, t_end: float) -> tuple[np.ndarray, np.ndarray]:
    """Return samples of the prescribed length: times (s) and lengths (m), each (SAMPLES + 1,).

    Raises
    ------
    InputError
        When it is not between zero and the total length.
    """
    t = np.linspace(0.0, t_end, SAMPLES + 1)
    begin = 0.0
    length = np.zeros_like(t)
    for piece in _law(d).pieces:
        here = t >= begin
        length[here] = piece.evaluate(t[here])[0]
        begin = piece.until
    length[t >= d.stop_time] = _law(d)(min(d.stop_time, t_end))[0]
    wrong = ~((length >= -EXACT * d.rod_length) & (length <= d.length + EXACT * d.rod_length))
    if np.any(wrong):
        first = np.flatnonzero(wrong)[0]
        raise InputError(
            f"deployment {d.name!r}: deployed_length = {length[first]:g} m at t = {t[first]:g} s; it must be "
            f"between 0 and length = {d.length:g} m"
        )
    return t, length


def next_exit(d: Deployment, k: int, bounds: tuple[float, float], t: float, sampled: tuple) -> Change:
    """Return when the prescribed length first leaves a range (m) after time t, according to its samples.

    Examples
    --------
    >>> boom = Deployment(name="boom", parent="ground", length=4.0, segments=4, mass_per_length=1.0,
    ...                   deployed_length="0.5 + t")
    >>> next_exit(boom, 0, (0.0, 1.0), 0.0, samples(boom, t_end=2.0))
    Change(t=0.5, k=0, kind='out')
    """
    times, length = sampled
    slack = EXACT * d.rod_length
    after = np.flatnonzero((times > t) & ((length > bounds[1] + slack) | (length < bounds[0] - slack)))
    if not len(after):
        return Change(FOREVER, k, "")
    i = after[0]
    what, bound = (OUT, bounds[1]) if length[i] > bounds[1] else (IN, bounds[0])
    a = max(t, times[i - 1])
    b = times[i]
    sides = [_law(d)(s)[0] - bound for s in (a, b)]
    if sides[0] * sides[1] >= 0:
        return Change(float(a), k, what)
    end = scipy.optimize.brentq(lambda s: _law(d)(s)[0] - bound, a, b, xtol=1e-15 * times[-1])
    return Change(float(end), k, what)


def alignment_angle(t: float, angle: float, rate: float, within: float) -> TimeFunction | None:
    """Return an angle that decays smoothly to zero from a value and rate at time t, or None when both are zero.

    Examples
    --------
    >>> tilt = alignment_angle(2.0, 0.1, -0.3, 0.5)
    >>> [round(x, 9) for x in tilt(2.0)[:2]], tilt(2.5)[:2]
    ([0.1, -0.3], (0.0, 0.0))
    """
    if angle == 0.0 and rate == 0.0:
        return None
    s = f"((t - {t!r})/{within!r})"
    path = f"(1 - {s})**2*({angle!r} + {2 * angle + rate * within!r}*{s})"
    return TimeFunction([(t, f"{angle!r} + {rate!r}*(t - {t!r})"), (t + within, path), (FOREVER, 0.0)])


def _law(d: Deployment) -> TimeFunction:
    assert d.deployed_length is not None  # a free reel comes here never
    return d.deployed_length
