"""All kinds of force elements: what is packed of a system, and the loops over the kinds.

A new kind is a file of this folder, a line in `KINDS`, a field in `Loads` and a line in `_elements` (numba unrolls no
loop over arrays of different types), in `observe` too if it has channels.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from modalprep.compiler.by_address import by_address
from modalprep.compiler.jit import compile_kernel
from modalprep.multibody.elements import (
    axial_spring,
    bushing,
    conductor,
    distributed_force,
    expelled_gas,
    hinge,
    immersed_rod,
    planet,
    point_force,
    rotational_spring,
)
from modalprep.multibody.elements.dense import DenseLoads, Scene, plus
from modalprep.multibody.elements.packer import ElementKind, Environment, Packer
from modalprep.multibody.kernels.algebra.tuples import (
    ZERO3,
    add3,
)
from modalprep.multibody.kernels.loads.gravity import near_planet
from modalprep.multibody.kernels.loads.variable_mass import Fill, leaving_power
from modalprep.multibody.kernels.time_tables import table
from modalprep.multibody.model.joint_types import PRESCRIBED
from modalprep.multibody.model.loads import Load
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.packed import Packed
from modalprep.multibody.packing.tree import rows
from modalprep.multibody.packing.variable_mass import empty_fill, pack_fill

KINDS = (
    point_force.KIND,
    distributed_force.KIND,
    axial_spring.KIND,
    bushing.KIND,
    conductor.KIND,
    expelled_gas.KIND,
    immersed_rod.KIND,
    rotational_spring.KIND,
)
OBSERVED = tuple(kind for kind in KINDS if kind.channels)
AXIAL_SPRINGS = OBSERVED.index(axial_spring.KIND)
ROTATIONAL_SPRINGS = OBSERVED.index(rotational_spring.KIND)
CONDUCTORS = OBSERVED.index(conductor.KIND)
MOTION = np.dtype([("link", np.int64), ("law", np.int64)])  # prescribed link, function of time


@by_address
class Loads(NamedTuple):
    """Everything that loads or drives a packed system."""

    environment: Environment
    motions: np.ndarray  # (prescribed,) MOTION
    fill: Fill  # bodies that lose mass
    hinges: np.ndarray
    point_forces: np.ndarray
    distributed_forces: distributed_force.Distributed
    axial_springs: np.ndarray
    bushings: np.ndarray
    conductors: conductor.Conductors
    expelled_gas: expelled_gas.Gas
    immersed_rods: immersed_rod.Rods
    rotational_springs: rotational_spring.Rotational


class Energies(NamedTuple):
    """Power of what is no potential (W), energy in springs and of moved water, potential of fields and buoyancy (J)."""

    power: float
    stored: float
    gravity: float


def pack_loads(system: System, packed: Packed, t_end: float, shortest_event: float | None = None) -> Loads:
    """Return what loads or drives a system on [0, t_end].

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
    >>> pack_loads(arm, pack(arm), 1.0).hinges.stiffness
    array([5.])
    """
    packer = Packer(system, packed)
    found = {
        "motions": rows(MOTION, _motions(packer)),
        "hinges": hinge.pack(packer),
        **{kind.field: _pack(kind, packer, system.loads) for kind in KINDS},
    }
    masses = [packer.table(f"depletion {d.name!r}", d.mass) for d in system.depletions]
    environment = Environment(packer.tabulate(t_end, shortest_event), planet.pack(system))
    fill = pack_fill(system, packed, masses, t_end) if masses else empty_fill()
    return Loads(environment, fill=fill, **found)


def _pack(kind: ElementKind, packer: Packer, loads: Sequence[Load]) -> Any:
    own = [load for load in loads if isinstance(load, kind.record)]
    return kind.pack(packer, own) if own else _none(kind)


@cache
def _none(kind: ElementKind) -> Any:
    """Return what is packed of no element, the same for all systems: nothing is written to it."""
    return kind.pack(Packer(None, None), ())


@cache
def _motions(packer: Packer) -> list[tuple[int, int]]:
    return [
        (i, packer.table(f"joint {link.joint.name!r}: motion", link.joint.motions[link.hinge]))
        for i in np.flatnonzero(packer.packed.types == PRESCRIBED).tolist()
        for link in (packer.packed.links[i],)
    ]


@compile_kernel
def prescribe(loads, t, motion):
    """Write position, rate and acceleration of prescribed hinges to ``motion (nl, 3)``."""
    for i in range(len(loads.motions)):
        link, k = loads.motions[i].link, loads.motions[i].law
        motion[link, 0], motion[link, 1], motion[link, 2] = table(loads.environment.tables, k, t) if k >= 0 else ZERO3


@compile_kernel
def apply(loads, model, data, y, t, tau, slope):
    """Add all loads after `world`; returns `Energies`.

    Parameters
    ----------
    tau : (nu,)
        Overwritten with the hinge forces.
    slope : (2, nu)
        Overwritten with their derivatives by the hinge's own coordinate and speed.
    """
    environment = loads.environment
    leaving = leaving_power(loads.fill, environment.tables, environment.planet[0], model, data, y, t)
    for u in range(len(tau)):
        tau[u], slope[0, u], slope[1, u] = 0.0, 0.0, 0.0
    total = hinge.apply(loads.hinges, environment, model, y, t, tau, slope)
    total = add3(total, _elements(loads, environment, model, data, t))
    return Energies(leaving + total[0], total[1], total[2])


@compile_kernel
def _elements(loads, environment, model, data, t):
    """Add all that acts on bodies; planets and water read the inertia that `outward` left, so water comes last."""
    total = point_force.apply(loads.point_forces, environment, model, data, t)
    total = add3(total, distributed_force.apply(loads.distributed_forces, environment, model, data, t))
    total = add3(total, axial_spring.apply(loads.axial_springs, environment, model, data, t))
    total = add3(total, bushing.apply(loads.bushings, environment, model, data, t))
    total = add3(total, rotational_spring.apply(loads.rotational_springs, environment, model, data, t))
    total = add3(total, conductor.apply(loads.conductors, environment, model, data, t))
    total = add3(total, expelled_gas.apply(loads.expelled_gas, environment, model, data, t))
    if near_planet(environment.planet[0]):
        total = add3(total, planet.apply(environment.planet[0], model, data))
    return add3(total, immersed_rod.apply(loads.immersed_rods, environment, model, data, t))


@compile_kernel
def observe(loads, kind, i, model, data, t):
    """Return the channels of element i of a kind, which counts in `OBSERVED`, after `world`."""
    environment = loads.environment
    if kind == AXIAL_SPRINGS:
        return axial_spring.observe(loads.axial_springs, environment, model, data, t, i)
    if kind == ROTATIONAL_SPRINGS:
        return rotational_spring.observe(loads.rotational_springs, environment, model, data, t, i)
    return conductor.observe(loads.conductors, environment, model, data, t, i)


def dense(system: System, packed: Packed, scene: Scene, y: np.ndarray) -> DenseLoads:
    """Return what all elements, and a planet, do: the reference implementation."""
    total = plus(hinge.dense(system, packed, y, scene.t), planet.dense(scene))
    for load in system.loads:
        for kind in KINDS:
            if isinstance(load, kind.record):
                total = plus(total, kind.dense(load, scene))
    return total
