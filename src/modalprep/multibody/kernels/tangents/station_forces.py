"""Forces of the parts of a body with stations and of its second order beyond them, and their derivatives (theory 5.8).

A part is a rigid body in the field ``a + S x + 2 W x' + x''`` of the link, see bodies.py. The second order beyond the
parts, ``X_r p'_r(q)``, accelerates them by ``X_r c_r`` with the acceleration c_r of p'_r, and feels their motion
in the same functions. In the axes of the link, at its origin.
"""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.compiler.lanes import WIDTH, four, get_lanes, put_lanes
from modalprep.multibody.kernels.algebra.matrices import (
    antisymmetric,
    product,
    spin_matrix,
    square,
    times,
    transposed,
)
from modalprep.multibody.kernels.algebra.rows import put_rows3, put_rows6, rows3
from modalprep.multibody.kernels.algebra.tuples import (
    add3,
    add9,
    axpy3,
    axpy9,
    cross,
    dot3,
    get3,
    get6,
    get9,
    put3,
    put_angular,
    scaled3,
    take3,
    unit3,
)
from modalprep.multibody.kernels.tangents.bends import add_bend_curvature, bent, second_order
from modalprep.multibody.kernels.tangents.station_back import bring_back
from modalprep.multibody.kernels.tangents.station_steps import move_stations


@compile_kernel
def station_forces(modal, model, work, i, a, S, w):
    """Add force and derivatives of all that moves with the stations of link i; arguments as `flexible_slopes`."""
    own, bends, at = work.bodies, work.bends, work.stations
    link, end = model.links[i], len(work.bends.p) - 1
    s, n, k = link.slot, link.modes, link.kind
    q, qd, qdd = modal.q[s], modal.qd[s], modal.qdd[s]
    B = modal.integrals.B[k]
    table = modal.integrals.Kg_p[k]
    strain = modal.integrals.strain[k]
    second_order(bends, end, table, 1.0, 12, q, qd, qdd, n)
    bent(bends, end, B, strain, 12, q, qd, qdd, n)
    move_stations(modal, model, at, i)
    _affine_of_parts(model, at, i)
    for r in range(4):
        _particle(modal, own, bends, at, end, s, k, n, r, a, S, w)
    for m in range(n):
        _on_modes(own, bends, at, end, s, m, n)
    add_bend_curvature(bends, end, B, table, 1.0, strain, 12, bends.acceleration[end], n, own.by_q[s, 6:])
    for p in range(model.modal.parts.number[k]):
        _part(model, own, bends, at, end, i, p, a, S, w)
    bring_back(model, own, at, i)


@compile_inline
def _affine_of_parts(model, at, i):
    """Write what the parts of link i move in the affine functions, its rates, and their derivatives."""
    parts, link = model.modal.parts, model.links[i]
    at.own[:] = 0.0
    at.dp[:] = 0.0
    at.acc_q[:] = 0.0  # of the second rate
    at.acc_qd[:] = 0.0  # of the first rate by q
    for p in range(parts.number[link.kind]):
        own = parts.parts[parts.first[link.kind] + p]
        row = link.stations + p
        for r in range(4):
            _add_part(at, row, own.by_mass[r], _arm(own, at.steps[row], r), 3 * r, link.modes)


@compile_inline
def _arm(own, step, r):
    """Return ``int rho (x - c) X_r`` of a part, turned."""
    e = own.by_turn
    return times(get9(step.R), (e[r], e[4 + r], e[8 + r]))


