"""Modes in the recursions: elimination of modal coordinates (theory 5.2); `modal` as in modal_interfaces.py."""

from __future__ import annotations

import numpy as np

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.compiler.lanes import (
    WIDTH,
    four,
    get_lanes,
    get_lanes6,
    put_lanes,
    put_lanes6,
)
from modalprep.multibody.kernels.algebra.matrices import inertia_times, less_outer, less_product
from modalprep.multibody.kernels.algebra.rows import mode6, put_rows6, rows6, sums6, sums9, zero6, zero9
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
from modalprep.multibody.kernels.modal_dampers import add_dampers_to_mass
from modalprep.multibody.kernels.modal_interfaces import (
    on_shape,
)

AFTER = np.triu(np.ones((WIDTH, WIDTH)), 1)  # of four modes: row k is 1 for those after mode k


@compile_inline
def add_to_modes(modal, model, i, M, H, J, p, r):
    """Add ``[T Phi]^T I [T Phi]`` and ``[T Phi]^T p`` of link i to its parent's modal rows; r is its arm."""
    if modal is not None:
        if model.links[i].phi >= 0:
            parent = model.links[model.links[i].parent]
            _add_to_modes(modal, model.links[i].phi, parent.slot, parent.modes, M, H, J, p, r)


@compile_inline
def _add_to_modes(modal, slot, s, n, M, H, J, p, r):
    Phi = modal.Phi[slot]
    M_rf = modal.M_rf[s]
    M_ff = modal.M_ff[s]
    for b in range(0, n, WIDTH):
        phi = rows6(Phi, 0, b)
        force = inertia_times(M, H, J, phi)
        put_rows6(modal.I_Phi, 0, b, force)
        f = force[:3]
        t = add3(force[3:], cross(r, f))
        put_rows6(M_rf, 0, b, add6(rows6(M_rf, 0, b), (f[0], f[1], f[2], t[0], t[1], t[2])))
        put_lanes(modal.b_f[s], b, get_lanes(modal.b_f[s], b) + dot6(p, phi))
    for a in range(n):
        force = mode6(modal.I_Phi, a)
        for b in range(a & -WIDTH, n, WIDTH):
            put_lanes(M_ff[a], b, get_lanes(M_ff[a], b) + dot6(force, rows6(Phi, 0, b)))


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
    k = model.links[i].kind
    s = model.links[i].slot
    n = model.links[i].modes
    for a in range(n):
        modal.M_ff[s, a, a] += c1 * model.modal.D[k, a] + c2 * model.modal.K[k, a]
        modal.b_f[s, a] -= modal.load[s, a]
    add_dampers_to_mass(modal, model, i, c1)
    if not _factorise(modal.M_ff[s], modal.inverse[s], n):
        return False
    _reduce(modal, s, n)
    _condense(own, modal, s, n)
    return True


@compile_inline
def _factorise(M_ff, inverse, n):
    """Eliminate ``M_ff = L diag(pivot) L^T`` by rows; False when a pivot is not positive."""
    for a in range(n):
        row = M_ff[a]
        if not row[a] > 0.0:
            return False
        g = 1.0 / row[a]
        for b in range(a + 1, n):
            f = -g * row[b]
            other = M_ff[b]
            for c in range(b & -WIDTH, n, WIDTH):
                put_lanes(other, c, get_lanes(other, c) + f * get_lanes(row, c))
        inverse[a] = g
    return True


@compile_inline
def _reduce(modal, s, n):
    """Make M_fr and b_f ``L^-1 M_fr``, ``L^-1 b_f``: four modes b at a time, less the rows of all modes a before b."""
    M_rf = modal.M_rf[s]
    b_f = modal.b_f[s]
    for b in range(0, n, WIDTH):
        v = rows6(M_rf, 0, b)
        load = get_lanes(b_f, b)
        for a in range(b):
            f = modal.inverse[s, a] * get_lanes(modal.M_ff[s, a], b)
            v = axpy6(v, -1.0 * f, mode6(M_rf, a))
            load = load - f * b_f[a]
        for k in range(min(n - b, WIDTH) - 1):
            put_rows6(M_rf, 0, b, v)
            put_lanes(b_f, b, load)
            a = b + k
            f = modal.inverse[s, a] * get_lanes(modal.M_ff[s, a], b) * get_lanes(AFTER[k], 0)
            v = axpy6(v, -1.0 * f, mode6(M_rf, a))
            load = load - f * b_f[a]
        put_rows6(M_rf, 0, b, v)
        put_lanes(b_f, b, load)


