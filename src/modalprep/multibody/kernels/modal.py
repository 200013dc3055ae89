"""Modes in the recursions: interfaces of flexible bodies, elimination of modal coordinates (theory 4 and 5).

`modal` is `Data.modal`, an argument of its own: where it is None, in a system of rigid bodies, nothing of the modes is
compiled.
"""

from __future__ import annotations

from modalprep.jit import compile_inline
from modalprep.multibody.kernels.data import INVERSE, LOAD, UNIT
from modalprep.multibody.kernels.modal_inertia import shortening, swing
from modalprep.multibody.kernels.spatial import (
    UNIT9,
    ZERO3,
    ZERO6,
    ZERO8,
    add3,
    add6,
    add8,
    axpy3,
    axpy6,
    axpy8,
    cayley,
    cayley_rate,
    combined,
    cross,
    dot3,
    dot8,
    get3,
    get6,
    get8,
    get9,
    get_angular,
    half_tangent,
    half_tangent_rate,
    inertia_times,
    product,
    put6,
    put8,
    row8,
    take3,
    take6,
)


@compile_inline
def node_shape(modal, model, p, node, slot):
    """Write the partial velocities of an interface of link p's body to row `slot` of Phi, rotations as ``psi(q)``.

    Returns the displacement and ``psi q`` (8), their rates, and ``-q' Kg q'``: 3 + 3 numbers each.
    """
    s, n, row = model.links[p].slot, model.links[p].modes, model.links[p].first_interface + node
    for r in range(6 * n):
        modal.phi[r], modal.turn[r] = model.modal.shape[row, r], 0.0
    if model.links[p].modal_mass != UNIT:
        for b in range(n):
            f, g = modal.q[s, b], modal.qd[s, b]
            for r in range(6 * n):
                modal.phi[r] -= f * model.modal.Kg_node[row, b, r]
                modal.turn[r] -= g * model.modal.Kg_node[row, b, r]
    moved, rates, second = ZERO6, ZERO6, ZERO6
    for a in range(n):
        phi = take6(modal.phi, 6 * a)
        moved = axpy6(moved, 0.5 * modal.q[s, a], add6(take6(model.modal.shape[row], 6 * a), phi))
        rates = axpy6(rates, modal.qd[s, a], phi)
        second = axpy6(second, modal.qd[s, a], take6(modal.turn, 6 * a))
        for c in range(6):
            modal.Phi[slot, a, c] = phi[c]
    if model.links[p].modal_mass == UNIT:
        return moved, rates, second
    return _as_a_line(modal, model.modal.shape[row], get3(model.modal.arm[row]), s, n, slot, moved, rates, second)


@compile_inline
def _as_a_line(modal, shape, arm, s, n, slot, moved, rates, second):
    """Give the translations of `node_shape` their third and fourth order, by the strain of the arm (body/line.py)."""
    linear, speed = ZERO3, ZERO3
    for a in range(n):
        first = take3(shape, 6 * a)
        linear, speed = axpy3(linear, modal.q[s, a], first), axpy3(speed, modal.qd[s, a], first)
    bent, bending = axpy3(take3(moved, 0), -1.0, linear), axpy3(take3(rates, 0), -1.0, speed)
    tau, rate, change = dot3(arm, bent), dot3(arm, bending), dot3(arm, take3(second, 0))
    g, g_slope, g_curve = shortening(tau)
    h, h_slope, h_curve = swing(tau)
    along = combined(h_slope, linear, g_slope, bent)
    for a in range(n):
        first = take3(shape, 6 * a)
        across = axpy3(take3(modal.Phi[slot, a], 0), -1.0, first)
        v = axpy3(combined(h, first, g, across), dot3(arm, across), along)
        for c in range(3):
            modal.Phi[slot, a, c] = v[c]
    u, v = combined(h, linear, g, bent), axpy3(combined(h, speed, g, bending), rate, along)
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
    """Turn the rows ``psi(q)`` of modal.Phi to angular velocities and move the point by `offset`; fill modal.PhiT."""
    argument = half_tangent(x)
    for a in range(n):
        phi = row8(modal.Phi, slot, a)
        t = cayley_rate(argument, s, half_tangent_rate(x, (phi[3], phi[4], phi[5])))
        v = add3((phi[0], phi[1], phi[2]), cross(t, offset))
        for c in range(3):
            modal.Phi[slot, a, c], modal.Phi[slot, a, 3 + c] = v[c], t[c]
            modal.PhiT[slot, c, a >> 3, a & 7], modal.PhiT[slot, 3 + c, a >> 3, a & 7] = v[c], t[c]


