"""Pack a system for the kernels: its tree of links and its modes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.line import strain_arms
from modalprep.body.mass import affine_part
from modalprep.multibody.kernels.data import (
    AFFINE,
    COORDINATES,
    EPSILON,
    FREE,
    GROWS,
    LINK,
    PRESCRIBED,
    REVOLUTE,
    SLIDING,
    SPEEDS,
    SPHERICAL,
    UNIT,
    WELD,
    Integrals,
    Modal,
    Model,
)
from modalprep.multibody.model.joint import Joint
from modalprep.multibody.model.joint_types import JOINT_TYPES, SCREW, TRAVEL, TURN
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.packed import Link, Packed


def pack(system: System) -> Packed:
    """Return the model of a system.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm", axis=np.array([0, 1.0, 0]))
    >>> packed = pack(System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,)))
    >>> packed.nx, packed.model.links["modes"], packed.align(0)[:, 2]
    (3, array([2]), array([0., 1., 0.]))
    """
    links, frames = _links(system)
    rows, bodies = _topology(system, links, frames)
    for i in range(len(links)):
        _place(system, links, frames, rows, i)
    nodes = np.vstack([position @ a for a, position in bodies.positions])
    rate = system.orbit.rate if system.orbit else 0.0
    nx, nu = (int(rows[-1][name] + rows[-1]["modes"]) for name in ("xq", "uq"))
    model = Model(rows, nodes, np.array(system.gravity, dtype=float), float(rate), nx, bodies.modal())
    return Packed(model, tuple(links), nu, bool(system.depletions))


def rows(dtype: np.dtype, values: Sequence[tuple]) -> np.recarray:
    """Return rows of records, whose fields plain Python reads as attributes too.

    Examples
    --------
    >>> rows(np.dtype([("link", np.int64), ("axis", float, 3)]), [(2, (0, 0, 1.0))])[0].axis
    array([0., 0., 1.])
    """
    return np.array(list(values), dtype).reshape(len(values)).view(np.recarray)


class Hinge(NamedTuple):
    """One motion of a joint: kernel type, axis in the parent's frame at zero, travel and turn per unit."""

    kind: int
    axis: np.ndarray
    along: float = 0.0
    about: float = 0.0


def hinges(joint: Joint) -> list[Hinge]:
    """Return the motions of a joint, inboard first."""
    motions, z = JOINT_TYPES[joint.type].motions, np.array([0, 0, 1.0])
    if not motions:
        return [Hinge({"weld": WELD, "spherical": SPHERICAL, "free": FREE}[joint.type], z)]
    found = []
    for motion, axis in motions:
        along, about = {TRAVEL: (1.0, 0.0), TURN: (0.0, 1.0), SCREW: (joint.pitch / (2 * np.pi), 1.0)}[motion]
        kind = PRESCRIBED if joint.motion is not None else REVOLUTE if motion == TURN else SLIDING
        found.append(Hinge(kind, joint.axes[axis], along, about))
    return found


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


def _links(system: System) -> tuple[list[Link], list[_Frame]]:
    """Return the links and their frames."""
    links, frames = [], []
    for name in system.order:
        joint = system.carrier(name)
        chain = hinges(joint)
        for k, hinge in enumerate(chain):
            last = k == len(chain) - 1
            links.append(Link(joint, k, name if last else None))
            align = turn_to(joint.rotation.T @ hinge.axis) if last and (hinge.along or hinge.about) else np.eye(3)
            start = joint.rotation @ align if last else turn_to(hinge.axis)
            frames.append(_Frame(hinge, np.eye(3) if hinge.kind in (SPHERICAL, FREE) else start, align))
    return links, frames


class _Frame(NamedTuple):
    """Motion of a link, its frame at zero in the parent's body frame (3, 3), its axes in those of its body (3, 3)."""

    hinge: Hinge
    start: np.ndarray
    align: np.ndarray