@compile_inline
def _add_part(at, row, mass, e, c, n):
    """Add a part to one affine function."""
    step = at.steps[row]
    w, alpha = get3(step.w), get3(step.alpha)
    rate = cross(w, e)
    _add(at.own[0], c, axpy3(e, mass, get3(step.r)))
    _add(at.own[1], c, axpy3(rate, mass, get3(step.v)))
    _add(at.own[2], c, axpy3(add3(cross(alpha, e), cross(w, rate)), mass, get3(step.a)))
    for b in range(0, n, WIDTH):
        turn, w_q = rows3(at.J[row], 3, b), rows3(at.rates[row], 3, b)
        e_q = cross(turn, e)
        rate_q = add3(cross(w_q, e), cross(w, e_q))
        second = add3(cross(rows3(at.rates[row], 9, b), e), cross(alpha, e_q))
        second = add3(second, add3(cross(w_q, rate), cross(w, rate_q)))
        _add_rows(at.dp, c, b, axpy3(e_q, mass, rows3(at.J[row], 0, b)))
        _add_rows(at.acc_qd, c, b, axpy3(rate_q, mass, rows3(at.rates[row], 0, b)))
        _add_rows(at.acc_q, c, b, axpy3(second, mass, rows3(at.rates[row], 6, b)))


@compile_inline
def _add(out, c, v):
    put3(out[c:], add3(take3(out, c), v))


@compile_inline
def _add_rows(out, c, b, v):
    put_rows3(out, c, b, add3(rows3(out, c, b), v))


@compile_inline
def _accelerated(S, w, p, pd, pdd):
    """Return ``S p + 2 w x p' + p''``, of one vector or four."""
    return add3(add3(times(S, p), scaled3(2.0, cross(w, pd))), pdd)


@compile_inline
def _particle(modal, own, bends, at, end, s, k, n, r, a, S, w):
    """Add what p'_r does to the torque; `bends.acceleration` becomes that of both, by which it acts on the modes."""
    c = 3 * r
    root = modal.integrals.root_mass[k] if r == 0 else 0.0
    p, pd = take3(bends.p[end], c), take3(bends.rate[end], c)
    ps, psd = take3(at.own[0], c), take3(at.own[1], c)
    acc = _accelerated(S, w, p, pd, take3(bends.acceleration[end], c))
    both = add3(acc, axpy3(_accelerated(S, w, ps, psd, take3(at.own[2], c)), root, a))
    put3(at.beyond[c:], acc)
    put3(bends.acceleration[end, c:], both)
    force = own.force[s]
    put_angular(force, add3(take3(force, 3), cross(p, both)))
    for b in range(0, n, WIDTH):
        dp, rate_q = rows3(bends.dp[end], c, b), rows3(bends.rate_q[end], c, b)
        by_q = _accelerated(S, w, dp, rate_q, rows3(bends.acceleration_q[end], c, b))
        by_qd = scaled3(2.0, add3(cross(w, dp), rate_q))
        dps, parts_q = rows3(at.dp, c, b), rows3(at.acc_qd, c, b)
        both_q = add3(by_q, _accelerated(S, w, dps, parts_q, rows3(at.acc_q, c, b)))
        both_qd = axpy3(by_qd, 2.0, add3(cross(w, dps), parts_q))
        put_rows3(own.acc_q, c, b, by_q)
        put_rows3(own.acc_qd, c, b, by_qd)
        put_rows3(at.acc_q, c, b, both_q)
        put_rows3(at.acc_qd, c, b, both_qd)
        _add_rows(own.by_q[s], 3, b, add3(cross(dp, both), cross(p, both_q)))
        _add_rows(own.by_qd[s], 3, b, cross(p, both_qd))
    for axis in range(3):
        _particle_spin(own, bends, at, end, n, c, axis, w)


@compile_inline
def _spun(w, axis, p, pd):
    """Return the derivative of an acceleration by the spin about an axis, the acceleration of the origin held."""
    x = axpy3(axpy3(scaled3(-2.0, cross(pd, unit3(axis))), p[axis], w), -2.0 * w[axis], p)
    return axpy3(x, dot3(w, p), unit3(axis))


