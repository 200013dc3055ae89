"""The outcome of an ensemble: histories of chosen channels for every case, and their statistics."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from modalprep.drawing import Plotted
from modalprep.errors import InputError
from modalprep.extras import need
from modalprep.labelled import labelled
from modalprep.multibody.results.result import component_names, component_number
from modalprep.notebook import html_table
from modalprep.records import Record
from modalprep.suggest import refuse_other, suggestion
from modalprep.verdicts.notes import with_warnings

if TYPE_CHECKING:
    import pandas
    import xarray

DONE, DIVERGED, FAILED, WAITING = "done", "diverged", "failed", "waiting"
PERCENTILES = (5.0, 50.0, 95.0)
OUTCOMES = ("final", "smallest", "largest")
NOTED = "; "  # between the message of a run and its notes


@dataclass(frozen=True, eq=False, kw_only=True)
class Ensemble(Record, Plotted):
    """Histories of a system for n cases; NaN after the end of a case, and everywhere in one that failed.

    Attributes
    ----------
    cases : dict of (n,) float
        Values by parameter.
    time : (nt,) float
        s.
    channels : dict of (n, nt) or (n, nt, k) float
        As in `Result`, but the first index is the case.
    status : tuple of str
        Of every case: ``done``, ``diverged``, ``failed``, or ``waiting`` when it was not run.
    message : tuple of str
        Of every case, that of its `Result` or of its error.
    end : (n,) float
        s, where the run ended: the last time, or that of a terminal event or a divergence.
    energy_error : (n,) float
        Error of the energy balance relative to the largest energy.
    momentum_error : (n,) float
        Error of the momenta of what nothing holds or loads, see `Result.stats`; NaN, the default, where all is held.
    audit : tuple of str
        Why energy or momenta of a case are not trusted, "" where they are; none is "" for all.
    events : dict of (n,) float
        s, first time of each event; NaN where it did not occur.

    Examples
    --------
    >>> three = Ensemble(cases={"hinge.angle": np.arange(3.0)}, time=np.array([0.0, 1.0]), status=("done",) * 3,
    ...                  channels={"hinge.angle": np.array([[0.0, 1.0], [1.0, 3.0], [2.0, 5.0]])}, message=("",) * 3,
    ...                  end=np.ones(3), energy_error=np.zeros(3))
    >>> three["hinge.angle"][:, -1], three.percentiles([50])["hinge.angle"]
    (array([1., 3., 5.]), array([[1., 3.]]))
    """

    cases: dict[str, np.ndarray]
    time: np.ndarray
    channels: dict[str, np.ndarray]
    status: tuple[str, ...]
    message: tuple[str, ...]
    end: np.ndarray
    energy_error: np.ndarray
    momentum_error: np.ndarray = field(default_factory=lambda: np.zeros(0))
    audit: tuple[str, ...] = ()
    events: dict[str, np.ndarray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Give every case an entry of the audits."""
        if not len(self.momentum_error):
            object.__setattr__(self, "momentum_error", np.full(len(self.status), np.nan))
        object.__setattr__(self, "audit", self.audit or ("",) * len(self.status))
        super().__post_init__()

    def __len__(self) -> int:
        """Number of cases."""
        return len(self.status)

    def __repr__(self) -> str:
        """Numbers of cases by their status, span of time, number of channels."""
        counts = [f"{self.status.count(name)} {name}" for name in dict.fromkeys(self.status)]
        span = f"{self.time[0]:.4g}..{self.time[-1]:.4g} s in {len(self.time)} times"
        text = f"Ensemble({len(self)} cases: {', '.join(counts)}; {span}, {len(self.channels)} channels)"
        return with_warnings(text, self.notes)

    def _repr_html_(self) -> str:
        """Return the percentiles of the final values as an HTML table."""
        rows = [[row[0], *row[2:]] for row in self.statistics() if row[1] == "final"]
        return html_table(repr(self), ["final value of", *statistics_head()[2:]], rows)

    def __getitem__(self, name: str) -> np.ndarray:
        """Return a channel, or one component of it by a trailing ``.x``, ``.y``, ``.z`` or ``.<number>``.

        Returns
        -------
        (n, nt) or (n, nt, k) float
            In the unit of the channel.
        """
        refuse_other("Ensemble: the name of a channel", str, name)
        if name in self.channels:
            return self.channels[name]
        parent, _, component = name.rpartition(".")
        k = component_number(component, self._parts(parent))
        if k >= 0:
            return self.channels[parent][:, :, k]
        raise InputError(f"the ensemble has no channel {name!r}; {suggestion(name, self.channels, 'it has')}")

    def _parts(self, name: str) -> list[str]:
        """Return the names of a channel's components; none of a channel with one."""
        values = self.channels.get(name)
        if values is None or values.ndim == 2:
            return []
        return component_names(name, values.shape[2])

    def table(self, channels: Sequence[str] = ()) -> dict[str, np.ndarray]:
        """Return the named channels (all when none is named), one (n, nt) per component, by name.

        Returns
        -------
        dict of (n, nt) float
            By the channel's name and component, such as ``arm.tip.position.x``.
        """
        names = channels or list(self.channels)
        parts = [f"{name}.{part}" if part else name for name in names for part in self._parts(name) or [""]]
        return {part: self[part] for part in parts}

    def percentiles(self, levels: Iterable[float] = PERCENTILES, channels: Sequence[str] = ()) -> dict[str, np.ndarray]:
        """Return percentiles of channels over the cases that have a value at each time.

        Parameters
        ----------
        levels : sequence of float
            Percent, 0 to 100.
        channels : sequence of str
            All when none is named.

        Returns
        -------
        dict of (levels, nt) or (levels, nt, k) float
            By channel; NaN where no case has a value.
        """
        levels = _levels(levels)
        return {name: _percentiles(self[name], levels) for name in channels or self.channels}

    def outcomes(self, channels: Sequence[str] = ()) -> dict[tuple[str, str], np.ndarray]:
        """Return the last, the smallest and the largest value of each component in every case.

        Returns
        -------
        dict of (n,) float
            By component and one of ``final``, ``smallest``, ``largest``; NaN for a case without values.
        """
        found = {}
        for name, values in self.table(channels).items():
            known = np.isfinite(values)
            some = known.any(axis=1)
            last = values.shape[1] - 1 - np.argmax(known[:, ::-1], axis=1)
            each = (
                values[np.arange(len(values)), last],
                np.where(known, values, np.inf).min(axis=1, initial=np.inf),
                np.where(known, values, -np.inf).max(axis=1, initial=-np.inf),
            )
            found |= {(name, kind): np.where(some, x, np.nan) for kind, x in zip(OUTCOMES, each, strict=True)}
        return found

    def statistics(
        self, levels: Iterable[float] = PERCENTILES, channels: Sequence[str] = ()
    ) -> list[tuple[str | float, ...]]:
        """Return a row for each of `outcomes`: component, kind, mean, standard deviation, percentiles.

        Returns
        -------
        list of tuple
            Numbers in the unit of the channel, of the cases that have them; the deviation is that of a sample.
        """
        levels = _levels(levels)
        rows = []
        for (name, kind), values in self.outcomes(channels).items():
            known = values[np.isfinite(values)]
            mean = known.mean() if len(known) else np.nan
            deviation = known.std(ddof=1) if len(known) > 1 else np.nan
            rows.append((name, kind, float(mean), float(deviation), *_percentiles(values, levels).tolist()))
        return rows

    @property
    def failures(self) -> tuple[str, ...]:
        """A sentence for every case that did not reach its end or failed its audit: number from 0, values, cause.

        Returns
        -------
        tuple of str
            Empty when all cases are done.
        """
        unfinished = {k: f"{status}: {self.message[k]}" for k, status in enumerate(self.status) if status != DONE}
        doubtful = {k: f"failed its audit: {why}" for k, why in enumerate(self.audit) if why}
        return tuple(self.describe(k, what) for k, what in sorted((doubtful | unfinished).items()))

    @property
    def notes(self) -> tuple[str, ...]:
        """What runs that are done note, such as events that may be missed, once each with the number of their cases.

        Returns
        -------
        tuple of str
            As `Result.notes` has it.
        """
        ended = (said for said, status in zip(self.message, self.status, strict=True) if status == DONE)
        counts = Counter(found for said in ended if (found := said.partition(NOTED)[2]))
        return tuple(f"{found} ({count} of {len(self)} cases)" for found, count in counts.items())

    def describe(self, case: int, what: str) -> str:
        """Return a sentence about a case, with its values.

        Returns
        -------
        str
            Number of the case, its values, what is said.
        """
        values = ", ".join(f"{name} = {values[case]:.6g}" for name, values in self.cases.items())
        return f"case {case} ({values}) {what}"

    def to_dataframe(self, channels: Sequence[str] = ()) -> pandas.DataFrame:
        """Return the named channels (all when none is named) as columns, one per component.

        Returns
        -------
        pandas.DataFrame
            A row for each case and time (s).

        Raises
        ------
        InputError
            When pandas is not installed, or there is no such channel.
        """
        need("pandas", "a data frame")
        import pandas

        index = pandas.MultiIndex.from_product([range(len(self)), self.time], names=["case", "time"])
        return pandas.DataFrame({name: values.ravel() for name, values in self.table(channels).items()}, index=index)

    def to_xarray(self, channels: Sequence[str] = ()) -> xarray.Dataset:
        """Return the named channels (all when none is named) as labelled arrays.

        Returns
        -------
        xarray.Dataset
            A variable for each channel, of dimensions ``case`` and ``time`` (s), and one with the components of a
            vector. Parameters, ``status``, ``message`` and ``end`` are coordinates of the cases, parameters as
            ``parameter.<name>``.

        Raises
        ------
        InputError
            When xarray is not installed, or there is no such channel.
        """
        axes: dict[str, Any] = {"case": np.arange(len(self)), "time": self.time, "end": ("case", self.end)}
        axes |= {f"parameter.{name}": ("case", values) for name, values in self.cases.items()}
        axes |= {"status": ("case", list(self.status)), "message": ("case", list(self.message))}
        return labelled(self, channels or self.channels, self._parts, axes)


def statistics_head(levels: Iterable[float] = PERCENTILES) -> list[str]:
    """Return the names of the columns of `Ensemble.statistics`.

    Examples
    --------
    >>> statistics_head([2.5, 50])
    ['channel', 'value', 'mean', 'deviation', 'p2.5', 'p50']
    """
    return ["channel", "value", "mean", "deviation", *(f"p{level:g}" for level in levels)]


def _levels(levels: Iterable[float]) -> list[float]:
    found = [float(level) for level in levels]
    if not found or not all(0 <= level <= 100 for level in found):
        raise InputError(f"percentiles {found} must be numbers from 0 to 100")
    return found


def _percentiles(values: np.ndarray, levels: Sequence[float]) -> np.ndarray:
    """Return percentiles over the first index, without NaN."""
    if np.all(np.isfinite(values)):
        return np.percentile(values, levels, axis=0)
    with warnings.catch_warnings():  # where no case has a value
        warnings.simplefilter("ignore", RuntimeWarning)
        return np.nanpercentile(np.where(np.isfinite(values), values, np.nan), levels, axis=0)
