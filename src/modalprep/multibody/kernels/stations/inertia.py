"""Mass matrix and bias force of a body with stations (theory 4.10).

The parts are rigid bodies on a chain of frames. What the body's second order has beyond them moves it as affine
functions of the whole, p' of `modal_inertia.deflect`, and the rest of the modes stays P'. With what the parts move in
those functions, p_s, all is the Gram matrix of ``parts + X_r p'_r`` and the rest.
"""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.compiler.lanes import WIDTH, four, get_lanes, numbers, put_lanes, transposed_lanes
from modalprep.multibody.kernels.algebra.matrices import (
    antisymmetric,
    plus_product,
    product,
    square,
    symmetric_product,
    symmetric_times,
    times,
    transposed,
)
from modalprep.multibody.kernels.algebra.rows import (
    dots9,
    put_rows3,
    put_rows6,
    row_vectors,
    rows3,
    rows9,
    vectors,
)
from modalprep.multibody.kernels.algebra.tuples import (
    ZERO3,
    ZERO6,
    add3,
    add6,
    add9,
    axpy3,
    cross,
    dot3,
    get3,
    get6,
    get9,
    put3,
    put6,
    put9,
    put_angular,
    scaled3,
    take3,
)


@compile_kernel
def own_stations(model, data, i):
    """Write the mass matrix and bias force of link i's body, after `deflect` of what the parts leave to the rest."""
    modal = data.modal
    s = model.links[i].slot
    k = model.links[i].kind
    n = model.links[i].modes
    own = data.links[i]
    H_rest = model.modal.parts.H_rest[k]
    moved = dots9(H_rest, modal.q[s], n)
    E = add9(add9(dots9(modal.P_eta, modal.eta, n), moved), transposed(moved))
    Y = add9(dots9(modal.P_eta, modal.etad, n), dots9(H_rest, modal.qd[s], n))
    for c in range(9):
        for b in range(0, n, WIDTH):
            put_lanes(modal.P_eta[c], b, get_lanes(modal.P_eta[c], b) + get_lanes(H_rest[c], b))
    w = get3(own.omega)
    first, second, J, force, torque = _sum_parts(model, data, i, w)
    f = _affine_bias(w, modal.p, modal.pd, modal.pdd)
    fs = _affine_bias(w, modal.parts.p, modal.parts.pd, modal.parts.pdd)
    p = vectors(modal.p)
    ps = vectors(modal.parts.p)
    for b in range(0, n, WIDTH):
        _rows(modal, model, i, w, p, ps, f, fs, b)
    _modal_mass(modal, k, s, n)
    root = modal.integrals.root_mass[k]
    second = add9(second, E)
    torque = add3(torque, _rest_torque(w, E, Y))
    for r in range(4):
        both = add3(p[r], ps[r])
        second = plus_product(plus_product(second, p[r], both), ps[r], p[r])
        torque = add3(torque, add3(cross(both, f[r]), cross(p[r], fs[r])))
    _put_inertia(own, axpy3(first, root, p[0]), second, J)
    put3(own.force, axpy3(force, root, f[0]))
    put_angular(own.force, torque)


@compile_inline
def _put_inertia(own, s, E, J):
    """Write M_rr of the first moment s, the second moment E (9) and the moments of inertia J (6) of the parts."""
    put6(own.M, (own.mass, 0.0, 0.0, own.mass, 0.0, own.mass))
    put9(own.H, (0.0, s[2], -s[1], -s[2], 0.0, s[0], s[1], -s[0], 0.0))
    xy, xz, yz = 0.5 * (E[1] + E[3]), 0.5 * (E[2] + E[6]), 0.5 * (E[5] + E[7])
    put6(own.J, add6(J, (E[4] + E[8], -xy, -xz, E[0] + E[8], -yz, E[0] + E[4])))


@compile_inline
def _rest_torque(w, E, Y):
    """Bias torque ``w x J w + 2 (tr(Y) - Y) w`` of the rest of the motion, ``J = tr(E) - E``."""
    return axpy3(axpy3(cross(times(E, w), w), 2.0 * (Y[0] + Y[4] + Y[8]), w), -2.0, times(Y, w))


@compile_inline
def _affine_bias(w, p, pd, pdd):
    """Return ``w x (w x p_r) + 2 w x p_r' + p_r''`` of four functions."""
    return (
        _bias(w, take3(p, 0), take3(pd, 0), take3(pdd, 0)),
        _bias(w, take3(p, 3), take3(pd, 3), take3(pdd, 3)),
        _bias(w, take3(p, 6), take3(pd, 6), take3(pdd, 6)),
        _bias(w, take3(p, 9), take3(pd, 9), take3(pdd, 9)),
    )