@compile_inline
def _particle_spin(own, bends, at, end, n, c, axis, w):
    """Add the derivative of what p'_r does by the spin about an axis."""
    p, pd = take3(bends.p[end], c), take3(bends.rate[end], c)
    both = add3(_spun(w, axis, p, pd), _spun(w, axis, take3(at.own[0], c), take3(at.own[1], c)))
    out = own.by_spin[axis]
    put_angular(out, add3(take3(out, 3), cross(p, both)))
    for b in range(0, n, WIDTH):
        put_lanes(out[6:], b, get_lanes(out[6:], b) + dot3(both, rows3(bends.dp[end], c, b)))


@compile_inline
def _on_modes(own, bends, at, end, s, m, n):
    """Add the forces on mode m by the second order beyond the parts, and their derivatives but for its curvature."""
    force = 0.0
    for c in range(12):
        force += bends.dp[end, c, m] * bends.acceleration[end, c]
    own.force[s, 6 + m] += force
    for b in range(0, n, WIDTH):
        x, y = get_lanes(own.by_q[s, 6 + m], b), get_lanes(own.by_qd[s, 6 + m], b)
        for c in range(12):
            dp = bends.dp[end, c, m]
            x = x + dp * get_lanes(at.acc_q[c], b)
            y = y + dp * get_lanes(at.acc_qd[c], b)
        put_lanes(own.by_q[s, 6 + m], b, x)
        put_lanes(own.by_qd[s, 6 + m], b, y)


@compile_inline
def _part(model, own, bends, at, end, i, p, a, S, w):
    """Write the force of a part and its derivatives to its row, and add those by the spin; adds the force on modes."""
    parts, link = model.modal.parts, model.links[i]
    part = parts.parts[parts.first[link.kind] + p]
    row = link.stations + p
    s = link.slot
    n = link.modes
    step = at.steps[row]
    r, v, spin = get3(step.r), get3(step.v), get3(step.w)
    W, turn = spin_matrix(w), spin_matrix(spin)
    E = _second_moment(get9(step.R), get6(part.J))
    G = _turned_field(S, W, turn, spin_matrix(get3(step.alpha)))
    e = _arm(part, step, 1), _arm(part, step, 2), _arm(part, step, 3)
    c = take3(at.beyond, 0), take3(at.beyond, 3), take3(at.beyond, 6), take3(at.beyond, 9)
    f = scaled3(part.mass, add3(a, _accelerated(S, w, r, v, get3(step.a))))
    f = add3(f, _by_mass(part, c))
    t = add3(antisymmetric(product(G, E)), _by_arms(e, c))
    put3(step.force, f)
    put3(step.torque, t)
    for b in range(0, n, WIDTH):
        on_modes = dot3(rows3(at.J[row], 0, b), f) + dot3(rows3(at.J[row], 3, b), t)
        put_lanes(own.force[s, 6:], b, get_lanes(own.force[s, 6:], b) + on_modes)
        _part_slopes(own, at, part, row, b, S, w, (E, G, e, c))
    for axis in range(3):
        _part_spin(own, bends, at, part, end, row, n, axis, w, (r, v, turn, E, e))


@compile_inline
def _second_moment(R, J):
    """Return ``int rho y y^T`` in turned axes, of the moments of inertia J."""
    half = 0.5 * (J[0] + J[3] + J[5])
    E = square((half - J[0], -J[1], -J[2], half - J[3], -J[4], half - J[5]))
    return product(product(R, E), transposed(R))


@compile_inline
def _turned_field(S, W, turn, turning):
    """Return the gradient of the acceleration in a part that turns relative to the link."""
    return add9(add9(S, axpy9(turning, 2.0, product(W, turn))), product(turn, turn))


@compile_inline
def _by_mass(part, c):
    """Return the sum of four vectors, times what a part has of the affine functions."""
    m = part.by_mass
    return add3(axpy3(scaled3(m[0], c[0]), m[1], c[1]), axpy3(scaled3(m[2], c[2]), m[3], c[3]))


@compile_inline
def _by_arms(e, c):
    """Return the torque of the last three of four vectors at their arms."""
    return add3(cross(e[0], c[1]), add3(cross(e[1], c[2]), cross(e[2], c[3])))


