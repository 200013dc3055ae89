"""The motion of an interface relative to its body, and its derivatives by the modal coordinates in closed form.

The rotation is the Cayley map of ``(1 + v.v / 12) v`` with ``v = psi q - q Kg_T q / 2``. Its angular velocity by v'
is ``W(v) v'`` of spins.py, with the factors ``s k``, ``s / 6`` and ``s k^2 / 2``, where ``k = 1 + v.v / 12`` and
``s = 4 / (4 + k^2 v.v)``. An interface of a body with stations moves on with its part (station_ends.py).
"""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.compiler.lanes import WIDTH, four, get_lanes, put_lanes
from modalprep.multibody.kernels.algebra.rotations import cayley, half_tangent
from modalprep.multibody.kernels.algebra.rows import put_rows3, rows3
from modalprep.multibody.kernels.algebra.tuples import (
    add3,
    axpy3,
    cross,
    dot3,
    get3,
    get_angular,
    put3,
    put_angular,
    sub3,
)
from modalprep.multibody.kernels.data import UNIT
from modalprep.multibody.kernels.tangents.bends import (
    add_bend_curvature,
    along_modes,
    bent,
    second_order,
    straight,
)
from modalprep.multibody.kernels.tangents.spins import (
    A,
    B,
    C,
    back_slope,
    spin,
    spin_curve,
    spin_slope,
    spin_transposed,
)
from modalprep.multibody.kernels.tangents.station_ends import (
    add_end_curvature,
    bend_beyond,
    column3,
    move_leaf,
    move_on,
)


@compile_kernel
def turn_interface(modal, model, modes, link, node, k):
    """Write the motion of an interface of a flexible body relative to it, and its derivatives, to place k.

    Returns its displacement and its rotation, axes of the link.
    """
    bends, turns = modes.bends, modes.turns
    own = model.links[link]
    s, n = own.slot, own.modes
    row = own.first_interface + node
    phi = model.modal.Phi[row]
    q, qd, qdd = modal.q[s], modal.qd[s], modal.qdd[s]
    if own.stations >= 0:
        bend_beyond(modal, model, bends, link, row, k)
        R = _rotate(bends, turns, modal.integrals.B[own.kind], k, q, qd, qdd, n)
        move_leaf(model, modes, link, row, k, q, qd, qdd, n)
        return move_on(model, modes, link, node, k, R)
    if own.modal_mass == UNIT:
        straight(bends, k, phi, 3, q, qd, qdd, n)
        _turn_straight(bends, k, n)
    else:
        second_order(bends, k, model.modal.Kg_FT[row], -1.0, 6, q, qd, qdd, n)
        bent(bends, k, phi, model.modal.arm[row], 3, q, qd, qdd, n)
    R = _rotate(bends, turns, phi, k, q, qd, qdd, n)
    return get3(bends.p[k]), R


@compile_inline
def _turn_straight(bends, k, n):
    """Write the second order of a rotation vector that has none: another body may have left its own at the place."""
    z = four(0.0)
    for b in range(0, n, WIDTH):
        put_rows3(bends.Dq[k], 3, b, (z, z, z))
        put_rows3(bends.Dqd[k], 3, b, (z, z, z))
        put_rows3(bends.Dqdd[k], 3, b, (z, z, z))


@compile_inline
def _rotate(bends, turns, phi, k, q, qd, qdd, n):
    """Write the rotation and its derivatives, after the displacement; returns the rotation."""
    for c in range(3):
        for b in range(0, n, WIDTH):
            put_lanes(turns.v_q[k, c], b, get_lanes(phi[3 + c], b) + get_lanes(bends.Dq[k, 3 + c], b))
    psi = along3(phi, 3, q, n)
    v = axpy3(psi, 0.5, along3(bends.Dq[k], 3, q, n))
    vd = along3(turns.v_q[k], 0, qd, n)
    vdd = add3(along3(turns.v_q[k], 0, qdd, n), along3(bends.Dqd[k], 3, qd, n))
    put3(turns.v[k], v)
    _put_factors(turns.factors[k], dot3(v, v))
    f = turns.factors[k]
    w, wd = spin(f, 0, v, vd), add3(spin(f, 0, v, vdd), spin_slope(f, 0, v, vd, vd))
    rate = get3(bends.rate[k])
    linear = axpy3(get3(bends.acceleration[k]), -1.0, cross(w, rate))
    put3(turns.twist[k], rate)
    put_angular(turns.twist[k], w)
    put3(turns.rate[k], linear)
    put_angular(turns.rate[k], wd)
    for b in range(0, n, WIDTH):
        v_q, growing = rows3(turns.v_q[k], 0, b), rows3(bends.Dqd[k], 3, b)
        by_v, by_vd = spin_curve(f, v, vd, vd, v_q), _by_rate(f, v, vd, v_q)
        growth = spin(f, 0, v, growing)
        bending = add3(spin_slope(f, 0, v, vdd, v_q), by_v)
        bending = add3(bending, add3(spin(f, 0, v, rows3(bends.Dqdd[k], 3, b)), _by_rate(f, v, vd, growing)))
        put_rows3(turns.spin_q[k], 0, b, spin(f, 0, v, v_q))
        put_rows3(turns.w_q[k], 0, b, add3(spin_slope(f, 0, v, vd, v_q), growth))
        put_rows3(turns.wd_q[k], 0, b, bending)
        put_rows3(turns.wd_qd[k], 0, b, axpy3(by_vd, 2.0, growth))
    R, _ = cayley(half_tangent(v))
    return R