@compile_inline
def node_motion(modal, model, data, p, node, slot, arm):
    """Motion of an interface of a flexible body in its link's axes, modal.Phi before `turn_shape`.

    Returns the position, the rotation of the node, its rotation vector ``psi q`` and the s of its Cayley map, the
    elastic velocity and spin, and the acceleration (linear, angular) that remains when A and q'' are zero.
    """
    moved, rates, second = node_shape(modal, model, p, node, slot)
    w = get3(data.links[p].omega)
    turn, turning = (moved[3], moved[4], moved[5]), (rates[3], rates[4], rates[5])
    x, xd = half_tangent(turn), half_tangent_rate(turn, turning)
    xdd = half_tangent_rate(turn, (second[3], second[4], second[5]))
    xdd = axpy3(axpy3(xdd, dot3(turn, turning) / 3.0, turning), dot3(turning, turning) / 6.0, turn)
    R, s = cayley(x)
    r, v, t = add3(arm, (moved[0], moved[1], moved[2])), (rates[0], rates[1], rates[2]), cayley_rate(x, s, xd)
    linear = add3(cross(w, axpy3(cross(w, r), 2.0, v)), (second[0], second[1], second[2]))
    angular = add3(cayley_rate(x, s, xdd), cross(w, t))
    return r, R, turn, s, v, t, linear, axpy3(angular, -0.5 * s * dot3(x, xd), t)


@compile_inline
def elastic_acceleration(modal, slot, n, s):
    """Return the sum of modal.Phi[slot] times q'' (linear, angular)."""
    v = ZERO8
    for a in range(n):
        v = axpy8(v, modal.qdd[s, a >> 3, a & 7], row8(modal.Phi, slot, a))
    return (v[0], v[1], v[2]), (v[3], v[4], v[5])


@compile_inline
def add_to_modes(modal, model, i, M, H, J, p, r):
    """Add ``[T Phi]^T I [T Phi]`` and ``[T Phi]^T p`` of link i to its parent's modal rows; r is its arm."""
    if modal is not None:
        if model.links[i].phi >= 0:
            parent = model.links[model.links[i].parent]
            _add_to_modes(modal, model.links[i].phi, parent.slot, parent.modes, M, H, J, p, r)


@compile_inline
def _add_to_modes(modal, slot, s, n, M, H, J, p, r):
    blocks = n + 7 >> 3
    for a in range(n):
        phi = row8(modal.Phi, slot, a)
        c = inertia_times(M, H, J, (phi[0], phi[1], phi[2], phi[3], phi[4], phi[5]))
        f, t = (c[0], c[1], c[2]), (c[3], c[4], c[5])
        t = add3(t, cross(r, f))
        b = dot8(phi, (p[0], p[1], p[2], p[3], p[4], p[5], 0.0, 0.0))
        put8(modal.Z, s, a, 0, add8(get8(modal.Z, s, a, 0), (f[0], f[1], f[2], t[0], t[1], t[2], b, 0.0)))
        for k in range(a >> 3, blocks):
            row = get8(modal.Z, s, a, 1 + k)
            row = axpy8(axpy8(row, c[0], get8(modal.PhiT, slot, 0, k)), c[1], get8(modal.PhiT, slot, 1, k))
            row = axpy8(axpy8(row, c[2], get8(modal.PhiT, slot, 2, k)), c[3], get8(modal.PhiT, slot, 3, k))
            row = axpy8(axpy8(row, c[4], get8(modal.PhiT, slot, 4, k)), c[5], get8(modal.PhiT, slot, 5, k))
            put8(modal.Z, s, a, 1 + k, row)


@compile_inline
def eliminate_modes(modal, model, data, i, c1, c2):
    """Condense link i's modes: ``I_A = M_rr - M_rf M_ff^-1 M_fr``; False when a pivot is not positive."""
    if modal is None:
        return True
    if model.links[i].slot < 0:
        return True
    return _eliminate(modal, model, data.links[i], i, c1, c2)