@compile_inline
def _part_slopes(own, at, part, row, b, S, w, held):
    """Write the derivatives of force and torque of a part by four modes and their rates."""
    E, G, e, c = held
    W, turn = spin_matrix(w), spin_matrix(get3(at.steps[row].w))
    place, partial = rows3(at.J[row], 0, b), rows3(at.J[row], 3, b)
    v_q, w_q = rows3(at.rates[row], 0, b), rows3(at.rates[row], 3, b)
    c_q = rows3(own.acc_q, 0, b), rows3(own.acc_q, 3, b), rows3(own.acc_q, 6, b), rows3(own.acc_q, 9, b)
    c_qd = rows3(own.acc_qd, 0, b), rows3(own.acc_qd, 3, b), rows3(own.acc_qd, 6, b), rows3(own.acc_qd, 9, b)
    f = scaled3(part.mass, _accelerated(S, w, place, v_q, rows3(at.rates[row], 6, b)))
    fd = scaled3(2.0 * part.mass, add3(cross(w, place), v_q))
    swept = product(_lane_spin(partial), E)
    E_q = add9(swept, transposed(swept))
    spinning = _lane_spin(w_q)
    G_q = axpy9(_lane_spin(rows3(at.rates[row], 9, b)), 2.0, product(W, spinning))
    G_q = add9(G_q, add9(product(spinning, turn), product(turn, spinning)))
    G_qd = add9(product(add9(W, turn), _lane_spin(partial)), spinning)
    t = antisymmetric(add9(product(G_q, E), product(G, E_q)))
    e_q = cross(partial, e[0]), cross(partial, e[1]), cross(partial, e[2])
    t = add3(t, add3(_by_arms(e, c_q), _by_arms(e_q, c)))
    td = add3(scaled3(2.0, antisymmetric(product(G_qd, E))), _by_arms(e, c_qd))
    f, fd = add3(f, _by_mass(part, c_q)), add3(fd, _by_mass(part, c_qd))
    put_rows6(at.forces[row], 0, b, (f[0], f[1], f[2], t[0], t[1], t[2]))
    put_rows6(at.forces[row], 6, b, (fd[0], fd[1], fd[2], td[0], td[1], td[2]))


@compile_inline
def _lane_spin(w):
    """Return ``w~`` of four vectors."""
    z = four(0.0)
    return z, -1.0 * w[2], w[1], w[2], z, -1.0 * w[0], -1.0 * w[1], w[0], z


@compile_inline
def _part_spin(own, bends, at, part, end, row, n, axis, w, held):
    """Add the derivative of the forces of a part by the spin about an axis."""
    r, v, turn, E, e = held
    x = _beyond_spin(bends, end, 0, axis, w), _beyond_spin(bends, end, 3, axis, w)
    x = x[0], x[1], _beyond_spin(bends, end, 6, axis, w), _beyond_spin(bends, end, 9, axis, w)
    f = add3(scaled3(part.mass, _spun(w, axis, r, v)), _by_mass(part, x))
    turning, W = spin_matrix(unit3(axis)), spin_matrix(w)
    G = add9(add9(product(turning, W), product(W, turning)), product(turning, add9(turn, turn)))
    t = add3(antisymmetric(product(G, E)), _by_arms(e, x))
    out = own.by_spin[axis]
    put3(out, add3(get3(out), f))
    put_angular(out, add3(take3(out, 3), add3(t, cross(r, f))))
    for b in range(0, n, WIDTH):
        on_modes = dot3(rows3(at.J[row], 0, b), f) + dot3(rows3(at.J[row], 3, b), t)
        put_lanes(out[6:], b, get_lanes(out[6:], b) + on_modes)


@compile_inline
def _beyond_spin(bends, end, c, axis, w):
    return _spun(w, axis, take3(bends.p[end], c), take3(bends.rate[end], c))
