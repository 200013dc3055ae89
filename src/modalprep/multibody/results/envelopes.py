"""Extreme values of recovered quantities over a run, with their times and margins (theory 4.9)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.recovery import VON_MISES, BodyMotion, Recovery
from modalprep.errors import InputError
from modalprep.multibody.results.recovered import body_motion
from modalprep.multibody.results.result import Result
from modalprep.records import Record

AT_ONCE = 4_000_000  # numbers of a history in memory


@dataclass(frozen=True, eq=False, kw_only=True)
class Envelope(Record):
    """Extreme values of one recovery over a run: p places with c components each.

    Attributes
    ----------
    body, name : str
        Of the body in the system, and of its recovery.
    places, components : tuple of str
        p and c names; of stress von Mises stress is the last component.
    units : tuple of str
        Of the components, or of each place's components.
    highest, lowest : (p, c)
    highest_time, lowest_time : (p, c)
        s, of the first of equal values.
    allowable : float or None
        Of the recovery.

    Examples
    --------
    >>> strut = Envelope(body="a", name="b", places=("c",), components=("N",), units=("N",), highest=np.array([[3.0]]),
    ...     lowest=np.array([[-4.0]]), highest_time=np.ones((1, 1)), lowest_time=np.zeros((1, 1)), allowable=5.0)
    >>> strut.margin, strut.largest
    (array([[0.25]]), array([[4.]]))
    """

    body: str
    name: str
    places: tuple[str, ...]
    components: tuple[str, ...]
    units: tuple[str, ...]
    highest: np.ndarray
    lowest: np.ndarray
    highest_time: np.ndarray
    lowest_time: np.ndarray
    allowable: float | None = None

    @property
    def largest(self) -> np.ndarray:
        """(p, c) largest magnitudes."""
        return np.maximum(np.abs(self.highest), np.abs(self.lowest))

    @property
    def margin(self) -> np.ndarray:
        """(p, c) ``allowable / largest - 1``: negative where it is exceeded; NaN where nothing is allowed or known.

        Of stress it is that of von Mises stress alone.

        References
        ----------
        Theory 4.9.
        """
        found = np.full(self.highest.shape, np.nan)
        if self.allowable is not None:
            some = slice(-1, None) if self.components[-1] == VON_MISES else slice(None)
            with np.errstate(divide="ignore"):
                found[:, some] = self.allowable / self.largest[:, some] - 1
        return found

    def rows(self) -> list[dict[str, str | float]]:
        """Return a row for each place and component: names, unit, extremes with times, margin.

        Returns
        -------
        list of dict
            In the order of the places.
        """
        margin = self.margin
        return [self._row(i, j, margin) for i in range(len(self.places)) for j in range(len(self.components))]

    def worst(self) -> list[dict[str, str | float]]:
        """Return the row of the place with the largest magnitude of each component.

        Returns
        -------
        list of dict
            As `rows`, one for each component.
        """
        margin = self.margin
        return [self._row(i, j, margin) for j, i in enumerate(np.argmax(self.largest, axis=0).tolist())]

    def _row(self, i: int, j: int, margin: np.ndarray) -> dict[str, str | float]:
        """Return the row of a place and a component."""
        return {
            "body": self.body,
            "recovery": self.name,
            "place": self.places[i],
            "component": self.components[j],
            "unit": self.units[(i * len(self.components) + j) % len(self.units)],
            "highest": float(self.highest[i, j]),
            "at_s": float(self.highest_time[i, j]),
            "lowest": float(self.lowest[i, j]),
            "lowest_at_s": float(self.lowest_time[i, j]),
            "margin": float(margin[i, j]),
        }


def envelopes(result: Result, bodies: Mapping[str, FlexibleBody]) -> tuple[Envelope, ...]:
    """Return the envelope of every recovery of the bodies over a run.

    Parameters
    ----------
    result : Result
        Of a simulation of these bodies.
    bodies : {name: FlexibleBody}
        ``System.bodies``.

    Returns
    -------
    tuple of Envelope
        By body and recovery; without recoveries that need accelerations where the run has none.

    Raises
    ------
    InputError
        When the run has no times, or is not one of these bodies.

    References
    ----------
    Theory 4.9.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> run = Result(time=np.zeros(1), channels={"arm.modal": np.zeros((1, 1))}, status="done", message="")
    >>> envelopes(run, {"arm": uniform_beam(modes=1)})
    ()
    """
    found = []
    for name, body in bodies.items():
        if not body.recovery or not body.n:
            continue
        if not len(result.time) or f"{name}.modal" not in result:
            raise InputError(f"the run has no times of body {name!r}; give a run of a system with these bodies")
        motion = body_motion(body, name, result.channels)
        complete = f"{name}.modal_acceleration" in result
        for key, block in body.recovery.items():
            if complete or not block.moves:
                found.append(_envelope(name, key, block, motion, result.time))
    return tuple(found)


def _envelope(body: str, name: str, block: Recovery, motion: BodyMotion, time: np.ndarray) -> Envelope:
    step = max(1, AT_ONCE // max(1, len(block.places) * (len(block.components) + 1)))
    parts = [
        _extremes(block.full_values(BodyMotion(*(x[start : start + step] for x in motion))), time[start : start + step])
        for start in range(0, len(time), step)
    ]
    highest, high_time, lowest, low_time = (np.stack(x) for x in zip(*parts, strict=True))
    at_high = np.argmax(highest, axis=0)[None]
    at_low = np.argmin(lowest, axis=0)[None]
    extremes = {"highest": (highest, at_high), "highest_time": (high_time, at_high)}
    extremes |= {"lowest": (lowest, at_low), "lowest_time": (low_time, at_low)}
    return Envelope(
        body=body,
        name=name,
        places=block.places,
        components=block.full_components,
        units=block.full_units,
        allowable=block.allowable,
        **{key: np.take_along_axis(values, at, 0)[0] for key, (values, at) in extremes.items()},
    )


def _extremes(values: np.ndarray, time: np.ndarray) -> tuple[np.ndarray, ...]:
    high = np.argmax(values, axis=0)
    low = np.argmin(values, axis=0)
    at = [np.take_along_axis(values, i[None], 0)[0] for i in (high, low)]
    return at[0], time[high], at[1], time[low]
