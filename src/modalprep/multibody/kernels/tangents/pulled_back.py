"""Products of the derivatives of the inverse dynamics with one vector, ``w' K`` and ``w' D``, in O(n): theory 5.8, 5.9.

With w for speeds each link has a twist, ``sum w J`` of all columns that move it. The rows of a speed count at its own
link and those before it, hence times the twist there; its column counts with the rows of all that follows it. By the
symmetry of the mass matrix both make the same sums over what a link carries: of the inertia of each link times its
twist, and of what its spin feels. So no row is taken to another link, and no matrix is filled.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.compiler.by_address import by_address
from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.compiler.lanes import WIDTH, add_lanes, four, get_lanes, put_lanes
from modalprep.multibody.kernels.algebra.matrices import symmetric_times, times, transposed_times
from modalprep.multibody.kernels.algebra.rows import dots6, rows3, rows6
from modalprep.multibody.kernels.algebra.tuples import (
    add3,
    axpy3,
    axpy6,
    cross,
    dot3,
    dot6,
    get3,
    get6,
    get9,
    get_angular,
    put3,
    put_angular,
    sub3,
    take3,
    take6,
)
from modalprep.multibody.kernels.data import Model
from modalprep.multibody.kernels.interfaces import free_position
from modalprep.multibody.kernels.tangents.inward import turned_wrench
from modalprep.multibody.kernels.tangents.outward import put_twist, shifted_twist
from modalprep.multibody.kernels.tangents.turns import add_turn_curvature

PULLED = np.dtype(
    [
        ("held", np.float64, 6),  # twist by w where the link's joint does not move
        ("twist", np.float64, 6),
        # of the link and its descendants, which the inward sweep adds
        ("momentum", np.float64, 6),  # inertia times twist
        ("spin", np.float64, 3),  # what the spin feels of the twists
        ("placed", np.float64, 6),  # products by displacement and rotation of what acts there
        ("moving", np.float64, 6),  # by velocity and angular velocity
    ]
)


@by_address
class Pulled(NamedTuple):
    """Work of the products; axes of the ground, at the origin of the link."""

    links: np.ndarray  # (nl + 1,) PULLED, the last is the ground
    modes: np.ndarray  # (3, nf, N) w of the modes, and both products


def new_pulled(model: Model) -> Pulled:
    """Return the work of a model."""
    links = np.zeros(len(model.links) + 1, PULLED).view(np.recarray)
    N = WIDTH if model.modal is None else model.modal.K.shape[1]
    return Pulled(links, np.zeros((3, max(1, int(model.links["slot"].max()) + 1), N)))


@compile_kernel
def pull_outward(model, data, work, pulled, w):
    """Write the twists of w (nu,), and what each link by itself makes of them; after `outward_tangents`."""
    for i in range(len(model.links)):
        _outward(work.modes, model, data, work, pulled, i, w)


@compile_kernel
def pull_inward(model, data, work, pulled, by_x, by_u):
    """Write ``w' K`` and ``w' D`` (nu,) of the derivatives by coordinates and speeds; after `pull_outward`.

    What acts on links and interfaces may have been added between the two. The wrenches of the work become those of all
    that a link carries.
    """
    for i in range(len(model.links) - 1, -1, -1):
        _own_modes(work.modes, model, work, pulled, i, by_x, by_u)
        _joint(model, work, pulled, i, by_x, by_u)
        if model.links[i].parent < len(model.links):
            _to_parent(work.modes, model, data, work, pulled, i)


@compile_inline
def _outward(modes, model, data, work, pulled, i, w):
    """Write twist, momentum and what the spin feels of link i."""
    link, frame, own = model.links[i], work.frames[i], pulled.links[i]
    parent = pulled.links[link.parent]
    arm = _arm(model, data, i)
    x = shifted_twist(get3(parent.twist), get_angular(parent.twist), arm)
    x = _moved_by_parent(modes, model, pulled, i, x)
    put_twist(own.held, 0, x)
    for s in range(link.uq - link.u):
        x = _added(x, w[link.u + s], work.columns[frame.first + s])
    put_twist(own.twist, 0, x)
    f, t = _momentum(frame, x)
    spin = add3(transposed_times(get9(frame.gyro), x[0]), transposed_times(get9(frame.gyro[9:]), x[1]))
    if modes is not None:
        if link.slot >= 0:
            more, turning = _of_modes(model, work, pulled, i, w)
            f, t = add3(f, take3(more, 0)), add3(t, take3(more, 3))
            spin = add3(spin, turning)
    put_twist(own.momentum, 0, (f, t))
    put3(own.spin, spin)
    own.placed[:] = own.moving[:] = 0.0


@compile_inline
def _momentum(frame, x):
    """Return the inertia of a link, its modes held, times a twist x, as force and torque."""
    s = get3(frame.first_moment)
    f = axpy3(cross(x[1], s), frame.mass, x[0])
    return f, add3(cross(s, x[0]), symmetric_times(get6(frame.inertia), x[1]))


@compile_inline
def _arm(model, data, i):
    """Return the arm from the parent of link i to it."""
    return times(get9(data.links[model.links[i].parent].orientation), get3(data.links[i].arm))


@compile_inline
def _added(x, f, column):
    """Return a twist with f times a column's."""
    return axpy3(x[0], f, take3(column, 0)), axpy3(x[1], f, take3(column, 3))


