"""Gravity of a planet, a circular orbit as the ground of a system, and conductors in the planet's magnetic field."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from modalprep.applies import Rule, refuse_idle
from modalprep.errors import InputError
from modalprep.multibody.model.time_function import TimeFunction
from modalprep.records import Record, given, names
from modalprep.vectors import vector

EARTH_MU = 3.986004418e14  # m^3/s^2
EARTH_RADIUS = 6378137.0  # m, at the equator
EARTH_SPIN = 7.292115e-5  # rad/s
SAME_FIELD = "the field of an untilted dipole is the same all along an equatorial orbit; leave it out"
OF_THE_FIELD = "it places the magnetic field of the planet, so leave it out"


@dataclass(frozen=True, eq=False, kw_only=True)
class CentralGravity(Record):
    """Gravity of a point mass, with its gradient over each body.

    The field is linearised about each body's root: ``g(r) = g0 + Gamma r``, ``g0 = -mu n / R^2``,
    ``Gamma = -mu / R^3 (1 - 3 n n')``. It enters the twelve integrals of the body as the specific acceleration does,
    A by -g0 and W by -Gamma; the second order of the force on the body is kept, so that energy is conserved. The
    neglected terms are of order (size / R)^3 of the force.

    Attributes
    ----------
    mu : float
        Gravitational constant times mass, m^3/s^2; 3.986004418e14 for the Earth.
    centre : (3,)
        m, inertial.

    References
    ----------
    P. C. Hughes, Spacecraft Attitude Dynamics, Wiley 1986, section 8.1.

    Examples
    --------
    >>> CentralGravity(mu=3.986004418e14).centre
    array([0., 0., 0.])
    """

    mu: float
    centre: np.ndarray = given(converter=vector, default=(0.0, 0.0, 0.0))

    def __post_init__(self) -> None:
        """Check the constants."""
        if not 0 < self.mu < float("inf"):
            raise InputError(f"gravity: mu = {self.mu:g} must be positive")
        super().__post_init__()


@dataclass(frozen=True, eq=False, kw_only=True)
class Dipole(Record):
    """Magnetic field of a planet: a dipole at its centre that rotates with it.

    Attributes
    ----------
    strength : float
        T, on the magnetic equator at `radius`, towards the north pole.
    radius : float
        m.
    tilt : float
        rad, between the dipole's axis and that of the planet.
    longitude : float
        rad, of the axis at the start, counted from the ascending node of the orbit.

    Examples
    --------
    >>> Dipole(strength=3.12e-5).radius
    6378137.0
    """

    applies: ClassVar[tuple[Rule, ...]] = (Rule(("longitude",), needs=("tilt",)),)
    strength: float
    radius: float = EARTH_RADIUS
    tilt: float = 0.0
    longitude: float = 0.0

    def __post_init__(self) -> None:
        """Check the constants."""
        if not 0 < self.strength < float("inf") or not 0 < self.radius < float("inf"):
            raise InputError(
                f"dipole: strength = {self.strength:g} and radius = {self.radius:g} must be positive (T and m)"
            )
        refuse_idle(self, "dipole: ")
        super().__post_init__()


@dataclass(frozen=True, eq=False, kw_only=True)
class Orbit(Record):
    """A point on a circular orbit as the origin of all axes: x up, y along the flight, z normal to the orbit.

    The ground of the system is this local frame. It rotates at `rate` about z: positions, velocities, joint coordinates
    and closures to the ground are relative to it, and the energy balance is that of the Jacobi integral, in which
    ``energy.kinetic`` is that of the relative motion and ``energy.gravity`` includes the centrifugal potential.
    Bodies feel the planet's gravity less that at the origin, linearised about their roots as in `CentralGravity`; an
    infinite `radius` is the first order in all distances from the origin (Hill 1878; Clohessy and Wiltshire 1960)::

        x'' - 2 n y' - 3 n^2 x = f_x / m ;   y'' + 2 n x' = f_y / m ;   z'' + n^2 z = f_z / m

    Attributes
    ----------
    rate : float
        n, rad/s.
    radius : float
        m; with it mu is ``rate**2 radius**3``.
    inclination, argument_of_latitude : float
        rad, of the orbit to the planet's equator, and from the ascending node to the origin at the start.
    planet_spin : float
        rad/s, of the planet with its atmosphere and magnetic field.
    dipole : Dipole or None

    Examples
    --------
    >>> orbit = Orbit.circular(6378137.0 + 220e3)
    >>> round(orbit.rate, 12), Orbit(rate=1.2e-3).radius
    (0.001177977227, inf)
    """

    applies: ClassVar[tuple[Rule, ...]] = (
        Rule(("inclination", "argument_of_latitude", "planet_spin"), needs=("dipole",), advice=OF_THE_FIELD),
        Rule(("argument_of_latitude",), needs=("inclination", "dipole.tilt"), advice=SAME_FIELD),
    )
    rate: float
    radius: float = float("inf")
    inclination: float = 0.0
    argument_of_latitude: float = 0.0
    planet_spin: float = EARTH_SPIN
    dipole: Dipole | None = None

    def __post_init__(self) -> None:
        """Check the constants."""
        refuse_idle(self, "orbit: ")
        if not 0 < self.rate < float("inf"):
            raise InputError(f"orbit: rate = {self.rate:g} must be positive (rad/s)")
        if not self.radius > 0:
            raise InputError(f"orbit: radius = {self.radius:g} must be positive (m)")
        if self.dipole is not None and self.radius == float("inf"):
            raise InputError("orbit: a dipole needs the radius of the orbit; give it")
        super().__post_init__()

    @classmethod
    def circular(cls, radius: float, mu: float = EARTH_MU, **others) -> Orbit:
        """Return the orbit of a radius (m) about a planet of gravitational constant times mass mu (m^3/s^2).

        Returns
        -------
        Orbit
            With the rate ``sqrt(mu / radius^3)`` (rad/s).

        References
        ----------
        Theory 9.1.
        """
        if not (0 < radius < float("inf") and 0 < mu < float("inf")):
            raise InputError(f"orbit: radius = {radius:g} and mu = {mu:g} must be positive (m and m^3/s^2)")
        return cls(rate=float(np.sqrt(mu / radius**3)), radius=radius, **others)

    def semi_major_axis(self, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Return the semi-major axis (m) of the osculating orbits of points, from positions and velocities (..., 3).

        Returns
        -------
        (...) float
            m; negative on a hyperbola.

        References
        ----------
        Theory 9.1.

        Examples
        --------
        >>> orbit = Orbit.circular(7e6)
        >>> float(orbit.semi_major_axis(np.zeros(3), np.zeros(3)))
        7000000.0
        >>> round(float(orbit.semi_major_axis(np.array([1e3, 0, 0]), np.zeros(3))))  # 4 x, and a little
        7004002
        """
        r = np.asarray(position) + np.array([self.radius, 0, 0])
        v = np.asarray(velocity) + np.cross([0, 0, self.rate], r)
        mu = self.rate**2 * self.radius**3
        return 1 / (2 / np.linalg.norm(r, axis=-1) - np.sum(v**2, axis=-1) / mu)


@dataclass(frozen=True, eq=False, kw_only=True)
class Conductor(Record):
    """A current along straight segments between interfaces, in the magnetic field of the orbit's planet.

    A segment L takes the force ``I L x B`` with B at its midpoint, half of it at each end. The electromotive force
    ``(v x B) . L``, with v the segment's velocity relative to the rotating planet, is the channel ``<name>.emf`` (V).

    Attributes
    ----------
    name : str
    through : tuple of str
        ``body.interface``, two or more, in the direction of the current.
    current : TimeFunction or what makes one
        A.

    Examples
    --------
    >>> Conductor(name="line", through=("tether.root", "tether.tip"), current=10.0).current(0.0)[0]
    10.0
    """

    name: str
    through: tuple[str, ...] = given(converter=names)
    current: TimeFunction = given(converter=TimeFunction.of)

    def __post_init__(self) -> None:
        """Check the interfaces and read the function of time."""
        self._convert(f"conductor {self.name!r}: ")
        if any(a == b for a, b in self.segments) or not self.segments:
            raise InputError(
                f"conductor {self.name!r}: 'through' needs two or more interfaces, no two equal in sequence"
            )
        super().__post_init__()

    @property
    def segments(self) -> tuple[tuple[str, str], ...]:
        """Pairs of interfaces at the ends of the straight segments."""
        return tuple(zip(self.through[:-1], self.through[1:], strict=True))
