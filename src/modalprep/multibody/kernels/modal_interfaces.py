"""Interfaces of flexible bodies: motion, partial velocities, loads (theory 4 and 5).

`modal` is `Data.modal`, an argument of its own: where it is None, in a system of rigid bodies, no code of modes is
compiled.
"""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.compiler.lanes import WIDTH
from modalprep.multibody.kernels.algebra.matrices import (
    UNIT9,
    product,
)
from modalprep.multibody.kernels.algebra.rotations import (
    cayley,
    cayley_rate,
    half_tangent,
    half_tangent_rate,
)
from modalprep.multibody.kernels.algebra.rows import (
    dots6,
    mode6,
    put_rows3,
    put_rows6,
    rows3,
    rows6,
    twice_combined6,
)
from modalprep.multibody.kernels.algebra.tuples import (
    ZERO3,
    ZERO6,
    add3,
    add6,
    axpy3,
    axpy6,
    combined,
    cross,
    dot3,
    get3,
    get6,
    get9,
    get_angular,
    put6,
    sub3,
    sub6,
    take3,
)
from modalprep.multibody.kernels.data import UNIT
from modalprep.multibody.kernels.modal_inertia import shortening, swing
from modalprep.multibody.kernels.stations.interfaces import station_node


@compile_inline
def node_shape(modal, model, p, node, slot):
    """Write the partial velocities of an interface of link p's body to row `slot` of Phi, rotations as ``psi(q)``.

    Returns the displacement and ``psi q`` (8), their rates, and ``-q' Kg q'``: 3 + 3 numbers each.
    """
    s = model.links[p].slot
    n = model.links[p].modes
    row = model.links[p].first_interface + node
    phi = model.modal.Phi[row]
    Phi = modal.Phi[slot]
    q = modal.q[s]
    qd = modal.qd[s]
    if model.links[p].modal_mass == UNIT:
        for b in range(0, n, WIDTH):
            put_rows6(Phi, 0, b, rows6(phi, 0, b))
        return dots6(phi, q, n), dots6(phi, qd, n), ZERO6
    for b in range(0, n, WIDTH):
        Kg_q, Kg_qd = twice_combined6(model.modal.Kg_FT[row], 0, b, q, qd, n)
        put_rows6(Phi, 0, b, axpy6(rows6(phi, 0, b), -1.0, Kg_q))
        put_rows6(modal.Kg_FT_qd, 0, b, Kg_qd)
    moved = add6(dots6(phi, q, n), dots6(Phi, q, n))
    moved = (0.5 * moved[0], 0.5 * moved[1], 0.5 * moved[2], 0.5 * moved[3], 0.5 * moved[4], 0.5 * moved[5])
    second = sub6(ZERO6, dots6(modal.Kg_FT_qd, qd, n))
    return _as_a_line(modal, phi, get3(model.modal.arm[row]), s, n, slot, moved, dots6(Phi, qd, n), second)


@compile_inline
def _as_a_line(modal, phi, arm, s, n, slot, moved, rates, second):
    """Give the translations of `node_shape` their third and fourth order, by the strain of the arm (body/line.py)."""
    Phi = modal.Phi[slot]
    linear = take3(dots6(phi, modal.q[s], n), 0)
    speed = take3(dots6(phi, modal.qd[s], n), 0)
    bent = axpy3(take3(moved, 0), -1.0, linear)
    bending = axpy3(take3(rates, 0), -1.0, speed)
    tau = dot3(arm, bent)
    rate = dot3(arm, bending)
    change = dot3(arm, take3(second, 0))
    g, g_slope, g_curve = shortening(tau)
    h, h_slope, h_curve = swing(tau)
    along = combined(h_slope, linear, g_slope, bent)
    for b in range(0, n, WIDTH):
        first = rows3(phi, 0, b)
        across = axpy3(rows3(Phi, 0, b), -1.0, first)
        put_rows3(Phi, 0, b, axpy3(combined(h, first, g, across), dot3(arm, across), along))
    u = combined(h, linear, g, bent)
    v = axpy3(combined(h, speed, g, bending), rate, along)
    turning = combined(2.0 * rate * h_slope, speed, 2.0 * rate * g_slope, bending)
    bulging = combined(rate * rate * h_curve, linear, rate * rate * g_curve, bent)
    b = add3(add3(combined(g, take3(second, 0), change, along), turning), bulging)
    return (
        (u[0], u[1], u[2], moved[3], moved[4], moved[5]),
        (v[0], v[1], v[2], rates[3], rates[4], rates[5]),
        (b[0], b[1], b[2], second[3], second[4], second[5]),
    )


