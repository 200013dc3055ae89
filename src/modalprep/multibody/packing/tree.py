"""Pack a system for the kernels: its tree of links and its modes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.mass import affine_part
from modalprep.multibody.kernels.data import (
    ALIGN,
    BODY,
    COORDINATES,
    EPSILON,
    FIXED,
    FREE,
    GROUND_RATE,
    HAS_KG,
    INTS,
    JOINT,
    KIND,
    MASS,
    MODES,
    NODE,
    NODES,
    NX,
    PARENT,
    PHI,
    PRESCRIBED_PRISMATIC,
    PRESCRIBED_REVOLUTE,
    PRISMATIC,
    REVOLUTE,
    SLOT,
    SPEEDS,
    SPHERICAL,
    UQ,
    WELD,
    XQ,
    Flex,
    Tree,
    U,
    X,
)
from modalprep.multibody.model.joint import Joint
from modalprep.multibody.model.system import System


@dataclass(frozen=True)
class Link:
    """One link: its joint, which hinge of the joint it is, its body (None for a massless link)."""

    joint: Joint
    hinge: int
    body: str | None


@dataclass(frozen=True)
class Packed:
    """A system in arrays; fresh, contiguous and writable.

    `nx`, `nu` are the numbers of coordinates and speeds, `flex` is None in a system without modes.
    """

    tree: Tree
    flex: Flex | None
    links: tuple[Link, ...]
    nx: int
    nu: int

    @property
    def types(self) -> np.ndarray:
        """Kernel joint type of every link (nl,)."""
        return self.tree.ints[:, JOINT]

    def link_of(self, body: str) -> int:
        """Return the link that carries a body."""
        return next(i for i, link in enumerate(self.links) if link.body == body)

    def links_of(self, joint: str) -> list[int]:
        """Return the links of a joint, inboard first."""
        return [i for i, link in enumerate(self.links) if link.joint.name == joint]

    def coordinates_of(self, joint: str) -> list[int]:
        """Return the places of a joint's coordinates in the state."""
        ints, types = self.tree.ints, self.types
        return [int(ints[i, X]) + k for i in self.links_of(joint) for k in range(COORDINATES[types[i]])]

    def speeds_of(self, joint: str) -> list[int]:
        """Return the numbers of a joint's speeds, the first of all is 0."""
        ints, types = self.tree.ints, self.types
        return [int(ints[i, U]) + k for i in self.links_of(joint) for k in range(SPEEDS[types[i]])]

    def align(self, link: int) -> np.ndarray:
        """Return the rotation from a link's frame to its body's frame (3, 3)."""
        return self.tree.fixed[link, ALIGN : ALIGN + 9].reshape(3, 3)


def pack(system: System) -> Packed:
    """Return the arrays of a system.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm", axis=np.array([0, 1.0, 0]))
    >>> packed = pack(System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,)))
    >>> packed.nx, packed.tree.ints[0, MODES], packed.align(0)[:, 2]
    (3, np.int64(2), array([0., 1., 0.]))
    """
    links, frames = _links(system)
    ints, bodies = _ints(system, links, frames)
    fixed = [_fixed(system, links, frames, ints, i) for i in range(len(links))]
    nodes = [np.pad(position @ a, ((0, 0), (0, FIXED - 3))) for a, position in bodies.positions]
    ground = np.zeros(FIXED)
    ground[:3], ground[GROUND_RATE] = system.gravity, system.orbit.rate if system.orbit else 0.0
    tree = Tree(ints, np.vstack([*fixed, *nodes, ground]))
    nu = int(ints[-1, UQ] + ints[-1, MODES])
    return Packed(tree, bodies.flex(), tuple(links), int(ints[0, NX]), nu)


