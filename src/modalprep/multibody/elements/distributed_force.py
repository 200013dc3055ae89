"""Forces on all mesh points of a body (`DistributedForce`)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from modalprep.compiler.by_address import by_address
from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.multibody.elements.dense import BodyState, DenseLoads, Scene, value_at
from modalprep.multibody.elements.packer import ElementKind, Packer
from modalprep.multibody.elements.slopes import BodySlopes
from modalprep.multibody.kernels.algebra.matrices import (
    UNIT9,
    times,
    transposed_times,
)
from modalprep.multibody.kernels.algebra.tuples import (
    axpy9,
    dot3,
    get3,
    get9,
)
from modalprep.multibody.kernels.interfaces import add_at_origin, seen_spin
from modalprep.multibody.kernels.time_tables import value
from modalprep.multibody.model.loads import DistributedForce
from modalprep.multibody.packing.tree import rows
from modalprep.vectors import skew

ROW = np.dtype(
    [
        ("link", np.int64),
        ("follows", np.int64),  # whether its axes are those of the body
        ("factor", np.int64),  # function of time
        ("force", np.float64, 3),  # sum F_b; b in the axes of the load
        ("moments", np.float64, 9),  # sum x_a F_b, by rows; a in the axes of the link
    ]
)


@by_address
class Distributed(NamedTuple):
    """Packed distributed forces."""

    rows: np.ndarray  # (forces,) ROW
    modes: np.ndarray  # (forces, N, 9): sum phi_a F_b


def pack(packer: Packer, loads: Sequence[DistributedForce]) -> Distributed:
    """Return the rows, and the modal loads of a unit factor."""
    found = [_row(packer, load) for load in loads]
    N = max((len(own) for _, own in found), default=0)
    modes = np.zeros((len(found), N, 9))
    for k, (_, own) in enumerate(found):
        modes[k, : len(own)] = own
    return Distributed(rows(ROW, [row for row, _ in found]), modes)


def _row(packer: Packer, load: DistributedForce) -> tuple[tuple, np.ndarray]:
    body = packer.system.bodies[load.body]
    link = packer.packed.link_of(load.body)
    to_link = packer.packed.align(link).T
    follows = load.axes == "body"
    force = load.force @ to_link.T if follows else load.force
    shape = np.einsum("ac,pci->pai", to_link, body.shape)
    first = np.einsum("pa,pb->ab", body.points @ to_link.T, force)
    modes = np.einsum("pai,pb->iab", shape, force).reshape(body.n, 9)
    factor = packer.table(f"force {load.name!r}", load.factor)
    return (link, follows, factor, force.sum(axis=0), first.ravel()), modes


@compile_kernel
def apply(elements, environment, model, data, t):
    """Add the forces on all points, which move with them; returns their power, 0, 0."""
    packed = elements.distributed_force
    power = 0.0
    for i in range(len(packed.rows)):
        power += _one(packed.rows[i], packed.modes[i], environment, model, data, t)
    return power, 0.0, 0.0


@compile_kernel
def _one(own, modes, environment, model, data, t):
    factor = value(environment.tables, own.factor, t)
    link = data.links[own.link]
    base = get9(link.orientation)
    turn = UNIT9  # axes of the load to those of the link
    if not own.follows:
        turn = (base[0], base[3], base[6], base[1], base[4], base[7], base[2], base[5], base[8])
    f = times(turn, get3(own.force))
    X, power = _modal(data.modal, model, own.link, modes, factor, turn, get9(own.moments))
    x = times(turn, (X[0], X[1], X[2]))
    y = times(turn, (X[3], X[4], X[5]))
    z = times(turn, (X[6], X[7], X[8]))
    m = (y[2] - z[1], z[0] - x[2], x[1] - y[0])  # sum r x F from the columns of sum r F'
    power += dot3(f, transposed_times(base, get3(link.velocity))) + dot3(m, seen_spin(data, own.link))
    add_at_origin(link, (factor * f[0], factor * f[1], factor * f[2]), (factor * m[0], factor * m[1], factor * m[2]))
    return factor * power


@compile_inline
def _modal(modal, model, link, shapes, factor, turn, X):
    """Add distributed forces to the modal loads; returns ``sum x_a F_b`` at the deflection, and their power."""
    power = 0.0
    if modal is not None:
        s = model.links[link].slot
        if s >= 0:
            for a in range(model.links[link].modes):
                N = get9(shapes[a])
                own = 0.0
                for c in range(9):
                    own += N[c] * turn[c]
                modal.load[s, a] += factor * own
                power += own * modal.qd[s, a]
                X = axpy9(X, modal.q[s, a], N)
    return X, power


def dense(load: DistributedForce, scene: Scene) -> DenseLoads:
    """Sum the mesh points, each with its own partial velocities: the reference implementation."""
    s: BodyState = scene.states[load.body]
    f = np.zeros(s.J.shape[1])
    power = 0.0
    for x, shape, force in zip(s.body.points, s.body.shape, load.force, strict=True):
        own = value_at(load.factor, scene.t) * (force if load.axes == "body" else s.R.T @ force)
        r = x + shape @ s.q
        J = s.J[:3] - skew(r) @ s.J[3:]
        J[:, s.rows] += shape
        f += J.T @ own
        power += own @ (s.V[:3] + np.cross(s.V[3:], r) + shape @ s.qd)
    return DenseLoads(f, power, 0.0, 0.0)


def tangent(load: DistributedForce, scene: Scene) -> BodySlopes:
    """Return the forces with their derivatives: they turn with the body, or not at all, and their points move."""
    s = scene.states[load.body]
    inertial = load.axes != "body"
    forces = value_at(load.factor, scene.t) * load.force @ (s.R if inertial else np.eye(3))
    modes = np.einsum("pai,pb->abi", s.body.shape, forces)  # sum phi_a F_b
    moments = s.body.points.T @ forces + modes @ s.q  # sum x_a F_b
    total = forces.sum(axis=0)
    by_pose = np.zeros((6 + s.body.n, 6))
    for k, axis in enumerate(inertial * skew(np.eye(3))):
        turned = np.einsum("abi,bc->aci", modes, axis)
        by_pose[:, 3 + k] = np.concatenate([total @ axis, _torque(moments @ axis), np.einsum("aai->i", turned)])
    by_q = np.concatenate([np.zeros((3, s.body.n)), _torque(modes), np.zeros((s.body.n, s.body.n))])
    force = np.concatenate([total, _torque(moments), np.einsum("aai->i", modes)])
    return BodySlopes(load.body, force, by_pose, by_q=by_q)


def _torque(X: np.ndarray) -> np.ndarray:
    """Return the torque of ``X = sum x_a F_b (3, 3, ...)``."""
    return np.stack([X[1, 2] - X[2, 1], X[2, 0] - X[0, 2], X[0, 1] - X[1, 0]])


KIND = ElementKind(DistributedForce, pack, apply, dense, tangent)
