"""All kinds of force elements: what is packed of a system, and what all kinds do.

A kind is a file of this folder with a `KIND`. The compiled functions call those of the kinds one inside the other,
since numba unrolls no loop over arrays of different types.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable, Sequence
from importlib import import_module
from pkgutil import iter_modules
from typing import Any, NamedTuple

import numpy as np

from modalprep.compiler.by_address import by_address
from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.multibody import elements
from modalprep.multibody.elements import hinge, planet
from modalprep.multibody.elements.dense import DenseLoads, Scene, plus
from modalprep.multibody.elements.packer import ElementKind, Environment, Packer
from modalprep.multibody.elements.slopes import BodySlopes, EndSlopes
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


def _kinds() -> dict[str, ElementKind]:
    """Return the kinds by their files; last those that add mass."""
    names = sorted(module.name for module in iter_modules(elements.__path__) if module.name != "registry")
    files = {name: import_module(f"{elements.__name__}.{name}") for name in names}
    found = {name: file.KIND for name, file in files.items() if hasattr(file, "KIND")}
    return dict(sorted(found.items(), key=lambda item: item[1].adds_mass))


KINDS = _kinds()
OBSERVED = {name: kind for name, kind in KINDS.items() if kind.channels}
Elements = by_address(namedtuple("Elements", KINDS))  # what is packed of each kind
EMPTY: dict[ElementKind, Any] = {}  # what is packed of no element, the same for all systems: nothing is written to it
MOTION = np.dtype([("link", np.int64), ("law", np.int64)])  # prescribed link, function of time


@by_address
class Loads(NamedTuple):
    """Everything that loads or drives a packed system."""

    environment: Environment
    motions: np.ndarray  # (prescribed,) MOTION
    fill: Fill  # bodies that lose mass
    hinges: np.ndarray
    elements: Any  # Elements


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
        "elements": Elements(*(_pack(kind, packer, system.loads) for kind in KINDS.values())),
    }
    masses = [packer.table(f"depletion {d.name!r}", d.mass) for d in system.depletions]
    environment = Environment(packer.tabulate(t_end, shortest_event), planet.pack(system))
    fill = pack_fill(system, packed, masses, t_end) if masses else empty_fill()
    return Loads(environment, fill=fill, **found)


def _pack(kind: ElementKind, packer: Packer, loads: Sequence[Load]) -> Any:
    own = [load for load in loads if isinstance(load, kind.record)]
    if own:
        return kind.pack(packer, own)
    if kind not in EMPTY:
        EMPTY[kind] = kind.pack(packer, ())
    return EMPTY[kind]


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


@compile_inline
def _nothing(elements, environment, model, data, t):
    return ZERO3


def _sum(adds_mass: bool) -> Callable:
    """Return the compiled function that adds the forces of all kinds which add mass, or of all others."""
    total = _nothing
    for kind in KINDS.values():
        if kind.adds_mass == adds_mass:
            total = _plus(total, kind.apply)
    return total


def _plus(others: Callable, apply: Callable) -> Callable:
    @compile_inline
    def total(elements, environment, model, data, t):
        before = others(elements, environment, model, data, t)
        return add3(before, apply(elements, environment, model, data, t))

    return total


_massless = _sum(adds_mass=False)
_with_mass = _sum(adds_mass=True)


@compile_kernel
def _elements(loads, environment, model, data, t):
    """Add all that acts on bodies; planets and water read the inertia that `outward` left, so water comes last."""
    total = _massless(loads.elements, environment, model, data, t)
    if near_planet(environment.planet[0]):
        total = add3(total, planet.apply(environment.planet[0], model, data))
    return add3(total, _with_mass(loads.elements, environment, model, data, t))


@compile_inline
def _unobserved(kind, elements, environment, model, data, t, i):
    return 0.0, 0.0


def _either(number: int, observe: Callable, others: Callable) -> Callable:
    @compile_inline
    def choose(kind, elements, environment, model, data, t, i):
        if kind == number:
            return observe(elements, environment, model, data, t, i)
        return others(kind, elements, environment, model, data, t, i)

    return choose


def _observer() -> Callable:
    chosen = _unobserved
    for number, kind in enumerate(OBSERVED.values()):
        if kind.observe is not None:
            chosen = _either(number, kind.observe, chosen)
    return chosen


_observe = _observer()


@compile_kernel
def observe(loads, kind, i, model, data, t):
    """Return the channels of element i of a kind, which counts in `OBSERVED`, after `world`."""
    return _observe(kind, loads.elements, loads.environment, model, data, t, i)


def dense(system: System, packed: Packed, scene: Scene, y: np.ndarray) -> DenseLoads:
    """Return what all elements, and a planet, do: the reference implementation."""
    total = plus(hinge.dense(system, packed, y, scene.t), planet.dense(scene))
    for load in system.loads:
        for kind in KINDS.values():
            if isinstance(load, kind.record):
                total = plus(total, kind.dense(load, scene))
    return total


def tangents(scene: Scene) -> list[EndSlopes | BodySlopes]:
    """Return the forces of all elements but those of joints, and of a planet, with their derivatives."""
    kinds = ((load, kind) for load in scene.system.loads for kind in KINDS.values() if isinstance(load, kind.record))
    return [*planet.tangent(scene), *(kind.tangent(load, scene) for load, kind in kinds)]
