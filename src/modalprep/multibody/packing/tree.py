"""Pack a system for the kernels: its tree of links, all of them at once."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cache
from operator import is_
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.multibody.kernels.data import (
    AFFINE,
    GROWS,
    LINK,
    UNIT,
    Model,
)
from modalprep.multibody.model.joint import Joint
from modalprep.multibody.model.joint_types import (
    FREE,
    JOINT_TYPES,
    KINDS,
    PRESCRIBED,
    REVOLUTE,
    SLIDING,
    TRAVEL,
    WITH_QUATERNION,
    Motion,
)
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.bodies import Bodies, rigid_constants
from modalprep.multibody.packing.packed import Link, Packed

Z = np.array([0, 0, 1.0])
HERE = np.zeros(3)
TOPOLOGY = (
    "parent",
    "interface",
    "joint",
    "along",
    "about",
    "modes",
    "x",
    "u",
    "xq",
    "uq",
    "slot",
    "body",
    "phi",
)


PACKED: WeakKeyDictionary[System, Packed] = WeakKeyDictionary()  # systems do not change, nor what is packed of them


def pack(system: System) -> Packed:
    """Return the model of a system, made at the first call.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm", axis=np.array([0, 1.0, 0]))
    >>> packed = pack(System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,)))
    >>> packed.nx, packed.model.links["modes"], packed.align(0)[:, 2]
    (3, array([2]), array([0., 1., 0.]))
    """
    if system not in PACKED:
        PACKED[system] = _pack(system)
    return PACKED[system]


def pack_changed(system: System, before: System) -> Packed:
    """Return the model of a system, the arrays of the one `before` where only starts, loads and gravity differ."""
    if not _same_tree(system, before):
        return pack(system)
    elements = ([joint.elements for joint in each.joints] for each in (system, before))
    kept = system.loads is before.loads and system.closures is before.closures and all(map(is_, *elements))
    joints = dict(zip(map(id, before.joints), system.joints, strict=True))
    PACKED[system] = found = pack(before).with_(joints, system.gravity, kept=kept)
    return found


def _same_tree(one: System, other: System) -> bool:
    """Whether two systems differ in nothing that `_pack` reads, but for gravity."""
    same = one.orbit is other.orbit and one.depletions is other.depletions
    same = same and list(one.bodies) == list(other.bodies) and all(map(is_, one.bodies.values(), other.bodies.values()))
    return same and len(one.joints) == len(other.joints) and all(map(Joint.moves_like, one.joints, other.joints))


def _pack(system: System) -> Packed:
    links, motions = _links(system)
    rows = _topology(system, links, motions)
    _place(system, links, rows, _frames(links, rows, motions), motions)
    bodies = _give_bodies(system, links, rows)
    rate = system.orbit.rate if system.orbit else 0.0
    nx, nu = (int(rows[-1][name] + rows[-1]["modes"]) for name in ("xq", "uq"))
    gravity = np.array(system.gravity, dtype=float)
    model = Model(rows.view(np.recarray), bodies.nodes(), gravity, float(rate), nx, bodies.modal())
    return Packed(model, links, nu, bool(system.depletions))


def rows(dtype: np.dtype, values: Sequence[tuple]) -> np.recarray:
    """Return rows of records, whose fields plain Python reads as attributes too.

    Examples
    --------
    >>> rows(np.dtype([("link", np.int64), ("axis", float, 3)]), [(2, (0, 0, 1.0))])[0].axis
    array([0., 0., 1.])
    """
    return np.array(list(values), _record(dtype)).reshape(len(values)).view(np.recarray)


def blank(dtype: np.dtype, *shape: int) -> np.recarray:
    """Return rows of zeros, see `rows`."""
    return np.zeros(shape, _record(dtype)).view(np.recarray)


@cache
def _record(dtype: np.dtype) -> np.dtype:
    """Return the type that a recarray of a type has; it would make one of its own, which takes longer to compare."""
    return np.dtype((np.record, dtype))


class Hinge(NamedTuple):
    """One motion of a joint: kind of link, axis, travel and turn per unit, place relative to the motion before.

    Axis and place are in the parent's frame at zero.
    """

    kind: int
    axis: np.ndarray
    along: float = 0.0
    about: float = 0.0
    arm: np.ndarray = HERE


def hinges(joint: Joint) -> list[Hinge]:
    """Return the motions of a joint, inboard first."""
    steps = JOINT_TYPES[joint.type]
    if not steps.motions:
        return [Hinge(steps.kind, Z)]
    axes = joint.axes if len(steps.motions) > 1 else (joint.axis,)
    return [_hinge(joint, motion, axes) for motion in steps.motions]


def _hinge(joint: Joint, motion: Motion, axes: tuple[np.ndarray, ...]) -> Hinge:
    along, about = (1.0, 0.0) if motion.kind == TRAVEL else (0.0, 1.0)
    if motion.pitch:
        along = getattr(joint, motion.pitch) / (2 * np.pi)
    kind = PRESCRIBED if joint.motion is not None else SLIDING if along else REVOLUTE
    arm = getattr(joint, motion.offset[0]) * axes[motion.offset[1]] if motion.offset else HERE
    return Hinge(kind, axes[motion.axis], along, about, arm)


def turn_to(axis: np.ndarray) -> np.ndarray:
    """Return the rotations ``(..., 3, 3)`` that take z to unit axes ``(..., 3)`` by the shortest way.

    Examples
    --------
    >>> turn_to(np.array([0, 0, -1.0])) @ [0, 0, 1]
    array([ 0.,  0., -1.])
    """
    x, y, z = np.moveaxis(axis, -1, 0)
    opposite = z < -1 + 1e-12
    f = 1 / np.where(opposite, 1.0, 1 + z)
    found = np.empty((*z.shape, 3, 3))
    found[..., 0, 0] = 1 - f * x * x
    found[..., 0, 1] = -f * x * y
    found[..., 0, 2] = x
    found[..., 1, 0] = -f * x * y
    found[..., 1, 1] = 1 - f * y * y
    found[..., 1, 2] = y
    found[..., 2, 0], found[..., 2, 1], found[..., 2, 2] = -x, -y, z
    found[opposite] = np.diag([1.0, -1.0, -1.0])
    return found


def _links(system: System) -> tuple[tuple[Link, ...], list[Hinge]]:
    """Return the links, parents first, and their motions."""
    links, motions = [], []
    for name in system.order:
        joint = system.carrier(name)
        chain = hinges(joint)
        links += [Link(joint, k, None) for k in range(len(chain) - 1)]
        links.append(Link(joint, len(chain) - 1, name))
        motions += chain
    return tuple(links), motions


def _frames(links: tuple[Link, ...], rows: np.ndarray, motions: list[Hinge]) -> np.ndarray:
    """Return the links' frames at zero in those of their parents' bodies (nl, 3, 3), and write `align`."""
    axes = np.array([hinge.axis for hinge in motions])
    rotation = np.array([link.joint.rotation for link in links])
    last = _column(link.body is not None for link in links)
    kind = rows["joint"]
    along_z = turn_to(np.where(last[:, None], (rotation.swapaxes(1, 2) @ axes[:, :, None])[:, :, 0], axes))
    has_axis = (rows["along"] != 0) | (rows["about"] != 0)
    align = np.where((last & has_axis)[:, None, None], along_z, np.eye(3))
    rows["align"] = align.reshape(-1, 9)
    start = np.where(last[:, None, None], rotation @ align, along_z)
    start[np.isin(kind, WITH_QUATERNION)] = np.eye(3)
    return start


def _place(system: System, links: tuple[Link, ...], rows: np.ndarray, start: np.ndarray, motions: list[Hinge]) -> None:
    """Write where each link's frame is in that of its parent."""
    parent = rows["parent"]
    inner = _column(link.hinge > 0 for link in links)
    outer = np.flatnonzero(~inner & (parent < len(links)))
    turn = start.copy()
    arm = np.array([link.joint.position for link in links])
    arm[rows["joint"] == FREE] = 0.0
    to_inner = start[parent[inner]].swapaxes(1, 2)
    offsets = np.array([hinge.arm for hinge in motions])
    arm[inner] = (to_inner @ offsets[inner, :, None])[:, :, 0]
    turn[inner] = to_inner @ start[inner]
    if len(outer):
        ends = zip(parent[outer].tolist(), rows["interface"][outer].tolist(), strict=True)
        places = np.array([system.bodies[links[i].body].interface_position[k] for i, k in ends])
        to_link = rows["align"][parent[outer]].reshape(-1, 3, 3).swapaxes(1, 2)
        turn[outer] = to_link @ start[outer]
        arm[outer] = (to_link @ places[:, :, None])[:, :, 0]
    rows["rotation"] = turn.reshape(-1, 9)
    rows["arm"] = arm