def hinges(joint: Joint) -> list[tuple[int, np.ndarray]]:
    """Return the kernel types and axes (in the parent's frame at zero) of a joint's hinges, inboard first."""
    z = np.array([0, 0, 1.0])
    if joint.type in ("weld", "spherical", "free"):
        return [({"weld": WELD, "spherical": SPHERICAL, "free": FREE}[joint.type], z)]
    moved, first = joint.motion is not None, joint.second_axis
    turn, travel = (PRESCRIBED_REVOLUTE, PRESCRIBED_PRISMATIC) if moved else (REVOLUTE, PRISMATIC)
    if joint.type in ("revolute", "prismatic"):
        return [(turn if joint.type == "revolute" else travel, joint.axis)]
    if joint.type == "cylindrical":
        return [(travel, joint.axis), (turn, joint.axis)]
    if joint.type == "universal":
        return [(turn, joint.axis), (turn, first)]
    if joint.type == "gimbal":
        return [(turn, axis) for axis in (joint.axis, first, np.cross(joint.axis, first))]
    return [(travel, first), (travel, np.cross(joint.axis, first)), (turn, joint.axis)]


def turn_to(axis: np.ndarray) -> np.ndarray:
    """Return the rotation that takes z to a unit axis by the shortest way.

    Examples
    --------
    >>> turn_to(np.array([0, 0, -1.0])) @ [0, 0, 1]
    array([ 0.,  0., -1.])
    """
    x, y, z = axis
    if z < -1 + 1e-12:
        return np.diag([1.0, -1.0, -1.0])
    f = 1 / (1 + z)
    return np.array([[1 - f * x * x, -f * x * y, x], [-f * x * y, 1 - f * y * y, y], [-x, -y, z]])


def _links(system: System) -> tuple[list[Link], list[tuple[int, np.ndarray, np.ndarray]]]:
    """Return the links, and of each its type, its frame at zero in the parent's body frame, its align."""
    links, frames = [], []
    for name in system.order:
        joint = system.carrier(name)
        chain = hinges(joint)
        for k, (kind, axis) in enumerate(chain):
            last = k == len(chain) - 1
            links.append(Link(joint, k, name if last else None))
            moves = kind not in (WELD, SPHERICAL, FREE)
            align = turn_to(joint.rotation.T @ axis) if last and moves else np.eye(3)
            start = np.eye(3) if kind in (SPHERICAL, FREE) else joint.rotation @ align if last else turn_to(axis)
            frames.append((kind, start, align))
    return links, frames


def _ints(system: System, links: list[Link], frames: list) -> tuple[np.ndarray, _Bodies]:
    ints = np.full((len(links), INTS), -1, dtype=np.int64)
    bodies, x, u, slot, phi = _Bodies(), 0, 0, 0, 0
    depleted = [each.body for each in system.depletions]
    place = {link.body: i for i, link in enumerate(links) if link.body}
    order = {name: i for i, name in enumerate(system.order)}
    for i, (link, (kind, _, align)) in enumerate(zip(links, frames, strict=True)):
        row = ints[i]
        row[JOINT], row[X], row[U], row[MODES], row[NODE], row[HAS_KG] = kind, x, u, 0, 0, 0
        row[XQ], row[UQ] = x + COORDINATES[kind], u + SPEEDS[kind]
        parent = system.parent(link.joint)
        if link.hinge > 0:
            row[PARENT] = i - 1
        elif parent is not None:
            row[PARENT], row[NODE] = place[parent[0]], parent[1]
            if system.bodies[parent[0]].n:
                row[PHI], phi = phi, phi + 1
        if link.body:
            body = system.bodies[link.body]
            own = link.body in depleted
            row[BODY], row[MODES] = order[link.body], body.n
            row[HAS_KG] = 2 if body.T is not None else body.has_geometric_stiffness or own or not body.normalised
            row[NODES], row[KIND] = bodies.add(body, align, link.body if own else "")
            if body.n:
                row[SLOT], slot = slot, slot + 1
        x, u = row[XQ] + row[MODES], row[UQ] + row[MODES]
    ints[:, NX] = x
    return ints, bodies


def _fixed(system: System, links: list[Link], frames: list, ints: np.ndarray, i: int) -> np.ndarray:
    link, (_, start, align), row = links[i], frames[i], np.zeros(FIXED)
    turn, arm = start, np.zeros(3)
    if link.hinge > 0:
        turn = frames[i - 1][1].T @ start
    elif ints[i, PARENT] >= 0:
        parent = links[ints[i, PARENT]]
        to_link = frames[ints[i, PARENT]][2].T
        turn, arm = to_link @ start, to_link @ system.bodies[parent.body].interface_position[ints[i, NODE]]
    elif link.joint.type != "free":
        arm = link.joint.position
    row[:ALIGN] = [*turn.ravel(), *arm]
    row[ALIGN:MASS] = align.ravel()
    if link.body:
        row[MASS:] = rigid_constants(system.bodies[link.body], align)
    return row