@compile_inline
def _condense(own, modal, s, n):
    """Subtract ``M_rf M_ff^-1 M_fr`` from the articulated inertia of a link, ``M_rf M_ff^-1 b_f`` from its bias."""
    M = zero6()
    H = zero9()
    J = zero6()
    P = zero6()
    for b in range(0, n, WIDTH):
        g = get_lanes(modal.inverse[s], b)
        v = rows6(modal.M_rf[s], 0, b)
        f = v[:3]
        t = v[3:]
        M = less_outer(M, g, f)
        H = less_product(H, g, f, t)
        J = less_outer(J, g, t)
        P = axpy6(P, -1.0 * (g * get_lanes(modal.b_f[s], b)), v)
    put6(own.M, add6(get6(own.M), sums6(M)))
    put9(own.H, add9(get9(own.H), sums9(H)))
    put6(own.J, add6(get6(own.J), sums6(J)))
    put6(own.force, add6(get6(own.force), sums6(P)))


@compile_inline
def eliminate_load(modal, model, data, i):
    """Condense a new modal bias force b_f of link i with the pivots of `eliminate_modes`."""
    if modal is None:
        return
    if model.links[i].slot < 0:
        return
    s = model.links[i].slot
    n = model.links[i].modes
    force = get6(data.links[i].force)
    for a in range(n):
        f = modal.inverse[s, a] * modal.b_f[s, a]
        for b in range(a + 1, n):
            modal.b_f[s, b] -= modal.M_ff[s, a, b] * f
        force = axpy6(force, -f, mode6(modal.M_rf[s], a))
    put6(data.links[i].force, force)


@compile_inline
def modal_accelerations(modal, model, data, i, udot):
    """Solve for q'' of link i from its A: back substitution."""
    if modal is None:
        return
    if model.links[i].slot < 0:
        return
    s = model.links[i].slot
    n = model.links[i].modes
    u = model.links[i].uq
    A = get6(data.links[i].acceleration)
    M_ff = modal.M_ff[s]
    qdd = modal.qdd[s]
    for b in range(0, n, WIDTH):
        put_lanes(qdd, b, -1.0 * dot6(A, rows6(modal.M_rf[s], 0, b)) - get_lanes(modal.b_f[s], b))
    for a in range(n - 1, -1, -1):  # by columns: a sum over a row would wait for each number in turn
        v = qdd[a] * modal.inverse[s, a]
        udot[u + a] = v
        qdd[a] = v
        for b in range(a):
            qdd[b] -= M_ff[b, a] * v


@compile_inline
def clear_modal_loads(modal):
    """Set all modal loads to zero."""
    if modal is not None:
        modal.load[:] = 0.0


@compile_inline
def set_bias_from_loads(modal, model, i):
    """Set the modal bias force of link i to that of its modal loads alone."""
    if modal is not None:
        s = model.links[i].slot
        if s >= 0:
            for a in range(model.links[i].modes):
                modal.b_f[s, a] = -modal.load[s, a]


@compile_inline
def condense_rows(modal, model, i, begin, end, work):
    """Condense the modal forces of unit multipliers at link i (responses.py) with the pivots of `eliminate_modes`."""
    if modal is not None:
        if model.links[i].slot >= 0:
            _condense_rows(modal, model.links[i].slot, model.links[i].modes, begin, end, work)