@compile_inline
def _eliminate(modal, model, own, i, c1, c2):
    k, s, n = model.links[i].kind, model.links[i].slot, model.links[i].modes
    for a in range(n):
        modal.Z[s, a, 1 + (a >> 3), a & 7] += c1 * model.modal.diagonal[k, a, 1] + c2 * model.modal.diagonal[k, a, 0]
        modal.Z[s, a, 0, LOAD] -= modal.load[s, a]
    for a in range(n):
        d = modal.Z[s, a, 1 + (a >> 3), a & 7]
        if not d > 0.0:
            return False
        g = 1.0 / d
        row = get8(modal.Z, s, a, 0)
        for b in range(a + 1, n):
            f = modal.Z[s, a, 1 + (b >> 3), b & 7] * g
            put8(modal.Z, s, b, 0, axpy8(get8(modal.Z, s, b, 0), -f, row))
        for k in range(1 + (a >> 3), 1 + (n + 7 >> 3)):
            right = get8(modal.Z, s, a, k)
            for b in range(a + 1, min(n, 8 * k)):
                f = modal.Z[s, a, 1 + (b >> 3), b & 7] * g
                put8(modal.Z, s, b, k, axpy8(get8(modal.Z, s, b, k), -f, right))
        _condense(own, g, row)
        modal.Z[s, a, 0, INVERSE] = g
    return True


@compile_inline
def _condense(own, g, v):
    """Take ``g v v^T`` off the articulated inertia of link i, and ``g v v[LOAD]`` off its bias."""
    x, y, z = g * v[0], g * v[1], g * v[2]
    M, J = get6(own.M), get6(own.J)
    put6(own.M, (M[0] - x * v[0], M[1] - x * v[1], M[2] - x * v[2], M[3] - y * v[1], M[4] - y * v[2], M[5] - z * v[2]))
    for c in range(3):
        own.H[c] -= x * v[3 + c]
        own.H[3 + c] -= y * v[3 + c]
        own.H[6 + c] -= z * v[3 + c]
    x, y, z = g * v[3], g * v[4], g * v[5]
    put6(own.J, (J[0] - x * v[3], J[1] - x * v[4], J[2] - x * v[5], J[3] - y * v[4], J[4] - y * v[5], J[5] - z * v[5]))
    _condense_bias(own, g, v)


@compile_inline
def _condense_bias(own, g, v):
    """Take ``g v v[LOAD]`` off the bias of link i."""
    f = g * v[LOAD]
    for c in range(6):
        own.force[c] -= f * v[c]


@compile_inline
def eliminate_load(modal, model, data, i):
    """Condense a new modal bias force (column b_f of Z) of link i with the pivots of `eliminate_modes`."""
    if modal is None:
        return
    if model.links[i].slot < 0:
        return
    s, n = model.links[i].slot, model.links[i].modes
    for a in range(n):
        row = get8(modal.Z, s, a, 0)
        for b in range(a + 1, n):
            modal.Z[s, b, 0, LOAD] -= modal.Z[s, a, 1 + (b >> 3), b & 7] * row[INVERSE] * row[LOAD]
        _condense_bias(data.links[i], row[INVERSE], row)


@compile_inline
def modal_accelerations(modal, model, data, i, udot):
    """Solve for q'' of link i from its A: back substitution."""
    if modal is None:
        return
    if model.links[i].slot < 0:
        return
    s, n, u = model.links[i].slot, model.links[i].modes, model.links[i].uq
    at = get6(data.links[i].acceleration)
    blocks = n + 7 >> 3
    for k in range(blocks):
        for c in range(8):
            modal.qdd[s, k, c] = 0.0
    for a in range(n - 1, -1, -1):
        row = get8(modal.Z, s, a, 0)
        v = dot8(row, (at[0], at[1], at[2], at[3], at[4], at[5], 1.0, 0.0))
        for k in range(a >> 3, blocks):
            v += dot8(get8(modal.Z, s, a, 1 + k), row8(modal.qdd, s, k))
        v = -v * row[INVERSE]
        modal.qdd[s, a >> 3, a & 7] = v
        udot[u + a] = v