def _topology(system: System, links: list[Link], frames: list[_Frame]) -> tuple[np.ndarray, _Bodies]:
    """Return the links (nl,) with everything but frames and masses, and the distinct bodies."""
    rows = np.zeros(len(links), LINK).view(np.recarray)
    rows["kind"] = rows["slot"] = rows["body"] = rows["phi"] = rows["first_interface"] = -1
    bodies, x, u, slot, phi = _Bodies(), 0, 0, 0, 0
    depleted = [each.body for each in system.depletions]
    carrier = {link.body: i for i, link in enumerate(links) if link.body}
    order = {name: i for i, name in enumerate(system.order)}
    for i, (link, (hinge, _, align)) in enumerate(zip(links, frames, strict=True)):
        row, kind = rows[i], hinge.kind
        row["along"], row["about"] = hinge.along, hinge.about
        row["joint"], row["x"], row["u"], row["parent"] = kind, x, u, len(links)
        row["xq"], row["uq"] = x + COORDINATES[kind], u + SPEEDS[kind]
        parent = system.parent(link.joint)
        if link.hinge > 0:
            row["parent"] = i - 1
        elif parent is not None:
            row["parent"], row["interface"] = carrier[parent[0]], parent[1]
            if system.bodies[parent[0]].n:
                row["phi"], phi = phi, phi + 1
        if link.body:
            body, own = system.bodies[link.body], link.body in depleted
            row["body"], row["modes"], row["modal_mass"] = order[link.body], body.n, _modal_mass(body, own)
            row["first_interface"], row["kind"] = bodies.add(body, align, link.body if own else "")
            if body.n:
                row["slot"], slot = slot, slot + 1
        x, u = row["xq"] + row["modes"], row["uq"] + row["modes"]
    return rows, bodies


def _modal_mass(body: FlexibleBody, depletes: bool) -> int:
    if body.T is not None:
        return GROWS
    return AFFINE if body.has_geometric_stiffness or depletes or not body.normalised else UNIT


def _place(system: System, links: list[Link], frames: list[_Frame], rows: np.ndarray, i: int) -> None:
    """Write the frames and the mass of link i."""
    link, (_, start, align), row = links[i], frames[i], rows[i]
    turn, arm = start, np.zeros(3)
    if link.hinge > 0:
        turn = frames[i - 1].start.T @ start
    elif row["parent"] < len(links):
        parent, to_link = links[row["parent"]], frames[row["parent"]].align.T
        turn, arm = to_link @ start, to_link @ system.bodies[parent.body].interface_position[row["interface"]]
    elif link.joint.type != "free":
        arm = link.joint.position
    row["rotation"], row["arm"], row["align"] = turn.ravel(), arm, align.ravel()
    if link.body:
        row["mass"], row["first_moment"], row["inertia"] = rigid_constants(system.bodies[link.body], align)


def rigid_constants(body: FlexibleBody, align: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Return m, s0 (3,) and the moment of inertia (6,: xx, xy, xz, yy, yz, zz) in a link's frame."""
    J = align.T @ (np.trace(body.E0) * np.eye(3) - body.E0) @ align
    return body.m, align.T @ body.s0, J[np.triu_indices(3)]


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

    def modal(self) -> Modal | None:
        """Return the constants of the flexible bodies."""
        if not self.flexible:
            return None
        N, kinds = max(body.n for body, _ in self.flexible), len(self.flexible)
        first = {kind: node for node, kind in self.found.values()}
        N4 = N + -N % 4
        grows = N if any(body.T is not None for body, _ in self.flexible) else 0
        of_kind = ((25,), (12 * N,), (N4, 12 * N), (N4, 9 * N), (N4, 3 * N), (N, N), (N, 2), (grows, grows, grows))
        out = [
            *(np.zeros((kinds, *shape)) for shape in of_kind),
            *(np.zeros((self.nodes, *shape)) for shape in ((6 * N,), (N, 6 * N), (3,))),
        ]
        for k, (body, align) in enumerate(self.flexible):
            rows = slice(first[k], first[k] + len(body.interface_name))
            for number, (array, value) in enumerate(zip(out, _modes(body, align), strict=True)):
                place = k if number < len(of_kind) else rows
                array[place][(..., *(slice(size) for size in value.shape[-(array.ndim - 1) :]))] = value
        integrals = len(Integrals._fields)
        return Modal(Integrals(*out[:integrals]), *out[integrals:])


def _modes(body: FlexibleBody, Q: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return the arrays of `Integrals` and `Modal` of one body, its axes turned by Q; see there."""
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
        strain_arms(body.interface_position, body.points) @ Q,
    )