@compile_kernel
def _condense_rows(modal, s, n, begin, end, work):
    for a in range(n):
        M_fr = mode6(modal.M_rf[s], a)
        for p in range(begin, end):
            k = work.paths.entries[p].bundle
            forces = work.modal[p]
            own = work.entries[p]
            f = get_lanes(forces, 4 * a) * modal.inverse[s, a]
            free = work.bundles[k].free
            for b in range(a + 1, n):
                put_lanes(forces, 4 * b, get_lanes(forces, 4 * b) - f * modal.M_ff[s, a, b])
            put_lanes6(own.force, axpy6(get_lanes6(own.force), -1.0 * f, M_fr))
            put_lanes(free, 0, get_lanes(free, 0) - f * modal.b_f[s, a])
            put_lanes(own.joint_force, 0, f)
            for q in range(begin, p + 1):
                S = work.bundles[k].S if q == p else work.between[k, work.paths.entries[q].bundle].S
                other = get_lanes(work.modal[q], 4 * a)
                for c in range(work.paths.bundles[k].count):
                    put_lanes(S, 4 * c, get_lanes(S, 4 * c) + own.joint_force[c] * other)


@compile_inline
def push_bias_of_modes(modal, model, i, size, forces, p, k):
    """Subtract a multiplier `size` times its eliminated modal forces, lane k of ``forces[p]``, from link i's b_f."""
    if modal is not None:
        for a in range(model.links[i].modes):
            modal.b_f[model.links[i].slot, a] -= size * forces[p, 4 * a + k]


@compile_inline
def clear_bias_of_modes(modal, model):
    """Set the modal bias forces to zero."""
    if modal is not None:
        modal.b_f[:] = 0.0


@compile_inline
def add_modal_loads(modal, model, force):
    """Add the modal rows of generalised forces ``force (nu,)`` to the modal loads."""
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
    """Add the bias force of link i on its parent, parent link's axes, to the parent's modal bias force."""
    if modal is not None:
        slot, p = model.links[i].phi, model.links[i].parent
        if slot >= 0:
            for a in range(model.links[p].modes):
                modal.b_f[model.links[p].slot, a] += on_shape(modal, slot, a, force, torque)


@compile_inline
def add_row_to_modes(modal, model, i, force, torque, out, entry):
    """Add the generalised forces of wrenches of link i, parent link's axes, on its parent's modes to ``out``."""
    if modal is not None:
        slot = model.links[i].phi
        if slot >= 0:
            forces = out[entry.parent]
            for a in range(model.links[model.links[i].parent].modes):
                before = get_lanes(forces, 4 * a) if entry.accumulates else four(0.0)
                put_lanes(forces, 4 * a, before + on_shape(modal, slot, a, force, torque))


@compile_inline
def add_modal_forces(modal, model, i, force, torque, out):
    """Add the generalised forces of link i's wrench, parent link's axes, on its parent's modes to ``out (nu,)``."""
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
        A = get6(data.links[i].acceleration)
        if s >= 0:
            for a in range(n):
                out[u + a] = dot6(mode6(modal.M_rf[s], a), A) + modal.b_f[s, a] - modal.load[s, a]
            for a in range(n):
                qdd = modal.qdd[s, a]
                f = axpy6(f, qdd, mode6(modal.M_rf[s], a))
                out[u + a] += modal.M_ff[s, a, a] * qdd
                for b in range(a + 1, n):  # the upper half of M_ff
                    out[u + a] += modal.M_ff[s, a, b] * modal.qdd[s, b]
                    out[u + b] += modal.M_ff[s, a, b] * qdd
    return f


@compile_inline
def modal_momenta(modal, model, link):
    """Return the modes' share ``M_rf q'`` of the momenta of a link's body, the angular one about the link's origin."""
    linear, angular = ZERO3, ZERO3
    if modal is not None:
        s = model.links[link].slot
        if s >= 0:
            for a in range(model.links[link].modes):
                qd = modal.qd[s, a]
                M_fr = mode6(modal.M_rf[s], a)
                linear = axpy3(linear, qd, M_fr[:3])
                angular = axpy3(angular, qd, M_fr[3:])
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
                qd = modal.qd[s, a]
                own = qd * modal.M_ff[s, a, a]
                for b in range(a + 1, n):  # M_ff is symmetric, its upper half is there
                    own += 2.0 * modal.qd[s, b] * modal.M_ff[s, a, b]
                kinetic += qd * own
                strain += 0.5 * model.modal.K[k, a] * modal.q[s, a] ** 2
    return kinetic, strain