@compile_inline
def along3(x, c, f, n):
    """Return the products of three rows from c on with the numbers of n modes."""
    return along_modes(x[c], f, n), along_modes(x[c + 1], f, n), along_modes(x[c + 2], f, n)


@compile_inline
def relative_slopes(bends, turns, k, b):
    """Return what four modes from b on change at an interface, axes of the link (linear, angular each).

    Its place by them; its velocity relative to the body by them; the rate of that by them and by their speeds.
    """
    rate, w = get3(turns.twist[k]), get_angular(turns.twist[k])
    linear, wd = get3(turns.rate[k]), get_angular(turns.rate[k])
    dp, rate_q = rows3(bends.dp[k], 0, b), rows3(bends.rate_q[k], 0, b)
    spin_q, w_q = rows3(turns.spin_q[k], 0, b), rows3(turns.w_q[k], 0, b)
    of_twist = add3(rate_q, cross(rate, spin_q)), add3(w_q, cross(w, spin_q))
    linear_q = add3(sub3(rows3(bends.acceleration_q[k], 0, b), cross(w, rate_q)), cross(rate, w_q))
    linear_q = add3(linear_q, cross(linear, spin_q))
    of_rate = linear_q, add3(rows3(turns.wd_q[k], 0, b), cross(wd, spin_q))
    linear_qd = sub3(axpy3(cross(rate, spin_q), 2.0, rate_q), cross(w, dp))
    return (dp, spin_q), of_twist, of_rate, (linear_qd, rows3(turns.wd_qd[k], 0, b))


@compile_kernel
def add_turn_curvature(model, modes, link, node, k, force, torque, out):
    """Add the derivative by q of what a force and a torque, axes of the link, do at an interface to ``out (n, n)``.

    After `turn_interface`; both turn with the interface.
    """
    bends, turns = modes.bends, modes.turns
    own = model.links[link]
    n, row = own.modes, own.first_interface + node
    v, f = get3(turns.v[k]), turns.factors[k]
    flexible = own.modal_mass != UNIT
    if own.stations >= 0:
        add_end_curvature(model, modes, link, row, k, force, torque, out)
    elif flexible:
        table, arm = model.modal.Kg_FT[row], model.modal.arm[row]
        add_bend_curvature(bends, k, model.modal.Phi[row], table, -1.0, arm, 3, force, n, out)
    back = spin_transposed(f, 0, v, torque)
    for b in range(0, n, WIDTH):
        spin_q = rows3(turns.spin_q[k], 0, b)
        turned, twisted = cross(force, spin_q), cross(torque, spin_q)
        by_v = back_slope(f, v, torque, rows3(turns.v_q[k], 0, b))
        for a in range(n):
            x = dot3(column3(turns.v_q[k], a), by_v) - dot3(column3(bends.dp[k], a), turned)
            x = x - dot3(column3(turns.spin_q[k], a), twisted)
            if flexible:
                for c in range(3):
                    x = x - back[c] * get_lanes(model.modal.Kg_FT[row, a, 3 + c], b)
            put_lanes(out[a], b, get_lanes(out[a], b) + x)


@compile_inline
def _put_factors(out, x):
    """Write a, b, c of the angular velocity, with two derivatives each, for ``v.v = x``; the third stays zero."""
    e = 1.0 / 12.0
    k = 1.0 + x * e
    d = 1.0 / (4.0 + k * k * x)
    d1 = k * k + 2.0 * k * e * x
    d2 = 4.0 * k * e + 2.0 * e * e * x
    s = 4.0 * d
    s1 = -s * d1 * d
    s2 = 2.0 * s * d1 * d1 * d * d - s * d2 * d
    h = 0.5 * k * k
    put3(out[A:], (s * k, s1 * k + s * e, s2 * k + 2.0 * s1 * e))
    put3(out[B:], (s / 6.0, s1 / 6.0, s2 / 6.0))
    put3(out[C:], (s * h, s1 * h + s * k * e, s2 * h + 2.0 * s1 * k * e + s * e * e))


@compile_inline
def _by_rate(f, v, vd, y):
    """Return the derivative of the angular acceleration by v', for a change y."""
    return add3(spin_slope(f, 0, v, vd, y), spin_slope(f, 0, v, y, vd))