def _column(values: Iterable[bool]) -> np.ndarray:
    return np.fromiter(values, dtype=bool)


def _topology(system: System, links: tuple[Link, ...], motions: list[Hinge]) -> np.ndarray:
    """Return the links (nl,) with their parents, motions and places in the state."""
    carrier = {link.body: i for i, link in enumerate(links) if link.body}
    number = {name: i for i, name in enumerate(system.order)}
    found = []
    x = 0
    u = 0
    slot = 0
    phi = 0
    for i, (link, hinge) in enumerate(zip(links, motions, strict=True)):
        body = system.bodies[link.body] if link.body else None
        modes = body.n if body else 0
        xq = x + KINDS[hinge.kind].coordinates
        uq = u + KINDS[hinge.kind].speeds
        parent = i - 1
        interface = 0
        flexible = False
        if link.hinge == 0:
            end = system.parent(link.joint)
            parent, interface = (carrier[end[0]], end[1]) if end else (len(links), 0)
            flexible = bool(end and system.bodies[end[0]].n)
        found.append(
            (
                parent,
                interface,
                hinge.kind,
                hinge.along,
                hinge.about,
                modes,
                x,
                u,
                xq,
                uq,
                slot if modes else -1,
                number[link.body] if link.body else -1,
                phi if flexible else -1,
            )
        )
        slot = slot + (modes > 0)
        phi = phi + flexible
        x = xq + modes
        u = uq + modes
    rows = np.zeros(len(links), LINK)
    for name, column in zip(TOPOLOGY, zip(*found, strict=True), strict=True):
        rows[name] = column
    rows["last_child"] = -1
    carried = np.flatnonzero(rows["parent"] < len(rows))
    rows["last_child"][rows["parent"][carried]] = carried
    return rows


