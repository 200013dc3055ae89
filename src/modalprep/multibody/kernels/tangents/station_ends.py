"""Interfaces of bodies with stations: leaves of the chain of frames, moved and turned on by the second order beyond it.

`turns.py` finds the rotation T beyond the chain as that of other bodies; here what the leaf adds. With the leaf's
spin w and rotation R, the interface spins by ``w_T + T w`` and is turned by ``T R``.
"""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.compiler.lanes import WIDTH, four, get_lanes, put_lanes
from modalprep.multibody.kernels.algebra.matrices import product, times, transposed_times
from modalprep.multibody.kernels.algebra.rotations import cayley, half_tangent
from modalprep.multibody.kernels.algebra.rows import put_rows3, rows3
from modalprep.multibody.kernels.algebra.tuples import (
    add3,
    axpy3,
    cross,
    dot3,
    get3,
    get9,
    get_angular,
    put3,
    put_angular,
    sub3,
)
from modalprep.multibody.kernels.interfaces import free_position
from modalprep.multibody.kernels.tangents.bends import add_bend_curvature, bent_by, second_order
from modalprep.multibody.kernels.tangents.spins import spin
from modalprep.multibody.kernels.tangents.station_back import add_chain_curvature
from modalprep.multibody.kernels.tangents.station_steps import move_step


@compile_inline
def leaf_row(modes, k):
    """Return the row of the frame of end k."""
    return len(modes.stations.steps) - 1 - len(modes.bends.p) + k


@compile_kernel
def bend_beyond(modal, model, bends, link, row, k):
    """Write the displacement of an interface beyond the chain, and its derivatives, to place k."""
    own = model.links[link]
    s, n = own.slot, own.modes
    q, qd, qdd = modal.q[s], modal.qd[s], modal.qdd[s]
    second_order(bends, k, model.modal.Kg_FT[row], -1.0, 6, q, qd, qdd, n)
    strain = model.modal.parts.strain[row]
    for b in range(0, n, WIDTH):
        x, y, z = four(0.0), four(0.0), four(0.0)
        for a in range(n):
            each = get_lanes(strain[a], b)
            x, y, z = x + q[a] * each, y + qd[a] * each, z + qdd[a] * each
        put_rows3(bends.rows[k], 0, b, (x, y, z))
    bent_by(bends, k, modal.integrals.B[own.kind], 3, q, qd, qdd, n)


@compile_inline
def move_leaf(model, modes, link, row, k, q, qd, qdd, n):
    """Write the frame of an interface at the end of the chain, and its derivatives."""
    leaf = model.modal.parts.leaves[row]
    a = model.links[link].stations + leaf.parent if leaf.parent >= 0 else len(modes.stations.steps) - 1
    moved = model.modal.parts.leaf_moved[row]
    move_step(modes.stations, a, leaf_row(modes, k), leaf.d, moved, q, qd, qdd, n)


@compile_kernel
def move_on(model, modes, link, node, k, T):
    """Add the motion of the leaf to that beyond the chain at place k; returns displacement and rotation."""
    bends = modes.bends
    turns = modes.turns
    at = modes.stations
    row = leaf_row(modes, k)
    leaf = at.steps[row]
    w, inner = get_angular(turns.twist[k]), times(T, get3(leaf.w))
    spinning = times(T, get3(leaf.alpha))
    for b in range(0, model.links[link].modes, WIDTH):
        _add_slopes(bends, turns, at, row, k, b, T, (w, inner, spinning))
    u = add3(get3(bends.p[k]), sub3(get3(leaf.r), free_position(model, link, node)))
    rate = add3(get3(bends.rate[k]), get3(leaf.v))
    acceleration = add3(get3(bends.acceleration[k]), get3(leaf.a))
    angular = add3(get_angular(turns.rate[k]), add3(cross(w, inner), spinning))
    w = add3(w, inner)
    put3(bends.p[k], u)
    put3(bends.rate[k], rate)
    put3(bends.acceleration[k], acceleration)
    put3(turns.twist[k], rate)
    put_angular(turns.twist[k], w)
    put3(turns.rate[k], axpy3(acceleration, -1.0, cross(w, rate)))
    put_angular(turns.rate[k], angular)
    return u, product(T, get9(leaf.R))


@compile_inline
def _add_slopes(bends, turns, at, row, k, b, T, spins):
    """Add the derivatives of the leaf's motion by four modes to those beyond the chain."""
    w, inner, spinning = spins
    put_rows3(bends.dp[k], 0, b, add3(rows3(bends.dp[k], 0, b), rows3(at.J[row], 0, b)))
    put_rows3(bends.rate_q[k], 0, b, add3(rows3(bends.rate_q[k], 0, b), rows3(at.rates[row], 0, b)))
    acceleration_q = add3(rows3(bends.acceleration_q[k], 0, b), rows3(at.rates[row], 6, b))
    put_rows3(bends.acceleration_q[k], 0, b, acceleration_q)
    turn = rows3(turns.spin_q[k], 0, b)
    w_q = rows3(turns.w_q[k], 0, b)
    wd_q = rows3(turns.wd_q[k], 0, b)
    inner_q = add3(cross(turn, inner), times(T, rows3(at.rates[row], 3, b)))
    wd_q = add3(wd_q, add3(cross(w_q, inner), cross(w, inner_q)))
    wd_q = add3(wd_q, add3(cross(turn, spinning), times(T, rows3(at.rates[row], 9, b))))
    turn, w_q = add3(turn, times(T, rows3(at.J[row], 3, b))), add3(w_q, inner_q)
    put_rows3(turns.spin_q[k], 0, b, turn)
    put_rows3(turns.w_q[k], 0, b, w_q)
    put_rows3(turns.wd_q[k], 0, b, wd_q)
    put_rows3(turns.wd_qd[k], 0, b, axpy3(cross(add3(w, inner), turn), 2.0, w_q))


@compile_kernel
def add_end_curvature(model, modes, link, row, k, force, torque, out):
    """Add to ``out (n, n)`` what the chain and the displacement beyond it add to the curvature of an interface."""
    bends, turns, at = modes.bends, modes.turns, modes.stations
    own, leaf = model.links[link], leaf_row(modes, k)
    n, strain = own.modes, model.modal.parts.strain[row]
    B, none = model.modal.integrals.B[own.kind], model.modal.integrals.p0[own.kind]  # both zero
    add_bend_curvature(bends, k, B, model.modal.Kg_FT[row], -1.0, none, 3, force, n, out)
    stretch = dot3(force, get3(bends.along[k]))
    T, _ = cayley(half_tangent(get3(turns.v[k])))
    add_chain_curvature(model, at, link, row, leaf, force, transposed_times(T, torque), n, out)
    for b in range(0, n, WIDTH):
        beyond = spin(turns.factors[k], 0, get3(turns.v[k]), rows3(turns.v_q[k], 0, b))
        back = transposed_times(T, cross(torque, beyond))
        for a in range(n):
            x = dot3(column3(at.J[leaf, 3:], a), back) + stretch * get_lanes(strain[a], b)
            put_lanes(out[a], b, get_lanes(out[a], b) + x)


@compile_inline
def column3(x, a):
    """Return three numbers of mode a."""
    return x[0, a], x[1, a], x[2, a]
