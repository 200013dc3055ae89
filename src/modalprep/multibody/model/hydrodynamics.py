"""Water around slender bodies: drag, added mass and buoyancy of immersed rods, and the current."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from modalprep.applies import Rule, refuse_idle
from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.records import Record, given, pair
from modalprep.suggest import refuse_unknown
from modalprep.vectors import matrix, vector


@dataclass(frozen=True, eq=False, kw_only=True)
class Water(Record):
    """Water with a steady current, which may change with the depth.

    Attributes
    ----------
    density : float
        kg/m^3.
    current : (3,) or (k, 3)
        m/s, inertial; a row for each depth.
    depths : (k,)
        m below the surface, increasing: the current is interpolated between them and constant beyond.
    up : (3,)
        Inertial.
    surface : float
        m along `up`, from which depths are measured; rods above it count as immersed too.

    Raises
    ------
    InputError
        When the density is not positive, or depths and currents do not fit.

    Examples
    --------
    >>> stream = Water(current=np.array([[2.0, 0, 0], [1.0, 0, 0]]), depths=np.array([0.0, 50.0]))
    >>> stream.current_at(25.0), stream.current_at(80.0)
    (array([1.5, 0. , 0. ]), array([1., 0., 0.]))
    """

    applies: ClassVar[tuple[Rule, ...]] = (
        Rule(("up", "surface"), needs=("depths",), advice="it places the depths of the current, so leave it out"),
    )
    density: float = 1025.0
    current: np.ndarray = given(converter=matrix, default=(0.0, 0.0, 0.0))
    depths: np.ndarray = given(converter=vector, default=(0.0,))
    up: np.ndarray = given(converter=vector, default=(0.0, 0.0, 1.0))
    surface: float = 0.0

    def __post_init__(self) -> None:
        """Check the constants, normalise the direction up."""
        if not 0 < self.density < float("inf"):
            raise InputError(f"water: density = {self.density:g} must be positive")
        depths = np.atleast_1d(np.asarray(self.depths, dtype=float))
        current = np.atleast_2d(self.current).astype(float)
        if current.shape != (len(depths), 3) or not np.all(np.diff(depths) > 0):
            raise InputError(
                f"water: {len(depths)} depths and a current of shape {current.shape}; give growing depths and three "
                "numbers for each"
            )
        up = np.asarray(self.up, dtype=float)
        if up.shape != (3,) or not np.linalg.norm(up) > 0:
            raise InputError(f"water: up {up.tolist()} has no direction")
        refuse_idle(self, "water: ")
        for key, value in (("depths", depths), ("current", current), ("up", up / np.linalg.norm(up))):
            object.__setattr__(self, key, value)
        super().__post_init__()

    def current_at(self, depth: float) -> np.ndarray:
        """Return the current (3,) at a depth (m).

        Returns
        -------
        (3,) float
            m/s, inertial axes.
        """
        return self.sheared(depth)[0]

    def sheared(self, depth: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the current (3,) at a depth (m), and its derivative by the depth (3,).

        Returns
        -------
        (3,), (3,) float
            m/s, 1/s; inertial axes.
        """
        k = int(np.searchsorted(self.depths, depth))
        if k in (0, len(self.depths)):
            return self.current[min(k, len(self.depths) - 1)], np.zeros(3)
        slope = (self.current[k] - self.current[k - 1]) / (self.depths[k] - self.depths[k - 1])
        return self.current[k - 1] + (depth - self.depths[k - 1]) * slope, slope


@dataclass(frozen=True, eq=False, kw_only=True)
class ImmersedRod(Record):
    """A slender rod of a rigid body in water: Morison's drag, added mass and buoyancy by strip theory.

    With the velocity of a strip relative to the water, across and along the rod, a unit length feels the drag
    ``-(rho / 2) Cn d |v_n| v_n - (rho / 2) Ct pi d |v_t| v_t``, the buoyancy of its volume, and the reaction
    ``-rho Ca (pi d^2 / 4) a_n`` of the accelerated water, a being the acceleration of the strip (Morison et al. 1950).
    The reaction enters the recursion as the inertia of a rigid body with different mass along and across the rod. The
    kinetic energy of this water is part of ``energy.stored``. The Munk moment of potential flow about an inclined rod,
    which a cable with its wake does not have, is neglected.

    Attributes
    ----------
    name, body : str
    ends : (str, str)
        Interfaces of the body: the rod is the straight line between them.
    diameter : float
        m.
    normal_drag, tangential_drag, added_mass : float
        Coefficients Cn, Ct, Ca.
    water : Water

    Raises
    ------
    InputError
        When a constant is negative.

    Examples
    --------
    >>> rod = ImmersedRod(name="drag", body="cable1", diameter=0.02)
    >>> round(rod.normal, 6), round(rod.displaced, 6)  # kg/m^2, kg/m
    (12.3, 0.322013)
    """

    name: str
    body: str
    diameter: float
    ends: tuple[str, str] = given(converter=pair, default=("root", "tip"))
    normal_drag: float = 1.2
    tangential_drag: float = 0.01
    added_mass: float = 1.0
    water: Water = field(default_factory=Water)

    def __post_init__(self) -> None:
        """Check the constants."""
        for name in ("diameter", "normal_drag", "tangential_drag", "added_mass"):
            if not 0 <= getattr(self, name) < float("inf"):
                raise InputError(f"immersed {self.name!r}: {name} = {getattr(self, name):g} must not be negative")
        super().__post_init__()

    @property
    def normal(self) -> float:
        """``rho Cn d / 2``, kg/m^2."""
        return self.water.density * self.normal_drag * self.diameter / 2

    @property
    def tangential(self) -> float:
        """``rho Ct pi d / 2``, kg/m^2."""
        return self.water.density * self.tangential_drag * np.pi * self.diameter / 2

    @property
    def displaced(self) -> float:
        """Displaced mass of water, kg/m."""
        return self.water.density * np.pi * self.diameter**2 / 4

    @property
    def added(self) -> float:
        """Added mass across the rod, kg/m."""
        return self.added_mass * self.displaced


def check_rod(bodies: Mapping[str, FlexibleBody], rod: ImmersedRod) -> None:
    """Refuse a rod with unknown interfaces, of zero length, or of a flexible body."""
    what = f"immersed {rod.name!r}"
    refuse_unknown(rod.body, bodies, f"{what}: body")
    body = bodies[rod.body]
    if body.n:
        raise InputError(f"{what}: body {rod.body!r} is flexible; divide it into rigid rods, for example by [chains]")
    for end in rod.ends:
        refuse_unknown(end, body.interface_name, f"{what}: body {rod.body!r}: interface")
    if len(set(rod.ends)) != 2 or not np.linalg.norm(np.subtract(*end_positions(body, rod))) > 0:
        raise InputError(f"{what}: {rod.ends[0]} and {rod.ends[1]} are at one point; a rod needs two")


def end_positions(body: FlexibleBody, rod: ImmersedRod) -> list[np.ndarray]:
    """Return the places of both ends of a rod on its body, m."""
    return [body.interface_position[body.interface_name.index(end)] for end in rod.ends]
