"""Modes in the recursions: elimination of modal coordinates (theory 5.2); `modal` as in modal_interfaces.py."""

from __future__ import annotations

from modalprep.jit import compile_inline, compile_kernel
from modalprep.multibody.kernels.algebra.lanes import four, get_lanes, get_lanes6, put_lanes, put_lanes6
from modalprep.multibody.kernels.algebra.matrices import (
    inertia_times,
)
from modalprep.multibody.kernels.algebra.tuples import (
    ZERO3,
    add3,
    add8,
    axpy3,
    axpy6,
    axpy8,
    cross,
    dot3,
    dot8,
    get6,
    get8,
    put6,
    put8,
    row8,
)
from modalprep.multibody.kernels.data import INVERSE, LOAD
from modalprep.multibody.kernels.modal_interfaces import (
    on_shape,
)


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
def condense_rows(modal, model, i, begin, end, work):
    """Condense the modal forces of multipliers at link i (responses.py) with the pivots of `eliminate_modes`."""
    if modal is not None:
        if model.links[i].slot >= 0:
            _condense_rows(modal, model.links[i].slot, model.links[i].modes, begin, end, work)


@compile_kernel
def _condense_rows(modal, s, n, begin, end, work):
    for a in range(n):
        row = get8(modal.Z, s, a, 0)
        for p in range(begin, end):
            k, forces, own = work.paths.entries[p].bundle, work.modal[p], work.entries[p]
            f, free = get_lanes(forces, 4 * a) * row[INVERSE], work.bundles[k].free
            for b in range(a + 1, n):
                put_lanes(forces, 4 * b, get_lanes(forces, 4 * b) - f * modal.Z[s, a, 1 + (b >> 3), b & 7])
            put_lanes6(own.force, axpy6(get_lanes6(own.force), -1.0 * f, row))
            put_lanes(free, 0, get_lanes(free, 0) - f * row[LOAD])
            put_lanes(own.drive, 0, f)
            for q in range(begin, p + 1):
                S, other = work.between[k, work.paths.entries[q].bundle].S, get_lanes(work.modal[q], 4 * a)
                for c in range(work.paths.bundles[k].count):
                    put_lanes(S, 4 * c, get_lanes(S, 4 * c) + own.drive[c] * other)


@compile_inline
def push_bias_of_modes(modal, model, i, size, forces, p, k):
    """Take eliminated modal forces, lane k of ``forces[p]``, times a size, off the bias of link i's modes."""
    if modal is not None:
        for a in range(model.links[i].modes):
            modal.Z[model.links[i].slot, a, 0, LOAD] -= size * forces[p, 4 * a + k]


@compile_inline
def clear_bias_of_modes(modal, model):
    """Set the modal bias forces to zero."""
    if modal is not None:
        modal.Z[:, :, 0, LOAD] = 0.0


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
                modal.Z[model.links[p].slot, a, 0, LOAD] += on_shape(modal, slot, a, force, torque)


@compile_inline
def add_row_to_modes(modal, model, i, force, torque, out, entry):
    """Add the generalised forces of wrenches of link i, parent link's axes, to those of its modes in ``out``."""
    if modal is not None:
        slot = model.links[i].phi
        if slot >= 0:
            forces = out[entry.up]
            for a in range(model.links[model.links[i].parent].modes):
                before = get_lanes(forces, 4 * a) if entry.adds else four(0.0)
                put_lanes(forces, 4 * a, before + on_shape(modal, slot, a, force, torque))


@compile_inline
def hand_to_modes(modal, model, i, force, torque, out):
    """Add the generalised forces of link i's wrench, parent link's axes, to the parent's modes, ``out (nu,)``."""
    if modal is not None:
        slot, p = model.links[i].phi, model.links[i].parent
        if slot >= 0:
            for a in range(model.links[p].modes):
                out[model.links[p].uq + a] += on_shape(modal, slot, a, force, torque)


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