def rigid_constants(body: FlexibleBody, align: np.ndarray) -> np.ndarray:
    """Return m, s0 (3) and the moment of inertia (6: xx, xy, xz, yy, yz, zz) in a link's frame."""
    J = align.T @ (np.trace(body.E0) * np.eye(3) - body.E0) @ align
    return np.concatenate([[body.m], align.T @ body.s0, J[np.triu_indices(3)]])


class _Bodies:
    """Each distinct pair of body and alignment, once; bodies that lose mass each for itself."""

    def __init__(self) -> None:
        self.found: dict[tuple, tuple[int, int]] = {}
        self.positions: list[tuple[np.ndarray, np.ndarray]] = []
        self.nodes = 0
        self.flexible: list[tuple[FlexibleBody, np.ndarray]] = []

    def add(self, body: FlexibleBody, align: np.ndarray, own: str) -> tuple[int, int]:
        """Return the body's first interface and its flexible kind, -1 where it has no modes."""
        key = (id(body), align.round(14).tobytes(), own)
        if key not in self.found:
            kind = len(self.flexible) if body.n else -1
            self.found[key] = self.nodes, kind
            self.positions.append((align, body.interface_position))
            self.nodes += len(body.interface_name)
            self.flexible += [(body, align)] if body.n else []
        return self.found[key]

    def flex(self) -> Flex | None:
        """Return the arrays of the flexible bodies."""
        if not self.flexible:
            return None
        N, kinds = max(body.n for body, _ in self.flexible), len(self.flexible)
        first = {kind: node for node, kind in self.found.values()}
        N4 = N + -N % 4
        grows = N if any(body.T is not None for body, _ in self.flexible) else 0
        of_kind = ((25,), (12 * N,), (N4, 12 * N), (N4, 9 * N), (N4, 3 * N), (N, N), (N, 2), (grows, grows, grows))
        out = Flex(
            *(np.zeros((kinds, *shape)) for shape in of_kind),
            *(np.zeros((self.nodes, *shape)) for shape in ((6 * N,), (N, 6 * N))),
        )
        for k, (body, align) in enumerate(self.flexible):
            rows = slice(first[k], first[k] + len(body.interface_name))
            for number, (array, value) in enumerate(zip(out, _modes(body, align), strict=True)):
                place = k if number < len(of_kind) else rows
                array[place][(..., *(slice(size) for size in value.shape[-(array.ndim - 1) :]))] = value
        return out


def _modes(body: FlexibleBody, Q: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return the arrays of `Flex` of one body, its axes turned by Q; see there."""
    n, part = body.n, affine_part(body)
    base, by_q = (np.einsum("ar...,ac->...rc", x, Q) for x in (part.first, part.second))
    rest = np.einsum("abij,ac,bd->jicd", part.rest, Q, Q)
    gyro = np.einsum("cab,jiba->jic", EPSILON, rest)
    node = [np.concatenate([x @ Q, y @ Q], axis=-1) for x, y in (
        (body.phi.transpose(0, 2, 1), body.psi.transpose(0, 2, 1)),
        (body.Kg_F.transpose(0, 3, 2, 1), body.Kg_T.transpose(0, 3, 2, 1)),
    )]  # fmt: skip
    return (
        np.concatenate([(part.place.T @ Q).ravel(), (part.strain.T @ Q).ravel(), [part.root_mass]]),
        base.ravel(),
        by_q.swapaxes(0, 1).reshape(n, 12 * n),
        rest.reshape(n, 9 * n),
        gyro.reshape(n, 3 * n),
        part.mass,
        np.stack([body.K, body.D], axis=1),
        part.rest_second.swapaxes(0, 1),
        node[0].reshape(len(body.phi), 6 * n),
        node[1].reshape(len(body.phi), n, 6 * n),
    )