@compile_inline
def parent_frame(modal, model, data, i):
    """Frame on the parent in which the joint of link i stands, parent link's axes; `modal` None: rigid bodies.

    Returns
    -------
    rotation of the frame, its position, velocity and spin of a flexible parent's node
    linear, angular : acceleration of the frame that is left when A and q'' of the parent are zero
    x, s : rotation vector of the node and the s of its Cayley map, for `turn_parent_shape`
    """
    link = model.links[i]
    turn, arm, w = get9(link.rotation), get3(link.arm), get3(data.links[link.parent].omega)
    if modal is not None:
        if link.phi >= 0:
            arm, node, x, s, v, t, linear, angular = node_motion(
                modal, model, data, link.parent, link.interface, link.phi, arm
            )
            return product(node, turn), arm, v, t, linear, angular, x, s
    return turn, arm, ZERO3, ZERO3, cross(w, cross(w, arm)), ZERO3, ZERO3, 1.0


@compile_inline
def turn_parent_shape(modal, model, i, x, s, offset):
    """Finish the partial velocities of link i's joint on a flexible parent, moved by `offset`."""
    if modal is not None:
        slot = model.links[i].phi
        if slot >= 0:
            turn_shape(modal, slot, model.links[model.links[i].parent].modes, x, s, offset)


@compile_inline
def parent_acceleration(modal, model, data, i, whole):
    """Acceleration (linear, angular) of the frame on the parent where link i's joint is, parent link's axes.

    `whole` = 1 after `outward`'s biases; 0: that of the ground does not count.
    """
    link = model.links[i]
    A = data.links[link.parent].acceleration
    linear, angular = get3(A), get_angular(A)
    if link.parent == len(model.links):
        linear = (whole * linear[0], whole * linear[1], whole * linear[2])
    linear = add3(linear, cross(angular, get3(data.links[i].arm)))
    if modal is not None:
        if link.phi >= 0:
            p = link.parent
            v, t = elastic_acceleration(modal, link.phi, model.links[p].modes, model.links[p].slot)
            linear, angular = add3(linear, v), add3(angular, t)
    return linear, angular


@compile_inline
def deflected_node(modal, model, data, link, node, r):
    """Position, rotation, velocity and spin of an interface in its link's axes, from its place r when undeformed."""
    if modal is not None:
        if model.links[link].slot >= 0:
            r, turn, _, _, v, w, _, _ = node_motion(modal, model, data, link, node, len(modal.Phi) - 1, r)
            return r, turn, v, w
    return r, UNIT9, ZERO3, ZERO3


@compile_inline
def deflection(modal, model, link, node):
    """Displacement of an interface of a link's body by its modes, link's axes."""
    if modal is not None:
        if model.links[link].slot >= 0:
            u, _, _ = node_shape(modal, model, link, node, len(modal.Phi) - 1)
            return u[0], u[1], u[2]
    return ZERO3


@compile_inline
def deflected_acceleration(modal, model, data, link, node, r):
    """Place of an interface, its elastic acceleration, and that without A and q'', both linear and angular."""
    w = get3(data.links[link].omega)
    if modal is not None:
        s = model.links[link].slot
        if s >= 0:
            slot, n = len(modal.Phi) - 1, model.links[link].modes
            r, _, x, scale, _, _, linear, angular = node_motion(modal, model, data, link, node, slot, r)
            turn_shape(modal, slot, n, x, scale, ZERO3)
            v, t = elastic_acceleration(modal, slot, n, s)
            return r, v, t, linear, angular
    return r, ZERO3, ZERO3, cross(w, cross(w, r)), ZERO3


@compile_inline
def load_modes(modal, model, data, link, node, r, force, torque):
    """Add a force and a torque at an interface, link's axes, to the modal loads; returns the interface's place."""
    if modal is not None:
        s = model.links[link].slot
        if s >= 0:
            slot, n = len(modal.Phi) - 1, model.links[link].modes
            r, _, x, scale, _, _, _, _ = node_motion(modal, model, data, link, node, slot, r)
            turn_shape(modal, slot, n, x, scale, ZERO3)
            for a in range(n):
                modal.load[s, a] += _on_shape(modal, slot, a, force, torque)
    return r


@compile_inline
def _on_shape(modal, slot, a, force, torque):
    """Generalised force of a force and a torque on mode a."""
    phi = row8(modal.Phi, slot, a)
    return dot3(force, (phi[0], phi[1], phi[2])) + dot3(torque, (phi[3], phi[4], phi[5]))


@compile_inline
def clear_modal_loads(modal):
    """Set all modal loads to zero."""
    if modal is not None:
        modal.load[:] = 0.0