@compile_inline
def _bias(w, p, pd, pdd):
    return add3(cross(w, axpy3(cross(w, p), 2.0, pd)), pdd)


@compile_kernel
def _sum_parts(model, data, i, w):
    """Sum the parts of link i's body: momenta per modal rate, M_ff, affine coordinates and bias forces to the data.

    Returns first moment, ``sum m r r^T`` (9), moments of inertia about the centres (6), bias force and torque.
    """
    modal = data.modal
    work = modal.parts
    parts = model.modal.parts
    k = model.links[i].kind
    n = model.links[i].modes
    start = model.links[i].stations
    z = four(0.0)
    none = (z, z, z)
    place, rate, acceleration = none, none, none
    first, force, torque, J = ZERO3, ZERO3, ZERO3, ZERO6
    second = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for p in range(parts.number[k]):
        own = parts.parts[parts.first[k] + p]
        at = work.frames[start + p]
        R = get9(at.R)
        r = get3(at.r)
        inertia = symmetric_product(product(R, square(get6(own.J))), R)
        f, t = _bias_of_part(own.mass, inertia, at, w)
        put6(at.inertia, inertia)
        put3(at.force, f)
        put3(at.torque, t)
        first = axpy3(first, own.mass, r)
        second = plus_product(second, scaled3(own.mass, r), r)
        J = add6(J, inertia)
        force = add3(force, f)
        torque = add3(torque, add3(t, cross(r, f)))
        x, xd, xdd = _affine_of_part(own, at, R)
        place, rate, acceleration = add3(place, x), add3(rate, xd), add3(acceleration, xdd)
    _put_four(work.p, place)
    _put_four(work.pd, rate)
    _put_four(work.pdd, acceleration)
    for b in range(0, n, WIDTH):
        _columns(work, parts.parts, parts.first[k], start, parts.number[k], modal.integrals.root_mass[k], b)
    _add_mass(modal.M_ff[model.links[i].slot], work.force, work.J, start, parts.number[k], n)
    return first, second, J, force, torque


@compile_inline
def _bias_of_part(m, inertia, at, w):
    """Force at the centre and torque about it of a part where A, alpha and q'' are zero."""
    turn = get3(at.w)
    spin = add3(w, turn)
    f = scaled3(m, _bias(w, get3(at.r), get3(at.v), get3(at.a)))
    t = symmetric_times(inertia, add3(get3(at.alpha), cross(w, turn)))
    return f, add3(t, cross(spin, symmetric_times(inertia, spin)))


@compile_inline
def _affine_of_part(own, at, R):
    """Return what a part moves in the affine functions, their rates and accelerations: four in one. Writes its arms."""
    r, v, a = get3(at.r), get3(at.v), get3(at.a)
    spin, alpha = get3(at.w), get3(at.alpha)
    mass = get_lanes(own.by_mass, 0)
    e = times(R, (get_lanes(own.by_turn, 0), get_lanes(own.by_turn, 4), get_lanes(own.by_turn, 8)))
    for c in range(3):
        put_lanes(at.arms, 4 * c, e[c])
    rate = cross(spin, e)
    bulge = add3(cross(alpha, e), cross(spin, rate))
    return (
        add3(e, (r[0] * mass, r[1] * mass, r[2] * mass)),
        add3(rate, (v[0] * mass, v[1] * mass, v[2] * mass)),
        add3(bulge, (a[0] * mass, a[1] * mass, a[2] * mass)),
    )


@compile_inline
def _put_four(out, x):
    """Write the components of four vectors, four in one, as four vectors."""
    z = four(0.0)
    rows = transposed_lanes(x[0], x[1], x[2], z)
    for r in range(4):
        v = numbers(rows[r])
        out[3 * r], out[3 * r + 1], out[3 * r + 2] = v[0], v[1], v[2]


