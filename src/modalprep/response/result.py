"""A response: named channels over frequency or time, and their extremes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from modalprep.body.recovery import VON_MISES
from modalprep.drawing import Plotted
from modalprep.errors import InputError
from modalprep.records import Record
from modalprep.response.channels import MOST, Block, channel_name
from modalprep.suggest import suggestion
from modalprep.verdicts.notes import warnings_of, with_warnings

PARTS = ("force", "moment", "acceleration", "angular_acceleration", "displacement", "rotation")  # of interfaces
FULL = 200_000_000  # numbers of all curves in memory


class Peak(NamedTuple):
    """The extreme of one channel.

    Attributes
    ----------
    block, place, component : str
        Parts of the channel's name.
    unit : str
    largest : float
        The magnitude that is compared with what is allowed: the peak, or three sigma of a random response.
    figures : {name: float}
        What the kind of the response knows of the channel, such as ``rms`` and ``peak_hz``.
    margin : float
        ``allowable / largest - 1``; NaN where nothing is allowed.

    References
    ----------
    Theory 11.1.
    """

    block: str
    place: str
    component: str
    unit: str
    largest: float
    figures: dict[str, float]
    margin: float

    @property
    def channel(self) -> str:
        """Its name."""
        return channel_name(self.block, self.place, self.component)

    def row(self) -> dict[str, str | float]:
        """Return name, unit, figures and margin.

        Returns
        -------
        dict of str or float
            By column.
        """
        return {"channel": self.channel, "unit": self.unit, **self.figures, "margin": self.margin}


@dataclass(frozen=True, eq=False, kw_only=True)
class Response(Record, Plotted):
    """Channels of a body over an axis of frequency or time (`modalprep.response` says how they are named).

    Attributes
    ----------
    kind : str
        ``harmonic``, ``sweep``, ``random`` or ``transient``.
    axis : (nt,)
        Hz, or s of a transient.
    names, units : tuple of str, length m
        Of the channels with curves.
    values : (nt, m)
        Complex amplitudes of a harmonic response (von Mises stress: its largest value in a cycle), largest magnitudes
        around a frequency of a sweep, power spectral densities (unit squared per Hz) of a random response, values of a
        transient.
    peaks : tuple of Peak
        Of all channels, also those without curves.
    inputs : tuple of str, length k
    input_values : (nt, k)
        Amplitudes, densities or values.
    weight : (nt,) or None
        Hz: ``weight @ values`` is the integral of a random response over frequency.
    steady : (nt, m) or None
        Of a sweep: magnitudes of the harmonic response at the same frequencies.
    notes : tuple of str
        What was left out or approximated.
    chosen : tuple of str
        The channels that were asked for, or their beginnings; none is all.

    Raises
    ------
    InputError
        When a channel is asked for that is not there.

    Examples
    --------
    >>> found = Response(kind="transient", axis=np.arange(2.0), names=("tip.acceleration.x",), units=("m/s^2",),
    ...     values=np.array([[0.0], [3.0]]), peaks=(), inputs=("base.x",), input_values=np.zeros((2, 1)))
    >>> found["tip.acceleration.x"]
    array([0., 3.])
    """

    kind: str
    axis: np.ndarray
    names: tuple[str, ...]
    units: tuple[str, ...]
    values: np.ndarray
    peaks: tuple[Peak, ...]
    inputs: tuple[str, ...]
    input_values: np.ndarray
    weight: np.ndarray | None = None
    steady: np.ndarray | None = None
    notes: tuple[str, ...] = ()
    chosen: tuple[str, ...] = ()

    @property
    def warnings(self) -> tuple[str, ...]:
        """Those of the notes that say that values may be wrong, such as modes of the band that the body has not."""
        return warnings_of(self.notes)

    def __getitem__(self, name: str) -> np.ndarray:
        """Return the curve of a channel.

        Returns
        -------
        (nt,) float or complex
            A column of `values`.
        """
        if name not in self.names:
            raise InputError(f"the response has no curve {name!r}; {suggestion(name, self.names, 'it has')}")
        return self.values[:, self.names.index(name)]

    def peak(self, name: str) -> Peak:
        """Return the extreme of a channel.

        Returns
        -------
        Peak
            Also of a channel without a curve.

        Raises
        ------
        InputError
            When there is no such channel.
        """
        for peak in self.peaks:
            if peak.channel == name:
                return peak
        raise InputError(f"the response has no channel {name!r}; it begins with {self.peaks[0].channel!r}")

    def columns(self) -> dict[str, np.ndarray]:
        """Return the axis and the curves as real columns by name and unit; harmonic ones as amplitude and phase.

        Returns
        -------
        dict of (nt,) float
            In the order of the channels.
        """
        found = {"time (s)" if self.kind == "transient" else "frequency (Hz)": self.axis}
        for k, (name, unit) in enumerate(zip(self.names, self.units, strict=True)):
            values = self.values[:, k]
            found[f"{name} (({unit})^2/Hz)" if self.kind == "random" else f"{name} ({unit})"] = (
                np.abs(values) if self.kind == "harmonic" else values
            )
            if self.kind == "harmonic":
                found[f"{name} phase (deg)"] = np.degrees(np.angle(values))
            if self.steady is not None:
                found[f"{name} steady ({unit})"] = self.steady[:, k]
        return found

    def worst(self) -> list[Peak]:
        """Return the largest peak of each component: of each vector of an interface, of all places of a recovery.

        Of the channels that were chosen, and of those with a margin, whether chosen or not.

        Returns
        -------
        list of Peak
            In the order of the channels.
        """
        found: dict[tuple[str, ...], Peak] = {}
        for peak in self.peaks:
            if np.isnan(peak.margin) and not is_chosen(peak.channel, self.chosen):
                continue
            key = (peak.block, peak.component or peak.place, peak.unit, peak.place if peak.place in PARTS else "")
            if key not in found or peak.largest > found[key].largest:
                found[key] = peak
        return list(found.values())

    def __repr__(self) -> str:
        """Kind, number of channels and range."""
        unit = "s" if self.kind == "transient" else "Hz"
        span = f"{self.axis[0]:.4g}..{self.axis[-1]:.4g} {unit}"
        return with_warnings(f"Response({self.kind}, {len(self.peaks)} channels, {span})", self.notes)


def is_chosen(name: str, chosen: tuple[str, ...]) -> bool:
    """Whether a channel is one of the chosen or begins with one; all are where none is chosen.

    Examples
    --------
    >>> is_chosen("tip.force.x", ("tip.force",)), is_chosen("tip.force.x", ("tip.fo",)), is_chosen("tip.force.x", ())
    (True, False, True)
    """
    return not chosen or any(name == given or name.startswith(f"{given}.") for given in chosen)


class Collector:
    """Takes the values of the channels part by part: curves of those that are kept, peaks of all."""

    def __init__(self, chosen: tuple[str, ...] = ()) -> None:
        self.chosen = chosen
        self.met = set[str]()
        self.names: list[str] = []
        self.units: list[str] = []
        self.curves: list[np.ndarray] = []
        self.steady: list[np.ndarray] = []
        self.peaks: list[Peak] = []
        self.large: dict[str, int] = {}

    def keeps(self, block: Block, name: str) -> bool:
        """Whether a channel has a curve."""
        if block.is_large:
            self.large[block.name] = len(block.places) * len(block.components)
            return False
        hits = {given for given in self.chosen if is_chosen(name, (given,))}
        self.met |= hits
        return bool(hits) or not self.chosen

    def add(
        self,
        whole: Block,
        part: Block,
        curves: np.ndarray,
        figures: dict[str, np.ndarray],
        largest: str,
        steady: np.ndarray | None = None,
    ) -> None:
        """Take curves (nt, p, c) of a part of a block, and figures (p, c) of each; `largest` names the one to judge."""
        flat = curves.reshape(len(curves), -1)
        figures = {key: values.ravel() for key, values in figures.items()}
        for k, (place, component, unit) in enumerate(part.labels()):
            name = channel_name(whole.name, place, component)
            own = {key: float(values[k]) for key, values in figures.items()}
            judged = whole.mises is None or component == VON_MISES
            most = whole.allowable if judged and own[largest] > 0 else None
            ratio = np.nan if most is None else most / own[largest]
            self.peaks.append(Peak(whole.name, place, component, unit, own[largest], own, ratio - 1))
            if self.keeps(whole, name):
                self.names.append(name)
                self.units.append(unit)
                self.curves.append(flat[:, k].copy())
                if len(self.curves) * len(flat) > FULL:
                    raise InputError(f"the curves have more than {FULL} numbers; name fewer 'channels'")
                if steady is not None:
                    self.steady.append(steady.reshape(len(steady), -1)[:, k].copy())

    def notes(self) -> Iterator[str]:
        """Yield what has no curves."""
        for name, count in self.large.items():
            yield f"{name} has {count} channels, more than {MOST}: their peaks are listed, without curves"

    def response(
        self,
        kind: str,
        axis: np.ndarray,
        inputs: Iterable[str],
        input_values: np.ndarray,
        notes: Iterable[str],
        weight: np.ndarray | None = None,
    ) -> Response:
        """Return the response with the channels that were taken."""
        return Response(
            kind=kind,
            axis=axis,
            names=tuple(self.names),
            units=tuple(self.units),
            values=_columns(self.curves, len(axis)),
            peaks=tuple(self.peaks),
            inputs=tuple(inputs),
            input_values=input_values,
            weight=weight,
            steady=_columns(self.steady, len(axis)) if kind == "sweep" else None,
            notes=tuple(notes),
            chosen=self.chosen,
        )

    def refuse_unmet(self) -> None:
        """Refuse chosen channels that are not there."""
        known = [peak.channel for peak in self.peaks]
        for name in self.chosen:
            if name not in self.met and not any(is_chosen(x, (name,)) for x in known):
                raise InputError(f"response: there is no channel {name!r}; {suggestion(name, known[:60], 'there are')}")


def _columns(curves: list[np.ndarray], count: int) -> np.ndarray:
    return np.stack(curves, axis=1) if curves else np.zeros((count, 0))
