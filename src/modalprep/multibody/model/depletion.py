"""Bodies with decreasing mass and the gas that they expel (book chapter 12)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.levels import check_level, interpolate
from modalprep.errors import InputError
from modalprep.multibody.model.time_function import FOREVER, TimeFunction, by_parts
from modalprep.records import Record, given, names
from modalprep.suggest import refuse_unknown
from modalprep.vectors import vector


@dataclass(frozen=True, eq=False, kw_only=True)
class Depletion(Record):
    """A body whose mass changes with time, by Kane's equations for variable mass.

    The remaining particles satisfy ``F + F* = 0`` with the current mass integrals; the mass that leaves exerts no
    force by itself. The thrust of a jet and the Coriolis force of the gas inside the body are loads: `ExpelledGas`.
    Between neighbouring fill levels the mass integrals are linear in the mass, which is exact where one density
    changes uniformly.

    Attributes
    ----------
    name, body : str
    levels : tuple of FlexibleBody
        The body at fill levels other than that of ``System.bodies``: same modes and interfaces, different mass
        (`with_density_factor`, or rigid bodies with the same interfaces).
    mass : TimeFunction or what makes one
        kg, mass of the body, between those of its lightest and heaviest level; `deplete` makes one of mass flow rates.

    Raises
    ------
    InputError
        When no other fill level is given.

    Examples
    --------
    >>> from modalprep.body.levels import with_density_factor
    >>> from modalprep.examples import uniform_beam
    >>> full = uniform_beam(modes=2)
    >>> half = with_density_factor(full, 0.5)
    >>> fuel = Depletion(name="fuel", body="beam", levels=(half,), mass=deplete(12.0, 6.0, 0.1))
    >>> [round(x, 9) for x in fuel.mass(10.0)]
    [11.0, -0.1, 0.0]
    """

    name: str
    body: str
    levels: tuple[FlexibleBody, ...]
    mass: TimeFunction = given(converter=by_parts)

    def __post_init__(self) -> None:
        """Read the function of time."""
        self._convert()
        if not self.levels:
            raise InputError(f"depletion {self.name!r}: give body {self.body!r} at one other fill level at least")
        self.mass.refuse_jumps(f"depletion {self.name!r}: the mass", smooth=False)
        super().__post_init__()

    def by_mass(self, body: FlexibleBody) -> list[FlexibleBody]:
        """Return all levels, the lightest first; `body` is that of the system.

        Returns
        -------
        list of FlexibleBody
            In the order of their masses.
        """
        return sorted((body, *self.levels), key=lambda level: level.m)

    def body_at(self, body: FlexibleBody, t: float) -> FlexibleBody:
        """Return the body as it is at time t (s).

        Returns
        -------
        FlexibleBody
            Of the mass that the function of time has then.

        References
        ----------
        Theory 9.2.
        """
        levels = self.by_mass(body)
        m = self.mass(t)[0]
        k = next((k for k in range(1, len(levels)) if m <= levels[k].m), len(levels) - 1)
        return interpolate(levels[k - 1], levels[k], m)


def deplete(full: float, empty: float, rates: float | Sequence[tuple[float, float]]) -> TimeFunction:
    """Return the mass (kg) over time of a body that is depleted from `full` to `empty`.

    Parameters
    ----------
    rates : float or sequence of (until, rate)
        kg/s; of a throttled engine the rate of each interval up to its end (s), and none after the last interval.

    Returns
    -------
    TimeFunction
        kg over s.

    Raises
    ------
    InputError
        When a rate is negative, or the full body is not heavier than the empty one.

    Examples
    --------
    >>> deplete(1000.0, 360.0, 8.0).breaks
    [80.0]
    >>> deplete(1000.0, 360.0, [(10.0, 8.0), (20.0, 0.0), (float("inf"), 4.0)]).breaks
    [10.0, 20.0, 160.0]
    """
    if not full > empty > 0:
        raise InputError(f"nothing depletes from {full:g} kg to {empty:g} kg; the full body must be the heavier one")
    stretches = [(FOREVER, rates)] if isinstance(rates, (int, float)) else rates
    pieces: list[tuple[float, str | float]] = []
    begin, m = 0.0, full
    for until, rate in stretches:
        if not 0 <= rate < float("inf"):
            raise InputError(f"mass flow rate {rate:g} kg/s must not be negative")
        end = min(until, begin + (m - empty) / rate) if rate else until
        pieces.append((end, f"{m!r} - {rate!r}*(t - {begin!r})" if rate else m))
        m = m - rate * (end - begin) if rate else m
        begin = end
        if end < until:
            m = empty
            break
    return TimeFunction([*pieces, (FOREVER, m)] if pieces[-1][0] < FOREVER else pieces)


@dataclass(frozen=True, eq=False, kw_only=True)
class ExpelledGas(Record):
    """Gas that leaves through an exit: its thrust, and its Coriolis force on the flow path.

    With the mass flow rate ``m'`` the thrust is ``m' speed + pressure`` along the exit's axis, which rotates with its
    interface, elastic rotation included (a follower force). The gas on the flow path is taken to have the mass of the
    solid that it replaces, and its Coriolis force ``-int 2 m' (w x t).v_r ds`` is the jet damping of book chapter 12.
    Velocities are interpolated linearly between neighbouring points of the path, so that ``w x t ds`` is the
    difference of two velocities and bending rates are included.

    Attributes
    ----------
    name : str
    at : str
        ``body.interface``, the exit.
    source : TimeFunction or what makes one
        kg, mass of the depleting body, ``Depletion.mass``. Gas leaves at the rate at which it decreases.
    speed : float
        m/s, exhaust velocity.
    axis : (3,)
        Direction of the exhaust, in the axes of the exit.
    mass_fraction : float
        Fraction of the mass lost by the source that leaves through this exit.
    pressure : float
        N, exit pressure times exit area, while gas flows.
    flow_path : tuple of str
        Interfaces ``body.interface`` along which the gas flows, upstream first, without the exit itself. When empty,
        there is no Coriolis force.

    Raises
    ------
    InputError
        When a constant is negative or the axis has no direction.

    Examples
    --------
    >>> mass = deplete(1000.0, 360.0, 8.0)
    >>> gas = ExpelledGas(name="jet", at="rocket.exit", source=mass, speed=2500.0, axis=np.array([-2.0, 0, 0]))
    >>> gas.thrust(10.0), gas.thrust(90.0)
    (20000.0, 0.0)
    """

    name: str
    at: str
    source: TimeFunction = given(converter=by_parts)
    speed: float
    axis: np.ndarray = given(converter=vector)
    mass_fraction: float = 1.0
    pressure: float = 0.0
    flow_path: tuple[str, ...] = given(converter=names, default=())

    def __post_init__(self) -> None:
        """Check the constants."""
        for name in ("speed", "mass_fraction", "pressure"):
            if not 0 <= getattr(self, name) < float("inf"):
                raise InputError(f"gas {self.name!r}: {name} = {getattr(self, name):g} must not be negative")
        if self.mass_fraction > 1:
            raise InputError(f"gas {self.name!r}: mass_fraction = {self.mass_fraction:g} must not exceed 1")
        self._convert(f"gas {self.name!r}: ")
        axis = self.axis
        if axis.shape != (3,) or not np.linalg.norm(axis) > 0:
            raise InputError(f"gas {self.name!r}: axis {axis.tolist()} has no direction")
        object.__setattr__(self, "axis", axis / np.linalg.norm(axis))
        super().__post_init__()

    @property
    def flow_points(self) -> tuple[str, ...]:
        """Interfaces along the flow path, the exit last."""
        return (*self.flow_path, self.at)

    def flow(self, t: float) -> float:
        """Return the mass that leaves here, kg/s.

        Returns
        -------
        float
            kg/s.
        """
        return -self.mass_fraction * self.source(t)[1]

    def thrust(self, t: float) -> float:
        """Return the thrust, N.

        Returns
        -------
        float
            N, against the direction of the jet.
        """
        flow = self.flow(t)
        return flow * self.speed + (self.pressure if flow > 0 else 0.0)


def check_depletions(bodies: Mapping[str, FlexibleBody], depletions: tuple[Depletion, ...]) -> None:
    """Refuse unknown bodies, two depletions of one body, and fill levels with different modes."""
    seen: set[str] = set()
    for depletion in depletions:
        refuse_unknown(depletion.body, bodies, f"depletion {depletion.name!r}: body")
        if depletion.body in seen:
            raise InputError(f"body {depletion.body!r} is depleted twice; use one depletion with the total mass")
        seen.add(depletion.body)
        for one, other in pairwise(depletion.by_mass(bodies[depletion.body])):
            check_level(one, other)