@compile_inline
def take_loads(modal, model, i):
    """Make the modal loads of link i the whole modal bias force."""
    if modal is not None:
        s = model.links[i].slot
        if s >= 0:
            for a in range(model.links[i].modes):
                modal.Z[s, a, 0, LOAD] = -modal.load[s, a]


@compile_inline
def push_modes(modal, model, force):
    """Add generalised forces ``force (nu,)`` to the modal loads."""
    if modal is not None:
        for i in range(len(model.links)):
            for a in range(model.links[i].modes):
                modal.load[model.links[i].slot, a] += force[model.links[i].uq + a]


@compile_inline
def write_accelerations(modal, model, i, udot):
    """Write q'' of link i from ``udot (nu,)``; the rest of its blocks of eight stays zero."""
    if modal is not None:
        s = model.links[i].slot
        if s >= 0:
            for a in range(model.links[i].modes):
                modal.qdd[s, a >> 3, a & 7] = udot[model.links[i].uq + a]


@compile_inline
def add_bias_to_modes(modal, model, i, force, torque):
    """Add the bias force that link i hands to its parent, parent link's axes, to the parent's modal rows."""
    if modal is not None:
        slot, p = model.links[i].phi, model.links[i].parent
        if slot >= 0:
            for a in range(model.links[p].modes):
                modal.Z[model.links[p].slot, a, 0, LOAD] += _on_shape(modal, slot, a, force, torque)


@compile_inline
def hand_to_modes(modal, model, i, force, torque, out):
    """Add the generalised forces of link i's wrench, parent link's axes, to the parent's modes, ``out (nu,)``."""
    if modal is not None:
        slot, p = model.links[i].phi, model.links[i].parent
        if slot >= 0:
            for a in range(model.links[p].modes):
                out[model.links[p].uq + a] += _on_shape(modal, slot, a, force, torque)


@compile_inline
def modal_forces(modal, model, data, i, f, out):
    """Write the modal rows of link i's required forces to ``out (nu,)``; returns f with the inertia force of q''."""
    if modal is not None:
        s, n, u, at = model.links[i].slot, model.links[i].modes, model.links[i].uq, get6(data.links[i].acceleration)
        if s >= 0:
            for a in range(n):
                row = get8(modal.Z, s, a, 0)
                out[u + a] = dot8(row, (at[0], at[1], at[2], at[3], at[4], at[5], 1.0, 0.0)) - modal.load[s, a]
            for a in range(n):
                row, qdd = get8(modal.Z, s, a, 0), modal.qdd[s, a >> 3, a & 7]
                f = axpy6(f, qdd, (row[0], row[1], row[2], row[3], row[4], row[5]))
                out[u + a] += modal.Z[s, a, 1 + (a >> 3), a & 7] * qdd
                for b in range(a + 1, n):  # the upper half of M_ff
                    out[u + a] += modal.Z[s, a, 1 + (b >> 3), b & 7] * modal.qdd[s, b >> 3, b & 7]
                    out[u + b] += modal.Z[s, a, 1 + (b >> 3), b & 7] * qdd
    return f


@compile_inline
def modal_sums(modal, model, link, v, w):
    """Return what the modes of a link's body add to its momenta, and twice their kinetic and their strain energy.

    v, w : velocity and angular velocity of the link, in its axes
    """
    linear, angular, kinetic, strain = ZERO3, ZERO3, 0.0, 0.0
    if modal is not None:
        s, k, n = model.links[link].slot, model.links[link].kind, model.links[link].modes
        if s >= 0:
            for a in range(n):
                Z, q, qd = get8(modal.Z, s, a, 0), modal.q[s, a], modal.qd[s, a]
                S, C = (Z[0], Z[1], Z[2]), (Z[3], Z[4], Z[5])
                linear, angular = axpy3(linear, qd, S), axpy3(angular, qd, C)
                own = qd * modal.Z[s, a, 1 + (a >> 3), a & 7]
                for b in range(a + 1, n):  # M_ff is symmetric, its upper half is there
                    own += 2.0 * modal.qd[s, b] * modal.Z[s, a, 1 + (b >> 3), b & 7]
                kinetic += qd * (dot3(S, v) + dot3(C, w) + own)
                strain += 0.5 * model.modal.diagonal[k, a, 0] * q * q
    return linear, angular, kinetic, strain
