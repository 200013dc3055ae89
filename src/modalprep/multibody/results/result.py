"""The outcome of a simulation: named time histories and how the run went."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from modalprep.drawing import Plotted
from modalprep.errors import InputError
from modalprep.extras import need
from modalprep.labelled import labelled
from modalprep.notebook import html_table
from modalprep.records import Record
from modalprep.suggest import refuse_other, suggestion
from modalprep.verdicts.notes import with_warnings

if TYPE_CHECKING:
    import pandas
    import xarray

    from modalprep.multibody.evaluation.impact import Impact
    from modalprep.multibody.evaluation.system_state import SystemState


STATS = {  # type of each entry of `Result.stats`
    "method": str,
    "steps": int,
    "evaluations": int,
    "rejected": int,
    "halved": int,
    "stiffness_ratio": float,
    "energy_error": float,
    "momentum_error": float,
    "momentum_restored": float,
}
NUMBERED = (".modal", ".modal_rate", ".modal_acceleration")  # channels whose components are numbers


@dataclass(frozen=True, eq=False, kw_only=True)
class Result(Record, Plotted):
    """Time histories by name; those of a simulation are columns of one array.

    Attributes
    ----------
    time : (nt,) float
        s.
    channels : dict of (nt,) or (nt, k) float
        ``<joint>.angle`` (rad), ``.rate``, ``.displacement`` (m), ``.speed`` by what the joint can do, and
        ``.acceleration`` of its coordinates (m/s^2, rad/s^2, travels before turns), ``.drive`` of
        its prescribed motion or hinge elements (N or N m, along the hinge), ``.quaternion`` (nt, 4) of a spherical
        joint, ``.angular_velocity`` (nt, 3, rad/s, in the child's axes) of it and of a free one, and its rate
        ``.angular_acceleration``; ``.force``, ``.torque`` (nt, 3):
        what the parent exerts on the child at the child's root, drives included, in the axes of the parent's interface
        (N, N m). ``<body>.mass`` (kg) of a body that loses it, ``<body>.modal`` (nt, n), ``.origin`` (nt, 3, inertial,
        m) and ``.orientation`` (nt, 4, quaternion w, x, y, z) of the body's frame; ``<body>.semi_major_axis`` (m) of
        the orbit of its root, in orbit at a known radius. ``<body>.stress.<point>.<component>`` (Pa) at the points of
        its modal file, and ``.von_mises``; ``<body>.recovery.<name>.<place>.<component>`` of recoveries of up to 1000
        numbers, and what they follow from: ``<body>.frame_acceleration`` (less gravity), ``.frame_angular_velocity``,
        ``.frame_angular_acceleration`` in the axes of the body, ``.modal_rate``, ``.modal_acceleration``, and
        ``.interface_loads`` (nt, 6 interfaces: force and moment on each). ``<spring>.length`` (m) and ``.tension`` (N),
        ``<conductor>.current`` (A) and ``.emf`` (V).
        ``<body>.<interface>.position`` (nt, 3, inertial, m), ``.velocity``, ``.acceleration``, ``.deflection`` (in the
        body frame, m), and the audit ``energy.kinetic``, ``energy.strain``, ``energy.gravity``, ``energy.stored``
        (springs, accelerated water), ``energy.work``, ``energy.error`` (J), ``power.input`` (W, the rate of the work),
        ``momentum.linear``, ``momentum.angular`` (nt, 3) of the system about the inertial origin; ``momentum.error`` of
        the parts that nothing holds or loads: how far their momenta are from those of the start, the angular one about
        the mass centre, in shares of the largest that they can be with the energy of the part.
    status : str
        ``done``, or ``diverged`` when a deflection grew beyond the validity of the modal body, or a bushing or
        rotational spring passed half a turn.
    message : str
        A message for the user.
    stats : dict
        How the run went. ``method`` (str): the method at its end, as `simulate` takes it. ``steps``, ``evaluations``
        of the equations, ``rejected`` and ``halved`` steps (int). ``stiffness_ratio`` (float): with the method "auto",
        the steps that stability would require of the explicit method. ``energy_error`` (float): largest error of the
        energy balance over its largest part. ``momentum_error`` (float): where there are parts that nothing holds or
        loads, the largest ``momentum.error``; ``momentum_restored``: what the steps lost and were given back, in all.
    events : dict of (k,) float
        Times (s) of every event's zero crossings.
    impacts : dict of tuple of Impact
        The impulses of events that activate closures or act as impacts.
    state : SystemState or None
        Where the run ended, at which another one can start; None of results that are not of `simulate`.
    notes : tuple of str
        What the user should know about the validity of the run, such as deflections beyond the theory.

    Examples
    --------
    >>> r = Result(time=np.array([0.0, 1.0]), channels={"a.position": np.array([[0., 1, 2], [3, 4, 5]])},
    ...            status="done", message="", stats={})
    >>> r["a.position.y"]
    array([1., 4.])
    """

    time: np.ndarray
    channels: dict[str, np.ndarray]
    status: str
    message: str
    stats: dict[str, Any] = field(default_factory=dict)
    events: dict[str, np.ndarray] = field(default_factory=dict)
    impacts: dict[str, tuple[Impact, ...]] = field(default_factory=dict)
    state: SystemState | None = None
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        """Status, span of time and number of channels."""
        span = f"{self.time[0]:.4g}..{self.time[-1]:.4g} s in {len(self.time)} times" if len(self.time) else "no times"
        return with_warnings(f"Result({self.status}, {span}, {len(self.channels)} channels)", self.notes)

    def _repr_html_(self) -> str:
        """Return the channels with their smallest, largest and last values as an HTML table."""
        rows = [[name, *_extremes(values)] for name, values in self.table().items()]
        return html_table(repr(self), ["channel", "smallest", "largest", "last"], rows)

    def __getitem__(self, name: str) -> np.ndarray:
        """Return a channel, or one component of it by a trailing ``.x``, ``.y``, ``.z`` or ``.<number>``.

        Returns
        -------
        (nt,) or (nt, k) float
            In the unit of the channel.
        """
        refuse_other("Result: the name of a channel", str, name)
        if name in self.channels:
            return self.channels[name]
        parent, _, component = name.rpartition(".")
        k = component_number(component, self._components(parent))
        if k >= 0:
            return self.channels[parent][:, k]
        raise InputError(f"the result has no channel {name!r}; {suggestion(name, sorted(self.channels), 'it has')}")

    def __contains__(self, name: object) -> bool:
        """Say whether there is a channel, or a component of one, of this name."""
        parent, _, component = str(name).rpartition(".")
        return name in self.channels or component_number(component, self._components(parent)) >= 0

    def __iter__(self) -> Iterator[str]:
        """Go through the names of the channels."""
        return iter(self.channels)

    def columns(self) -> dict[str, list[str]]:
        """Return the component names of every channel with more than one column.

        Returns
        -------
        dict of list of str
            ``x``, ``y``, ``z`` or ``1``, ``2``, ... by the channel's name.
        """
        return {name: self._components(name) for name, a in self.channels.items() if a.ndim == 2}

    def _components(self, name: str) -> list[str]:
        """Return the component names of one channel, none where it is no vector."""
        channel = self.channels.get(name)
        if channel is None or channel.ndim < 2:
            return []
        return component_names(name, channel.shape[1])

    def relative_to(self, body: str) -> Result:
        """Return the run with all positions, the channels ``.position`` and ``.origin``, in the frame of a body.

        Returns
        -------
        Result
            The places in m, in the axes of that body; the other channels as they were.

        Raises
        ------
        InputError
            When there is no such body.

        Examples
        --------
        >>> turned = {"hub.origin": [[1.0, 0, 0]], "hub.orientation": [[0.5**0.5, 0, 0, 0.5**0.5]]}
        >>> channels = {name: np.array(a) for name, a in turned.items()} | {"arm.tip.position": np.array([[1.0, 2, 0]])}
        >>> run = Result(time=np.zeros(1), channels=channels, status="done", message="")
        >>> run.relative_to("hub")["arm.tip.position"].round(9) + 0.0
        array([[2., 0., 0.]])
        """
        from_quaternion = scipy.spatial.transform.Rotation.from_quat
        origin = self[f"{body}.origin"]
        rotation = from_quaternion(self[f"{body}.orientation"], scalar_first=True)
        positions = {name: a for name, a in self.channels.items() if name.endswith((".position", ".origin"))}
        relative = {name: rotation.inv().apply(a - origin) for name, a in positions.items()}
        return self.with_(channels=self.channels | relative)

    def to_dataframe(self, channels: Sequence[str] = ()) -> pandas.DataFrame:
        """Return the named channels (all when none is named) as columns over time, one per component.

        Returns
        -------
        pandas.DataFrame
            A row for each time (s), a column for each component.

        Raises
        ------
        InputError
            When pandas is not installed, or there is no such channel.

        Examples
        --------
        >>> r = Result(time=np.array([0.0, 1.0]), channels={"a.angle": np.array([0.0, 2.0])}, status="done", message="")
        >>> list(r.table())
        ['a.angle']
        """
        need("pandas", "a data frame")
        import pandas

        return pandas.DataFrame(self.table(channels), index=pandas.Index(self.time, name="time"))

    def to_xarray(self, channels: Sequence[str] = ()) -> xarray.Dataset:
        """Return the named channels (all when none is named) as labelled arrays.

        Returns
        -------
        xarray.Dataset
            A variable for each channel, of dimension ``time`` (s), and one with the components of a vector.
            The status, the message and the notes are attributes.

        Raises
        ------
        InputError
            When xarray is not installed, or there is no such channel.
        """
        told = {"status": self.status, "message": self.message, "notes": list(self.notes)}
        return labelled(self, channels or self.channels, self._components, {"time": self.time}, told)

    def table(self, channels: Sequence[str] = ()) -> dict[str, np.ndarray]:
        """Return the named channels (all when none is named), one (nt,) per component, by name.

        Returns
        -------
        dict of (nt,) float
            By the channel's name and component, such as ``arm.tip.position.x``.
        """
        components = self.columns()
        names = [
            [f"{name}.{c}" for c in components[name]] if name in components else [name]
            for name in channels or sorted(self.channels)
        ]
        return {part: self[part] for parts in names for part in parts}


def _extremes(values: np.ndarray) -> list[float]:
    """Return the smallest, the largest and the last value; NaN where there is none."""
    known = values[np.isfinite(values)]
    if not len(known):
        return [np.nan] * 3
    return [float(known.min()), float(known.max()), float(values[-1])]


def component_names(channel: str, count: int) -> list[str]:
    """Return the names of the components of a channel.

    Examples
    --------
    >>> component_names("arm.tip.position", 3), component_names("arm.modal", 3)
    (['x', 'y', 'z'], ['1', '2', '3'])
    """
    return list("xyz") if count == 3 and not channel.endswith(NUMBERED) else [str(i + 1) for i in range(count)]


def component_number(component: str, names: Sequence[str]) -> int:
    """Return which one of the named components this is, by its name or its number from 1; -1 where it is none.

    Examples
    --------
    >>> component_number("y", "xyz"), component_number("2", "xyz"), component_number("4", "xyz")
    (1, 1, -1)
    """
    numbers = [str(k + 1) for k in range(len(names))]
    return next((list(known).index(component) for known in (names, numbers) if component in known), -1)


def output_times(t_end: float, output_step: float) -> np.ndarray:
    """Return the times (nt,) of a run: equal steps, the nearest to `output_step` that end at `t_end`.

    Examples
    --------
    >>> output_times(1.0, 0.3)
    array([0.        , 0.33333333, 0.66666667, 1.        ])
    """
    return np.linspace(0.0, t_end, max(2, round(t_end / output_step) + 1))
