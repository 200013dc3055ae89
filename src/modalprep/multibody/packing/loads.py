"""Pack the loads of a system for the kernel."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody.kernels.data import FREE, PRESCRIBED, SPEEDS, SPHERICAL
from modalprep.multibody.kernels.loads.gravity import ORBIT
from modalprep.multibody.kernels.loads.laws import (
    BUSHING,
    GROUND,
    GROUND_ROTATION,
    HINGE,
    REST_POSITION,
    REST_ROTATION,
    ROD,
)
from modalprep.multibody.kernels.loads.loads import Loads
from modalprep.multibody.model.depletion import ExpelledGas
from modalprep.multibody.model.environment import CentralGravity, Conductor, Orbit
from modalprep.multibody.model.hydrodynamics import ImmersedRod, added_inertia, rod_constants
from modalprep.multibody.model.loads import AxialSpring, Bushing, DistributedForce, PointForce, locate
from modalprep.multibody.model.system import System
from modalprep.multibody.model.time_function import TimeFunction
from modalprep.multibody.packing.time_tables import tabulate
from modalprep.multibody.packing.tree import Packed
from modalprep.multibody.packing.variable_mass import pack_fill


def pack_loads(system: System, packed: Packed, t_end: float) -> Loads:
    """Return the arrays of everything that loads or drives a system on [0, t_end].

    Raises
    ------
    InputError
        When a function of time cannot be used on [0, t_end].

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint_element import HingeElement
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.multibody.packing.tree import pack
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm", elements=HingeElement(stiffness=5.0))
    >>> arm = System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,))
    >>> pack_loads(arm, pack(arm), 1.0).hinge[0, 0]
    np.float64(5.0)
    """
    build = _Builder(system, packed)
    motion = build.motion()
    hinge_at, hinge = build.hinges()
    rows = {kind: [load for load in system.loads if isinstance(load, kind)] for kind in _KINDS}
    points = [build.point(load) for load in rows[PointForce]]
    spread = [build.spread(load) for load in rows[DistributedForce]]
    springs = [build.spring(load) for load in rows[AxialSpring]]
    bushings = [build.bushing(load) for load in rows[Bushing]]
    legs = [leg for load in rows[Conductor] for leg in build.legs(load)]
    centre = [np.array([load.mu, *load.centre]) for load in rows[CentralGravity]]
    gas_at, gas, gas_way = build.gas(rows[ExpelledGas])
    fill = pack_fill(system, packed, [build.table(f"depletion {d.name!r}", d.mass) for d in system.depletions], t_end)
    N = max((body.n for body in system.bodies.values()), default=0)
    return Loads(
        tables=_named_tabulate(build.functions, t_end),
        motion=_ints(motion, 2),
        hinge_at=_ints(hinge_at, 3),
        hinge=_floats(hinge, (HINGE,)),
        point_at=_ints(points, 9),
        spread_at=_ints([at for at, _, _ in spread], 3),
        spread=_floats([c for _, c, _ in spread], (12,)),
        spread_modes=_floats([np.pad(m, ((0, N - len(m)), (0, 0))) for _, _, m in spread], (N, 9)),
        spring_at=_ints([at for at, _ in springs], 6),
        spring=_floats([c for _, c in springs], (9,)),
        bushing_at=_ints([at for at, _ in bushings], 4),
        bushing=_floats([c for _, c in bushings], (BUSHING,)),
        leg_at=_ints(legs, 5),
        centre=centre[0] if centre else np.zeros(4),
        orbit=_orbit(system.orbit),
        gas_at=_ints(gas_at, 3),
        gas=_floats(gas, (6,)),
        gas_way=_ints(gas_way, 2),
        fill=fill,
        **_rods(build, rows[ImmersedRod]),
    )


_KINDS = (PointForce, DistributedForce, AxialSpring, Bushing, CentralGravity, Conductor, ExpelledGas, ImmersedRod)


def _named_tabulate(functions: list[tuple[str, TimeFunction]], t_end: float):
    for name, function in functions:
        try:
            tabulate([function], t_end)
        except InputError as error:
            raise InputError(f"{name}: {error}") from None
    return tabulate([function for _, function in functions], t_end)


class _Builder:
    """Collects functions of time while the rows of the loads are made."""

    def __init__(self, system: System, packed: Packed) -> None:
        self.system, self.packed = system, packed
        self.functions: list[tuple[str, TimeFunction]] = []

    def table(self, name: str, function: TimeFunction | None) -> int:
        """Return the number of a function; -1 for none, and for the constant zero."""
        if function is None or function.source == 0:
            return -1
        self.functions.append((name, function))
        return len(self.functions) - 1

    def motion(self) -> list[tuple[int, int]]:
        return [
            (i, self.table(f"joint {link.joint.name!r}: motion", link.joint.motions[link.hinge]))
            for i, link in enumerate(self.packed.links)
            if self.packed.types[i] in PRESCRIBED
        ]

    def hinges(self) -> tuple[list, list]:
        at, constants = [], []
        for joint in self.system.joints:
            places = _coordinates(self.packed, joint.name)
            for element, (x, u) in zip(joint.elements, places, strict=bool(joint.elements)):
                at.append((x, u, self.table(f"joint {joint.name!r}: drive", element.drive)))
                constants.append(np.array(element.constants))
        return at, constants

    def end(self, text: str) -> tuple[int, int]:
        """Return link and interface of ``body.interface``; -1, 0 for the ground."""
        found = locate(self.system.bodies, text, text)
        return (self.packed.link_of(found[0]), found[1]) if found else (-1, 0)

    def point(self, load: PointForce) -> list[int]:
        name = f"force {load.name!r}"
        tables = [self.table(name, function) for function in (*load.force, *load.torque)]
        return [*self.end(load.at), int(load.axes == "body"), *tables]

    def spread(self, load: DistributedForce) -> tuple:
        body, link = self.system.bodies[load.body], self.packed.link_of(load.body)
        to_link = self.packed.align(link).T
        follows = load.axes == "body"
        force = load.force @ to_link.T if follows else load.force
        shape = np.einsum("ac,pci->pai", to_link, body.shape)
        first = np.einsum("pa,pb->ab", body.points @ to_link.T, force)
        modes = np.einsum("pai,pb->iab", shape, force).reshape(body.n, 9)
        at = [link, int(follows), self.table(f"force {load.name!r}", load.factor)]
        return at, np.array([*force.sum(axis=0), *first.ravel()]), modes

    def gas(self, loads: Sequence[ExpelledGas]) -> tuple[list, list, list]:
        at, constants, way = [], [], []
        for load in loads:
            first = len(way)
            way += [self.end(point) for point in load.flow_points]
            at.append((self.table(f"gas {load.name!r}", load.source), first, len(way) - 1))
            constants.append(np.array([load.mass_fraction, load.speed, load.pressure, *load.axis]))
        return at, constants, way

    def spring(self, load: AxialSpring) -> tuple:
        pull = self.table(f"spring {load.name!r}", load.actuator_force)
        at = [*self.end(load.between[0]), *self.end(load.between[1]), pull, int(load.tension_only)]
        return at, np.array([load.stiffness, load.damping, load.free_length, *load.position, *load.position])

    def legs(self, load: Conductor) -> list[list[int]]:
        current = self.table(f"conductor {load.name!r}", load.current)
        return [[*self.end(a), *self.end(b), current] for a, b in load.segments]

    def bushing(self, load: Bushing) -> tuple:
        row = np.zeros(BUSHING)
        row[:6], row[6:REST_POSITION] = load.stiffness, load.damping
        row[REST_POSITION:REST_ROTATION], row[GROUND:GROUND_ROTATION] = load.free_position, load.position
        row[REST_ROTATION:GROUND], row[GROUND_ROTATION:] = load.free_rotation.ravel(), load.rotation.ravel()
        return [*self.end(load.between[0]), *self.end(load.between[1])], row


def _rods(build: _Builder, rods: list[ImmersedRod]) -> dict[str, np.ndarray]:
    """Return the arrays of rods in water; each has its own rows of the current."""
    links = [build.packed.link_of(rod.body) for rod in rods]
    constants = [
        rod_constants(build.system.bodies[rod.body], rod, build.packed.align(link))
        for rod, link in zip(rods, links, strict=True)
    ]
    added = [added_inertia(c) for c in constants]
    profiles = [np.column_stack([rod.water.depths, rod.water.current]) for rod in rods]
    counts = [len(profile) for profile in profiles]
    at = list(zip(links, np.cumsum([0, *counts])[:-1], counts, strict=True))
    return {
        "rod_at": _ints(at, 3),
        "rod": _floats(constants, (ROD,)),
        "rod_mass": _floats([M for M, _, _ in added], (6,)),
        "rod_coupling": _floats([H for _, H, _ in added], (9,)),
        "rod_inertia": _floats([J for _, _, J in added], (6,)),
        "current": np.vstack([np.zeros((0, 4)), *profiles]),
    }


def _coordinates(packed: Packed, joint: str) -> list[tuple[int, int]]:
    """Return coordinate (-1: none of its own) and speed of everything that a joint can move."""
    found = []
    for i in packed.links_of(joint):
        kind, row = packed.types[i], packed.model.links[i]
        own = kind not in (SPHERICAL, FREE)
        found += [(int(row["x"]) if own else -1, int(row["u"]) + k) for k in range(SPEEDS[kind])]
    return found


def _ints(rows: Sequence, width: int) -> np.ndarray:
    return np.array(rows, dtype=np.int64).reshape(len(rows), width)


def _floats(rows: Sequence, shape: tuple[int, ...]) -> np.ndarray:
    return np.array(rows, dtype=float).reshape(len(rows), *shape)


def _orbit(orbit: Orbit | None) -> np.ndarray:
    """Return an orbit by the columns of `kernels.gravity`: 1 / radius, the dipole's field at that radius."""
    if orbit is None:
        return np.zeros(ORBIT)
    d = orbit.dipole
    field = (0.0, 0.0, 0.0) if d is None else (d.strength * (d.radius / orbit.radius) ** 3, d.tilt, d.longitude)
    return np.array(
        [orbit.rate, 1 / orbit.radius, orbit.inclination, orbit.argument_of_latitude, orbit.planet_spin, *field]
    )
