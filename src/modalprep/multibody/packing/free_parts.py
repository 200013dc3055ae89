"""The parts of a system that nothing holds: which bodies and links they have, and what loads them from outside."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from modalprep.multibody.model.constraints import Coupler
from modalprep.multibody.model.environment import CentralGravity
from modalprep.multibody.model.loads import GROUND, Load, TwoEnded
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.packed import Packed


class FreePart(NamedTuple):
    """Bodies that no joint, closure or spring ties to the ground, and why their momenta may change ("": they stay)."""

    bodies: tuple[str, ...]
    loaded: str


def free_parts(system: System) -> tuple[FreePart, ...]:
    """Return the parts of a system that are not held, in the order of their first bodies.

    Closures count whether they are active or not. Uniform gravity loads nothing: the momenta change by its share.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.multibody.model.system import System
    >>> kinds = {"a": "free", "b": "weld"}
    >>> joints = [Joint(name=f"j{k}", type=kind, parent="ground", child=k) for k, kind in kinds.items()]
    >>> free_parts(System(bodies={"a": uniform_beam(modes=1), "b": uniform_beam(modes=1)}, joints=tuple(joints)))
    (FreePart(bodies=('a',), loaded=''),)
    """
    group = {name: {name} for name in (GROUND, *system.order)}
    for a, b in _ties(system):
        if group[a] is not group[b]:
            both = group[a] | group[b]
            group.update(dict.fromkeys(both, both))
    parts = {id(group[name]): group[name] for name in system.order if group[name] is not group[GROUND]}
    found = (tuple(name for name in system.order if name in part) for part in parts.values())
    return tuple(FreePart(bodies, _loaded(system, set(bodies))) for bodies in found)


def _ties(system: System) -> Iterator[tuple[str, str]]:
    """Yield the two bodies, or a body and the ground, of all that can exert a force between them.

    A coupler acts within joints. A free joint to another body exerts nothing, but its speeds are relative to that body.
    """
    for joint in system.joints:
        if joint.type != "free" or _body(joint.parent) != GROUND:
            yield _body(joint.parent), system.child(joint)
    for closure in system.closures:
        if not isinstance(closure, Coupler):
            yield _body(closure.a), _body(closure.b)
    for load in system.loads:
        if isinstance(load, TwoEnded):
            yield _body(load.between[0]), _body(load.between[1])


def _body(end: str) -> str:
    return end.partition(".")[0]


def _loaded(system: System, bodies: set[str]) -> str:
    """Return what changes the momenta of a part besides uniform gravity, the first of it."""
    if system.orbit:
        return "the system is in orbit"
    for each in system.depletions:
        if each.body in bodies:
            return f"body {each.body!r} loses mass"
    for load in system.loads:
        if not isinstance(load, TwoEnded) and (_where(load) or bodies) & bodies:
            return "a planet attracts it" if isinstance(load, CentralGravity) else f"load {load.name!r} acts on it"
    return ""


def _where(load: Load) -> set[str]:
    """Return the bodies that a load names; none of a load that may act anywhere."""
    ends = [getattr(load, "at", ""), getattr(load, "body", ""), *getattr(load, "through", ())]
    return {_body(end) for end in (*ends, *getattr(load, "flow_path", ())) if end}


def parts_of(system: System, packed: Packed) -> tuple[FreePart, ...]:
    """Return `free_parts`, found once for what is packed."""
    return packed.kept("free parts", lambda: (free_parts(system),))[0]


def part_of_links(system: System, packed: Packed) -> np.ndarray:
    """Return the number of each link's part (nl,) among those that nothing holds or loads; -1 elsewhere.

    Links without a body, of joints of several axes, belong to none.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.multibody.packing.tree import pack
    >>> kinds = {"a": "weld", "b": "free"}
    >>> joints = [Joint(name=f"j{k}", type=kind, parent="ground", child=k) for k, kind in kinds.items()]
    >>> system = System(bodies={"a": uniform_beam(modes=1), "b": uniform_beam(modes=1)}, joints=tuple(joints))
    >>> part_of_links(system, pack(system)).tolist()
    [-1, 0]
    """
    return packed.kept("parts", lambda: (_part_of_links(system, packed),))[0]


def count_parts(system: System, packed: Packed) -> int:
    """Return how many parts `part_of_links` has."""
    return 1 + int(part_of_links(system, packed).max(initial=-1))


def _part_of_links(system: System, packed: Packed) -> np.ndarray:
    found = np.full(len(packed.links), -1)
    audited = [part for part in parts_of(system, packed) if not part.loaded]
    for k, part in enumerate(audited):
        found[[packed.link_of(name) for name in part.bodies]] = k
    return found