@compile_inline
def _columns(work, parts, first, start, number, root, b):
    """Write the momenta, modal forces and affine coordinates of all parts by four modes, and the momenta of each."""
    z = four(0.0)
    none = (z, z, z)
    linear, angular, p1, p2, p3, modal = none, none, none, none, none, z
    for p in range(number):
        own, at, J = parts[first + p], work.frames[start + p], work.J[start + p]
        by_mass, arms = own.by_mass, at.arms
        v = rows3(J, 0, b)
        w = rows3(J, 3, b)
        push = scaled3(own.mass, v)
        turn = symmetric_times(get6(at.inertia), w)
        put_rows6(work.force[start + p], 0, b, (push[0], push[1], push[2], turn[0], turn[1], turn[2]))
        linear = add3(linear, push)
        angular = add3(angular, add3(turn, cross(get3(at.r), push)))
        modal = modal + (dot3(get3(at.force), v) + dot3(get3(at.torque), w))
        p1 = add3(axpy3(p1, by_mass[1], v), cross(w, (arms[1], arms[5], arms[9])))
        p2 = add3(axpy3(p2, by_mass[2], v), cross(w, (arms[2], arms[6], arms[10])))
        p3 = add3(axpy3(p3, by_mass[3], v), cross(w, (arms[3], arms[7], arms[11])))
    put_rows3(work.S, 0, b, linear)
    put_rows3(work.S, 3, b, angular)
    put_rows3(work.dp, 0, b, scaled3(1.0 / root, linear))
    put_rows3(work.dp, 3, b, p1)
    put_rows3(work.dp, 6, b, p2)
    put_rows3(work.dp, 9, b, p3)
    put_lanes(work.b, b, modal)


@compile_inline
def _add_mass(M_ff, force, J, start, number, n):
    """Write the upper half of ``J^T A J`` of all parts, four rows of four numbers at a time."""
    for a in range(0, n, WIDTH):
        for b in range(a, n, WIDTH):
            z = four(0.0)
            rows = (z, z, z, z)
            turned = (z, z, z, z)
            for p in range(start, start + number):
                for c in range(3):
                    rows = _add_outer(rows, force[p, c], a, get_lanes(J[p, c], b))
                    turned = _add_outer(turned, force[p, 3 + c], a, get_lanes(J[p, 3 + c], b))
            for c in range(WIDTH):
                put_lanes(M_ff[a + c], b, rows[c] + turned[c])


@compile_inline
def _add_outer(rows, f, a, x):
    """Return four rows with four numbers times four others added."""
    return rows[0] + f[a] * x, rows[1] + f[a + 1] * x, rows[2] + f[a + 2] * x, rows[3] + f[a + 3] * x


@compile_inline
def _rows(modal, model, i, w, p, ps, f, fs, b):
    """Write S, C and b_f of four modes; external modal forces become zero."""
    k = model.links[i].kind
    s = model.links[i].slot
    root = modal.integrals.root_mass[k]
    dp = row_vectors(modal.dp, b)
    dps = row_vectors(modal.parts.dp, b)
    P_eta = rows9(modal.P_eta, b)
    C = add3(rows3(modal.parts.S, 3, b), antisymmetric(P_eta))
    force = dot3(w, times(P_eta, w)) - dot3(w, w) * (P_eta[0] + P_eta[4] + P_eta[8])
    force = force + 2.0 * dot3(w, rows3(modal.gyro, 0, b)) + get_lanes(modal.parts.b, b)
    for r in range(4):
        C = add3(C, add3(cross(add3(p[r], ps[r]), dp[r]), cross(p[r], dps[r])))
        force = force + (dot3(add3(f[r], fs[r]), dp[r]) + dot3(f[r], dps[r]))
    K = get_lanes(model.modal.K[k], b) * get_lanes(modal.q[s], b)
    put_rows3(modal.M_rf[s], 0, b, axpy3(rows3(modal.parts.S, 0, b), root, dp[0]))
    put_rows3(modal.M_rf[s], 3, b, C)
    put_lanes(modal.b_f[s], b, force + K + get_lanes(model.modal.D[k], b) * get_lanes(modal.qd[s], b))
    put_lanes(modal.load[s], b, four(0.0))


@compile_inline
def _modal_mass(modal, k, s, n):
    """Add ``M_rest + dp' (dp' + dp_s) + dp_s dp'`` to the upper half of M_ff."""
    dp = modal.dp
    dps = modal.parts.dp
    for a in range(n):
        M_rest = modal.integrals.M_rest[k, a]
        row = modal.M_ff[s, a]
        for b in range(a & -WIDTH, n, WIDTH):
            total = get_lanes(row, b) + get_lanes(M_rest, b)
            for c in range(12):
                own = get_lanes(dp[c], b)
                total = total + (dp[c, a] * (own + get_lanes(dps[c], b)) + dps[c, a] * own)
            put_lanes(row, b, total)
