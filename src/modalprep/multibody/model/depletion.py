"""Bodies that lose mass: what burns, and the gas that leaves. Book chapter 12."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.levels import between, check_level
from modalprep.errors import InputError
from modalprep.multibody.model.time_function import FOREVER, TimeFunction
from modalprep.records import Record
from modalprep.suggest import refuse_unknown


@dataclass(frozen=True, eq=False, kw_only=True)
class Depletion(Record):
    """A body whose mass changes with time, by Kane's equations for variable mass.

    The particles that remain move by ``F + F* = 0`` with the mass constants of the moment; what leaves does so
    without a push. The push of a jet, and of the gas on its way there, are loads: `ExpelledGas`. The constants are
    linear in the mass between neighbouring fill levels, which is exact where one density changes uniformly.

    Attributes
    ----------
    name, body : str
    levels : tuple of FlexibleBody
        The body at other fill levels than that of ``System.bodies``: the same modes and interfaces, other masses
        (`levels.scaled`, or rigid bodies with the same interfaces).
    mass : TimeFunction or what makes one
        kg, of the body, between its lightest and heaviest level; `burn` makes one of burn rates.

    Raises
    ------
    InputError
        When there is no other level.

    Examples
    --------
    >>> from modalprep.body.levels import scaled
    >>> from modalprep.examples import uniform_beam
    >>> full = uniform_beam(modes=2)
    >>> fuel = Depletion(name="fuel", body="beam", levels=(scaled(full, 0.5),), mass=burn(12.0, 6.0, 0.1))
    >>> [round(x, 9) for x in fuel.mass(10.0)]
    [11.0, -0.1, 0.0]
    """

    name: str
    body: str
    levels: tuple[FlexibleBody, ...]
    mass: TimeFunction

    def __post_init__(self) -> None:
        """Read the function of time."""
        object.__setattr__(self, "mass", TimeFunction.of(self.mass))
        if not self.levels:
            raise InputError(f"depletion {self.name!r}: give the body {self.body!r} at another fill level")
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

    def at(self, body: FlexibleBody, t: float) -> FlexibleBody:
        """Return the body as it is at time t (s).

        Returns
        -------
        FlexibleBody
            Of the mass that the function of time has then.

        References
        ----------
        Theory 9.2.
        """
        levels, m = self.by_mass(body), self.mass(t)[0]
        k = next((k for k in range(1, len(levels)) if m <= levels[k].m), len(levels) - 1)
        return between(levels[k - 1], levels[k], m)


def burn(full: float, empty: float, rates: float | Sequence[tuple[float, float]]) -> TimeFunction:
    """Return the mass (kg) over time of a body that burns from `full` until it is `empty`.

    Parameters
    ----------
    rates : float or sequence of (until, rate)
        kg/s; of a throttled engine the rate of each stretch up to its end (s), nothing burns after the last.

    Returns
    -------
    TimeFunction
        kg over s.

    Raises
    ------
    InputError
        When a rate is negative, or there is nothing to burn.

    Examples
    --------
    >>> burn(1000.0, 360.0, 8.0).breaks
    [80.0]
    >>> burn(1000.0, 360.0, [(10.0, 8.0), (20.0, 0.0), (float("inf"), 4.0)]).breaks
    [10.0, 20.0, 160.0]
    """
    if not full > empty > 0:
        raise InputError(f"nothing burns from {full:g} kg to {empty:g} kg; the full body must be the heavier one")
    stretches = [(FOREVER, rates)] if isinstance(rates, (int, float)) else rates
    pieces: list[tuple[float, str | float]] = []
    begin, m = 0.0, full
    for until, rate in stretches:
        if not 0 <= rate < float("inf"):
            raise InputError(f"burn rate {rate:g} kg/s must not be negative")
        end = min(until, begin + (m - empty) / rate) if rate else until
        pieces.append((end, f"{m!r} - {rate!r}*(t - {begin!r})" if rate else m))
        m, begin = (m - rate * (end - begin) if rate else m), end
        if end < until:
            m = empty
            break
    return TimeFunction([*pieces, (FOREVER, m)] if pieces[-1][0] < FOREVER else pieces)


@dataclass(frozen=True, eq=False, kw_only=True)
class ExpelledGas(Record):
    """Gas that leaves through an exit: thrust, and the Coriolis force of its way there.

    With ``m'`` the mass that leaves each second the thrust is ``m' speed + pressure`` along the exit's axis, which
    turns with its interface, elastic rotation included (a follower force). On its way the gas, whose mass on the way
    is that of the solid it was, asks for the Coriolis force ``-int 2 m' (w x t).v_r ds`` of jet damping (book
    chapter 12); between neighbouring points of the way all velocities are taken as linear, so that ``w x t ds`` is the
    difference of two velocities and bending rates count as well.

    Attributes
    ----------
    name : str
    at : str
        ``body.interface``, the exit.
    source : TimeFunction or what makes one
        kg, mass of what the gas comes from: ``Depletion.mass``. Its fall is what leaves, nothing where it rests.
    speed : float
        m/s, of the gas as it leaves.
    axis : (3,)
        Where the gas goes, in the axes of the exit.
    share : float
        Of the mass that the source loses.
    pressure : float
        N, exit pressure times exit area, while gas flows.
    way : tuple of str
        ``body.interface`` where the gas passes, from where it starts; the exit is the last and not named again.
        Empty: no Coriolis force.

    Raises
    ------
    InputError
        When a constant is negative or the axis has no direction.

    Examples
    --------
    >>> mass = burn(1000.0, 360.0, 8.0)
    >>> gas = ExpelledGas(name="jet", at="rocket.exit", source=mass, speed=2500.0, axis=np.array([-2.0, 0, 0]))
    >>> gas.thrust(10.0), gas.thrust(90.0)
    (20000.0, 0.0)
    """

    name: str
    at: str
    source: TimeFunction
    speed: float
    axis: np.ndarray
    share: float = 1.0
    pressure: float = 0.0
    way: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check the constants."""
        for name in ("speed", "share", "pressure"):
            if not 0 <= getattr(self, name) < float("inf"):
                raise InputError(f"gas {self.name!r}: {name} = {getattr(self, name):g} must not be negative")
        axis = np.asarray(self.axis, dtype=float)
        if axis.shape != (3,) or not np.linalg.norm(axis) > 0:
            raise InputError(f"gas {self.name!r}: axis {axis.tolist()} has no direction")
        object.__setattr__(self, "axis", axis / np.linalg.norm(axis))
        object.__setattr__(self, "way", tuple(self.way))
        object.__setattr__(self, "source", TimeFunction.of(self.source))
        super().__post_init__()

    @property
    def passes(self) -> tuple[str, ...]:
        """Points that the gas passes, the exit last."""
        return (*self.way, self.at)

    def flow(self, t: float) -> float:
        """Return the mass that leaves here, kg/s.

        Returns
        -------
        float
            kg/s.
        """
        return -self.share * self.source(t)[1]

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
    """Refuse depletions of what is not there, twice of one body, or to levels that have other modes."""
    seen: set[str] = set()
    for depletion in depletions:
        refuse_unknown(depletion.body, bodies, f"depletion {depletion.name!r}: body")
        if depletion.body in seen:
            raise InputError(f"body {depletion.body!r} is depleted twice; one depletion holds all that leaves it")
        seen.add(depletion.body)
        for one, other in pairwise(depletion.by_mass(bodies[depletion.body])):
            check_level(one, other)