@compile_inline
def _moved_by_parent(modes, model, pulled, i, x):
    """Return a twist of link i with that by the modes of its parent."""
    if modes is not None:
        link = model.links[i]
        if link.phi >= 0:
            p = model.links[link.parent]
            more = dots6(modes.turns.columns[link.phi], pulled.modes[0, p.slot], p.modes)
            return add3(x[0], take3(more, 0)), add3(x[1], take3(more, 3))
    return x


@compile_kernel
def _of_modes(model, work, pulled, i, w):
    """Keep w of the modes of link i; returns their momentum (6), and what the spin feels of them (3)."""
    link, first = model.links[i], work.frames[i].modes
    own, rows = pulled.modes[:, link.slot], work.rows
    for a in range(link.modes):
        own[0, a], own[1, a], own[2, a] = w[link.uq + a], 0.0, 0.0
    z = four(0.0)
    mass, spin = (z, z, z, z, z, z), (z, z, z)
    for b in range(0, link.modes, WIDTH):
        f = get_lanes(own[0], b)
        mass = axpy6(mass, f, rows6(rows, 12, first + b))
        spin = axpy3(spin, f, rows3(rows, 18, first + b))
    return (
        (
            add_lanes(mass[0]),
            add_lanes(mass[1]),
            add_lanes(mass[2]),
            add_lanes(mass[3]),
            add_lanes(mass[4]),
            add_lanes(mass[5]),
        ),
        (add_lanes(spin[0]), add_lanes(spin[1]), add_lanes(spin[2])),
    )


@compile_inline
def _own_modes(modes, model, work, pulled, i, by_x, by_u):
    """Write the products of the modes of link i."""
    if modes is not None:
        if model.links[i].slot >= 0:
            _modes(model, work, pulled, i, by_x, by_u)


@compile_kernel
def _modes(model, work, pulled, i, by_x, by_u):
    """Add what the body of link i does to the products of its modes, and write them."""
    link, first = model.links[i], work.frames[i].modes
    own, bodies, s = pulled.modes[:, link.slot], work.modes.bodies, link.slot
    twist = get6(pulled.links[i].twist)
    for b in range(0, link.modes, WIDTH):
        x = get_lanes(own[1], b) + dot6(twist, rows6(work.rows, 0, first + b))
        y = get_lanes(own[2], b) + dot6(twist, rows6(work.rows, 6, first + b))
        for a in range(link.modes):
            x = x + own[0, a] * get_lanes(bodies.by_q[s, 6 + a], b)
            y = y + own[0, a] * get_lanes(bodies.by_qd[s, 6 + a], b)
        put_lanes(own[1], b, x)
        put_lanes(own[2], b, y)
    for a in range(link.modes):
        by_x[link.uq + a], by_u[link.uq + a] = own[1, a], own[2, a]