def _give_bodies(system: System, links: tuple[Link, ...], rows: np.ndarray) -> Bodies:
    """Write the masses of the links, and return the distinct bodies."""
    bodies = Bodies()
    depleted = {each.body for each in system.depletions}
    rows["kind"] = rows["first_interface"] = rows["stations"] = rows["dampers"] = -1
    names = {i: link.body for i, link in enumerate(links) if link.body}
    carriers = np.array(list(names))
    aligns = rows["align"][carriers].reshape(-1, 3, 3)
    carried = [system.bodies[name] for name in names.values()]
    owners = [name if name in depleted else "" for name in names.values()]
    rows["modal_mass"][carriers] = [_modal_mass(*pair) for pair in zip(carried, owners, strict=True)]
    found = [bodies.add(*each) for each in zip(carried, aligns, _keys(aligns), owners, strict=True)]
    rows["first_interface"][carriers], rows["kind"][carriers] = np.transpose(found)
    for row, kind in enumerate(bodies.damped):
        rows["dampers"][rows["kind"] == kind] = row
    counts = np.array([len(body.stations) if body.stations else 0 for body in carried])
    rows["stations"][carriers] = np.where(counts, np.cumsum(counts) - counts, -1)
    for name, values in zip(("mass", "first_moment", "inertia"), rigid_constants(carried, aligns), strict=True):
        rows[name][carriers] = values
    return bodies


def _modal_mass(body: FlexibleBody, owner: str) -> int:
    if body.T is not None:
        return GROWS
    return AFFINE if owner or body.stations or body.has_geometric_stiffness or not body.normalised else UNIT


def _keys(aligns: np.ndarray) -> list[bytes]:
    """Return the same key for rotations ``(n, 3, 3)`` that are equal to round-off."""
    return [each.tobytes() for each in aligns.round(14) + 0.0]
