"""Modes in the recursions: elimination of modal coordinates (theory 5.2); `modal` as in modal_interfaces.py."""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.multibody.kernels.algebra.lanes import (
    WIDTH,
    four,
    get_lanes,
    get_lanes6,
    put_lanes,
    put_lanes6,
)
from modalprep.multibody.kernels.algebra.matrices import inertia_times, less_outer, less_product
from modalprep.multibody.kernels.algebra.rows import add8, add_heads, heads, mode6, put_rows6, rows6, sums6, sums9
from modalprep.multibody.kernels.algebra.tuples import (
    ZERO3,
    add3,
    add6,
    add9,
    axpy3,
    axpy6,
    cross,
    dot6,
    get6,
    get9,
    put6,
    put9,
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
    N, Phi, Z = modal.q.shape[1], modal.Phi[slot], modal.Z[s]
    for b in range(0, n, WIDTH):
        phi = rows6(Phi, b, N)
        c = inertia_times(M, H, J, phi)
        put_rows6(modal.phi, b, N, c)
        f = (c[0], c[1], c[2])
        t = add3((c[3], c[4], c[5]), cross(r, f))
        add_heads(Z, b, (f[0], f[1], f[2], t[0], t[1], t[2], dot6(p, phi), four(0.0)))
    for a in range(n):
        c = mode6(modal.phi, a, N)
        for b in range(a & -WIDTH, n, WIDTH):
            put_lanes(Z[a], 8 + b, get_lanes(Z[a], 8 + b) + dot6(c, rows6(Phi, b, N)))


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
    Z = modal.Z[s]
    for a in range(n):
        Z[a, 8 + a] += c1 * model.modal.diagonal[k, 1, a] + c2 * model.modal.diagonal[k, 0, a]
        Z[a, LOAD] -= modal.load[s, a]
    for a in range(n):
        row = Z[a]
        if not row[8 + a] > 0.0:
            return False
        g = 1.0 / row[8 + a]
        x, y = get_lanes(row, 0), get_lanes(row, 4)
        for b in range(a + 1, n):
            other = Z[b]
            f = -g * row[8 + b]
            add8(other, f, x, y)
            for c in range(8 + (b & -WIDTH), 8 + n, WIDTH):
                put_lanes(other, c, get_lanes(other, c) + f * get_lanes(row, c))
        row[INVERSE] = g
    _condense(own, Z, n)
    return True


@compile_inline
def _condense(own, Z, n):
    """Take ``g v v^T`` of all modes off the articulated inertia of a link, and ``g v v[LOAD]`` off its bias."""
    z = four(0.0)
    M = (z, z, z, z, z, z)
    H = (z, z, z, z, z, z, z, z, z)
    J = (z, z, z, z, z, z)
    P = (z, z, z, z, z, z)
    for b in range(0, n, WIDTH):
        v = heads(Z, b)
        f = (v[0], v[1], v[2])
        t = (v[3], v[4], v[5])
        load = v[LOAD] * v[INVERSE]
        M = less_outer(M, v[INVERSE], f)
        H = less_product(H, v[INVERSE], f, t)
        J = less_outer(J, v[INVERSE], t)
        P = axpy6(P, -1.0 * load, (v[0], v[1], v[2], v[3], v[4], v[5]))
    put6(own.M, add6(get6(own.M), sums6(M)))
    put9(own.H, add9(get9(own.H), sums9(H)))
    put6(own.J, add6(get6(own.J), sums6(J)))
    put6(own.force, add6(get6(own.force), sums6(P)))


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
        row = modal.Z[s, a]
        for b in range(a + 1, n):
            modal.Z[s, b, LOAD] -= row[8 + b] * row[INVERSE] * row[LOAD]
        _condense_bias(data.links[i], row[INVERSE], row)


@compile_inline
def modal_accelerations(modal, model, data, i, udot):
    """Solve for q'' of link i from its A: back substitution."""
    if modal is None:
        return
    if model.links[i].slot < 0:
        return
    s, n, u = model.links[i].slot, model.links[i].modes, model.links[i].uq
    A = get6(data.links[i].acceleration)
    Z = modal.Z[s]
    qdd = modal.qdd[s]
    for a in range(n):
        qdd[a] = -dot6(get6(Z[a]), A) - Z[a, LOAD]
    for a in range(n - 1, -1, -1):  # by columns: a sum over a row would wait for each number in turn
        v = qdd[a] * Z[a, INVERSE]
        qdd[a] = udot[u + a] = v
        for b in range(a):
            qdd[b] -= Z[b, 8 + a] * v


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
                modal.Z[s, a, LOAD] = -modal.load[s, a]


@compile_inline
def condense_rows(modal, model, i, begin, end, work):
    """Condense the modal forces of multipliers at link i (responses.py) with the pivots of `eliminate_modes`."""
    if modal is not None:
        if model.links[i].slot >= 0:
            _condense_rows(modal, model.links[i].slot, model.links[i].modes, begin, end, work)


@compile_kernel
def _condense_rows(modal, s, n, begin, end, work):
    for a in range(n):
        row = modal.Z[s, a]
        for p in range(begin, end):
            k = work.paths.entries[p].bundle
            forces = work.modal[p]
            own = work.entries[p]
            f = get_lanes(forces, 4 * a) * row[INVERSE]
            free = work.bundles[k].free
            for b in range(a + 1, n):
                put_lanes(forces, 4 * b, get_lanes(forces, 4 * b) - f * row[8 + b])
            put_lanes6(own.force, axpy6(get_lanes6(own.force), -1.0 * f, get6(row)))
            put_lanes(free, 0, get_lanes(free, 0) - f * row[LOAD])
            put_lanes(own.drive, 0, f)
            for q in range(begin, p + 1):
                S = work.bundles[k].S if q == p else work.between[k, work.paths.entries[q].bundle].S
                other = get_lanes(work.modal[q], 4 * a)
                for c in range(work.paths.bundles[k].count):
                    put_lanes(S, 4 * c, get_lanes(S, 4 * c) + own.drive[c] * other)


@compile_inline
def push_bias_of_modes(modal, model, i, size, forces, p, k):
    """Take eliminated modal forces, lane k of ``forces[p]``, times a size, off the bias of link i's modes."""
    if modal is not None:
        for a in range(model.links[i].modes):
            modal.Z[model.links[i].slot, a, LOAD] -= size * forces[p, 4 * a + k]


@compile_inline
def clear_bias_of_modes(modal, model):
    """Set the modal bias forces to zero."""
    if modal is not None:
        modal.Z[:, :, LOAD] = 0.0


@compile_inline
def push_modes(modal, model, force):
    """Add generalised forces ``force (nu,)`` to the modal loads."""
    if modal is not None:
        for i in range(len(model.links)):
            for a in range(model.links[i].modes):
                modal.load[model.links[i].slot, a] += force[model.links[i].uq + a]


@compile_inline
def write_accelerations(modal, model, i, udot):
    """Write q'' of link i from ``udot (nu,)``."""
    if modal is not None:
        s = model.links[i].slot
        if s >= 0:
            for a in range(model.links[i].modes):
                modal.qdd[s, a] = udot[model.links[i].uq + a]


@compile_inline
def add_bias_to_modes(modal, model, i, force, torque):
    """Add the bias force that link i hands to its parent, parent link's axes, to the parent's modal rows."""
    if modal is not None:
        slot, p = model.links[i].phi, model.links[i].parent
        if slot >= 0:
            for a in range(model.links[p].modes):
                modal.Z[model.links[p].slot, a, LOAD] += on_shape(modal, slot, a, force, torque)


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
        s = model.links[i].slot
        n = model.links[i].modes
        u = model.links[i].uq
        at = get6(data.links[i].acceleration)
        if s >= 0:
            for a in range(n):
                row = modal.Z[s, a]
                out[u + a] = dot6(get6(row), at) + row[LOAD] - modal.load[s, a]
            for a in range(n):
                row, qdd = modal.Z[s, a], modal.qdd[s, a]
                f = axpy6(f, qdd, get6(row))
                out[u + a] += row[8 + a] * qdd
                for b in range(a + 1, n):  # the upper half of M_ff
                    out[u + a] += row[8 + b] * modal.qdd[s, b]
                    out[u + b] += row[8 + b] * qdd
    return f


@compile_inline
def modal_momenta(modal, model, link):
    """Return what the modes of a link's body add to its momenta, the angular one about the link's origin."""
    linear, angular = ZERO3, ZERO3
    if modal is not None:
        s = model.links[link].slot
        if s >= 0:
            for a in range(model.links[link].modes):
                Z, qd = modal.Z[s, a], modal.qd[s, a]
                linear = axpy3(linear, qd, (Z[0], Z[1], Z[2]))
                angular = axpy3(angular, qd, (Z[3], Z[4], Z[5]))
    return linear, angular


@compile_inline
def modal_energies(modal, model, link):
    """Return twice the kinetic energy of the modes of a link's body alone, and their strain energy."""
    kinetic, strain = 0.0, 0.0
    if modal is not None:
        s = model.links[link].slot
        k = model.links[link].kind
        n = model.links[link].modes
        if s >= 0:
            for a in range(n):
                Z, q, qd = modal.Z[s, a], modal.q[s, a], modal.qd[s, a]
                own = qd * Z[8 + a]
                for b in range(a + 1, n):  # M_ff is symmetric, its upper half is there
                    own += 2.0 * modal.qd[s, b] * Z[8 + b]
                kinetic += qd * own
                strain += 0.5 * model.modal.diagonal[k, 0, a] * q * q
    return kinetic, strain