@compile_inline
def turn_shape(modal, slot, n, x, s, offset):
    """Make the rows ``psi(q)`` of modal.Phi partial angular velocities, and move the point by `offset`."""
    argument = half_tangent(x)
    Phi = modal.Phi[slot]
    for b in range(0, n, WIDTH):
        phi = rows6(Phi, 0, b)
        t = cayley_rate(argument, s, half_tangent_rate(x, phi[3:]))
        v = add3(phi[:3], cross(t, offset))
        put_rows6(Phi, 0, b, (v[0], v[1], v[2], t[0], t[1], t[2]))


@compile_inline
def node_motion(modal, model, data, p, node, slot, arm):
    """Motion of an interface of a flexible body in its link's axes, modal.Phi before `turn_shape`.

    Returns the position, the rotation of the node, its rotation vector ``psi q`` and the s of its Cayley map, the
    elastic velocity and spin, and the acceleration (linear, angular) where A and q'' are zero.
    """
    w = get3(data.links[p].omega)
    if model.links[p].stations >= 0:
        r, R, v, t, linear, angular = station_node(modal, model, p, node, slot, w)
        return r, R, ZERO3, 1.0, v, t, linear, angular  # Phi is turned already: `turn_shape` of no turn changes nothing
    moved, rates, second = node_shape(modal, model, p, node, slot)
    turn, turning = (moved[3], moved[4], moved[5]), (rates[3], rates[4], rates[5])
    x = half_tangent(turn)
    xd = half_tangent_rate(turn, turning)
    xdd = half_tangent_rate(turn, (second[3], second[4], second[5]))
    xdd = axpy3(axpy3(xdd, dot3(turn, turning) / 3.0, turning), dot3(turning, turning) / 6.0, turn)
    R, s = cayley(x)
    r = add3(arm, (moved[0], moved[1], moved[2]))
    v = (rates[0], rates[1], rates[2])
    t = cayley_rate(x, s, xd)
    linear = add3(cross(w, axpy3(cross(w, r), 2.0, v)), (second[0], second[1], second[2]))
    angular = add3(cayley_rate(x, s, xdd), cross(w, t))
    return r, R, turn, s, v, t, linear, axpy3(angular, -0.5 * s * dot3(x, xd), t)


@compile_inline
def elastic_acceleration(modal, slot, n, s):
    """Return the sum of modal.Phi[slot] times q'' (linear, angular)."""
    v = dots6(modal.Phi[slot], modal.qdd[s], n)
    return (v[0], v[1], v[2]), (v[3], v[4], v[5])


@compile_inline
def parent_frame(modal, model, data, i):
    """Frame on the parent at the joint of link i, parent link's axes; `modal` None: rigid bodies.

    Returns
    -------
    rotation of the frame, its position, velocity and spin of a flexible parent's node
    linear, angular : acceleration of the frame where A and q'' of the parent are zero
    x, s : rotation vector of the node and the s of its Cayley map, for `turn_parent_shape`
    """
    link = model.links[i]
    turn = get9(link.rotation)
    arm = get3(link.arm)
    w = get3(data.links[link.parent].omega)
    if modal is not None:
        if link.phi >= 0:
            arm, node, x, s, v, t, linear, angular = node_motion(
                modal, model, data, link.parent, link.interface, link.phi, arm
            )
            return product(node, turn), arm, v, t, linear, angular, x, s
    return turn, arm, ZERO3, ZERO3, cross(w, cross(w, arm)), ZERO3, ZERO3, 1.0


@compile_inline
def turn_parent_shape(modal, model, i, x, s, offset):
    """Make modal.Phi the partial velocities of link i's joint on a flexible parent, moved by `offset`."""
    if modal is not None:
        slot = model.links[i].phi
        if slot >= 0:
            turn_shape(modal, slot, model.links[model.links[i].parent].modes, x, s, offset)


@compile_inline
def parent_acceleration(modal, model, data, i, biases):
    """Acceleration (linear, angular) of the frame on the parent at link i's joint, parent link's axes.

    `biases` = 1, or 0 without the acceleration of the ground.
    """
    link = model.links[i]
    A = data.links[link.parent].acceleration
    linear = get3(A)
    angular = get_angular(A)
    if link.parent == len(model.links):
        linear = (biases * linear[0], biases * linear[1], biases * linear[2])
    linear = add3(linear, cross(angular, get3(data.links[i].arm)))
    if modal is not None:
        if link.phi >= 0:
            p = link.parent
            v, t = elastic_acceleration(modal, link.phi, model.links[p].modes, model.links[p].slot)
            linear, angular = add3(linear, v), add3(angular, t)
    return linear, angular