@compile_inline
def _joint(model, work, pulled, i, by_x, by_u):
    """Write the products of the speeds of link i's joint."""
    link, frame, own = model.links[i], work.frames[i], pulled.links[i]
    momentum, spin = get6(own.momentum), get3(own.spin)
    placed, moving = get6(own.placed), get6(own.moving)
    for s in range(link.uq - link.u):
        column = work.columns[frame.first + s]
        f, t = turned_wrench(frame.wrench, take3(column, 0), take3(column, 3))
        turned = dot3(get3(own.held), f) + dot3(get_angular(own.held), t)
        acting = dot6(take6(column, 0), placed) + dot6(take6(column, 6), moving)
        by_x[link.u + s] = dot6(take6(column, 12), momentum) + dot3(take3(column, 9), spin) + turned + acting
        by_u[link.u + s] = dot6(take6(column, 18), momentum) + dot3(take3(column, 3), spin)
        by_u[link.u + s] += dot6(take6(column, 0), moving)


@compile_inline
def _to_parent(modes, model, data, work, pulled, i):
    """Bring wrench, momentum and what the spin feels of link i to its parent, and to the products of its modes."""
    link, frame, own = model.links[i], work.frames[i], pulled.links[i]
    parent, to = work.frames[link.parent], pulled.links[link.parent]
    arm = _arm(model, data, i)
    if modes is not None:
        if link.phi >= 0:
            pull_modes(model, data, work, pulled, link.parent, link.interface, link.phi, arm, frame.wrench, own)
    put3(to.spin, add3(get3(to.spin), get3(own.spin)))
    add_wrench_at(to.momentum, own.momentum, arm)
    add_wrench_at(to.placed, own.placed, arm)
    add_wrench_at(to.moving, own.moving, arm)
    add_wrench_at(parent.wrench, frame.wrench, arm)


@compile_inline
def add_wrench_at(out, wrench, arm):
    """Add a wrench at the end of an arm."""
    f, t = get3(wrench), get_angular(wrench)
    put3(out, add3(get3(out), f))
    put_angular(out, add3(get_angular(out), add3(t, cross(arm, f))))


@compile_kernel
def pull_modes(model, data, work, pulled, p, node, k, arm, wrench, own):
    """Add what acts at an interface of link p, place k of the work, to the products of the modes of its body.

    The wrench (6,), and momentum, spin and what acts there of `own`, stand at the end of an arm from link p. They turn
    with the interface but for those by motion.
    """
    s = model.links[p].slot
    bends, turns = work.modes.bends, work.modes.turns
    base = get9(data.links[p].orientation)
    to_end = times(base, add3(free_position(model, p, node), get3(bends.p[k])))
    rest = sub3(arm, to_end)
    f = get3(wrench)
    t = add3(get_angular(wrench), cross(rest, f))
    columns, out = turns.columns[k], pulled.modes[:, s]
    twist = get3(pulled.links[p].twist), get_angular(pulled.links[p].twist)
    momentum, spin = get6(own.momentum), get3(own.spin)
    placed, moving = get6(own.placed), get6(own.moving)
    for b in range(0, model.links[p].modes, WIDTH):
        turn = rows3(columns, 3, b)
        moved = sub3(rows3(columns, 0, b), cross(turn, rest))
        force = cross(turn, f)
        torque = add3(add3(cross(turn, t), cross(moved, f)), cross(to_end, force))
        J = rows6(columns, 0, b)
        x = dot6(momentum, rows6(columns, 12, b)) + dot3(spin, rows3(columns, 9, b))
        x = x + dot3(twist[0], force) + dot3(twist[1], torque)
        x = x + dot6(placed, J) + dot6(moving, rows6(columns, 6, b))
        y = dot6(momentum, rows6(columns, 18, b)) + dot3(spin, turn) + dot6(moving, J)
        put_lanes(out[1], b, get_lanes(out[1], b) + x)
        put_lanes(out[2], b, get_lanes(out[2], b) + y)
    f, t = transposed_times(base, f), transposed_times(base, t)
    add_turn_curvature(model, work.modes, p, node, k, f, t, work.modes.bodies.by_q[s, 6:])