@compile_inline
def deflected_node(modal, model, data, link, node, r):
    """Position, rotation, velocity and spin of an interface in its link's axes; r is its undeformed position."""
    if modal is not None:
        if model.links[link].slot >= 0:
            return _deflected_node(model, data, link, node, r)
    return r, UNIT9, ZERO3, ZERO3


@compile_kernel
def _deflected_node(model, data, link, node, r):
    r, turn, _, _, v, w, _, _ = node_motion(data.modal, model, data, link, node, len(data.modal.Phi) - 1, r)
    return r, turn, v, w


@compile_inline
def deflection(modal, model, link, node):
    """Displacement of an interface of a link's body by its modes, link's axes."""
    if modal is not None:
        if model.links[link].stations >= 0:
            r, _, _, _, _, _ = station_node(modal, model, link, node, len(modal.Phi) - 1, ZERO3)
            return sub3(r, get3(model.interfaces[model.links[link].first_interface + node]))
        if model.links[link].slot >= 0:
            u, _, _ = node_shape(modal, model, link, node, len(modal.Phi) - 1)
            return u[0], u[1], u[2]
    return ZERO3


@compile_inline
def deflected_acceleration(modal, model, data, link, node, r):
    """Position of an interface, its elastic acceleration, and that without A and q'', both linear and angular."""
    w = get3(data.links[link].omega)
    if modal is not None:
        if model.links[link].slot >= 0:
            return _deflected_acceleration(model, data, link, node, r)
    return r, ZERO3, ZERO3, cross(w, cross(w, r)), ZERO3


@compile_kernel
def _deflected_acceleration(model, data, link, node, r):
    modal = data.modal
    n = model.links[link].modes
    slot = len(modal.Phi) - 1
    r, _, x, scale, _, _, linear, angular = node_motion(modal, model, data, link, node, slot, r)
    turn_shape(modal, slot, n, x, scale, ZERO3)
    v, t = elastic_acceleration(modal, slot, n, model.links[link].slot)
    return r, v, t, linear, angular


@compile_inline
def interface_motion(modal, model, data, link, node, r, shape):
    """Motion of an interface in its link's axes, and its partial velocities ``shape (N, 6)``; r as in `deflected_node`.

    Returns its position, rotation, elastic velocity and spin, and its acceleration without A and q'' (linear, angular).
    """
    w = get3(data.links[link].omega)
    if modal is not None:
        if model.links[link].slot >= 0:
            return _interface_motion(model, data, link, node, r, shape)
    return r, UNIT9, ZERO3, ZERO3, cross(w, cross(w, r)), ZERO3


@compile_kernel
def _interface_motion(model, data, link, node, r, shape):
    modal = data.modal
    n = model.links[link].modes
    slot = len(modal.Phi) - 1
    r, turn, x, scale, v, w, linear, angular = node_motion(modal, model, data, link, node, slot, r)
    turn_shape(modal, slot, n, x, scale, ZERO3)
    for a in range(n):
        put6(shape[a], mode6(modal.Phi[slot], a))
    return r, turn, v, w, linear, angular


@compile_inline
def shape_acceleration(modal, model, link, shape):
    """Acceleration (linear, angular) of partial velocities ``shape (N, 6)`` by q'' of a link's body."""
    v = ZERO6
    if modal is not None:
        s = model.links[link].slot
        if s >= 0:
            for a in range(model.links[link].modes):
                v = axpy6(v, modal.qdd[s, a], get6(shape[a]))
    return (v[0], v[1], v[2]), (v[3], v[4], v[5])


@compile_inline
def load_modes(modal, model, data, link, node, r, force, torque):
    """Add a force and a torque at an interface, link's axes, to the modal loads; returns the interface's position."""
    if modal is not None:
        if model.links[link].slot >= 0:
            return _load_modes(model, data, link, node, r, force, torque)
    return r


@compile_kernel
def _load_modes(model, data, link, node, r, force, torque):
    modal = data.modal
    s = model.links[link].slot
    n = model.links[link].modes
    slot = len(modal.Phi) - 1
    r, _, x, scale, _, _, _, _ = node_motion(modal, model, data, link, node, slot, r)
    turn_shape(modal, slot, n, x, scale, ZERO3)
    for a in range(n):
        modal.load[s, a] += on_shape(modal, slot, a, force, torque)
    return r


@compile_inline
def on_shape(modal, slot, a, force, torque):
    """Generalised force of a force and a torque on mode a."""
    phi = mode6(modal.Phi[slot], a)
    return dot3(force, phi[:3]) + dot3(torque, phi[3:])
