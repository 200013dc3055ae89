"""Frames of stations and their derivatives by the modal coordinates in closed form (theory 5.8).

With the parent a of a frame, its displacement ``l = W rho`` and its relative spin ``W th'`` have the operator W of
spins.py in the axes of a; the derivatives of its motion in the axes of the link follow from those of its parent.
"""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.compiler.lanes import WIDTH
from modalprep.multibody.kernels.algebra.matrices import product, times
from modalprep.multibody.kernels.algebra.rows import dots6, put_rows3, put_rows6, rows3
from modalprep.multibody.kernels.algebra.tuples import (
    add3,
    axpy3,
    cross,
    dot3,
    get3,
    get9,
    put3,
    put9,
)
from modalprep.multibody.kernels.stations.motion import angle_functions, turn_matrix
from modalprep.multibody.kernels.tangents.spins import A, B, C, spin, spin_curve, spin_slope, spin_third


@compile_inline
def put_turn_factors(out, s):
    """Write the factors of the spin of ``exp(th~)`` for ``th.th = s``; returns a, b of `angle_functions`."""
    a, b, c, b1, c1, b2, c2, b3, c3 = angle_functions(s)
    put3(out[A:], (a, -c - s * c1, -2.0 * c1 - s * c2))
    out[A + 3] = -3.0 * c2 - s * c3
    put3(out[B:], (c, c1, c2))
    out[B + 3] = c3
    put3(out[C:], (b, b1, b2))
    out[C + 3] = b3
    return a, b


@compile_kernel
def move_stations(modal, model, work, i):
    """Write the frames of the parts of link i's body, and their derivatives."""
    parts, link = model.modal.parts, model.links[i]
    first, s = parts.first[link.kind], link.slot
    q, qd, qdd = modal.q[s], modal.qd[s], modal.qdd[s]
    for p in range(parts.number[link.kind]):
        own = parts.parts[first + p]
        a = link.stations + own.parent if own.parent >= 0 else len(work.steps) - 1
        move_step(work, a, link.stations + p, own.d, parts.moved[first + p], q, qd, qdd, link.modes)


@compile_kernel
def move_step(work, a, p, d, moved, q, qd, qdd, n):
    """Write frame p and its derivatives by those of its parent a; ``d (3,)`` and ``moved (6, N)`` are its constants."""
    x, y, z = dots6(moved, q, n), dots6(moved, qd, n), dots6(moved, qdd, n)
    rho, th = add3(get3(d), x[:3]), x[3:]
    s, v, e, g = y[:3], y[3:], z[:3], z[3:]
    own, base = work.steps[p], work.steps[a]
    own.parent = a
    put3(own.rho, rho)
    put3(own.th, th)
    sine, cosine = put_turn_factors(own.factors, dot3(th, th))
    f, R = own.factors, get9(base.R)
    arm = times(R, spin(f, 0, th, rho))
    rate = times(R, add3(spin(f, 0, th, s), spin_slope(f, 0, th, rho, v)))
    bulge = axpy3(spin(f, 0, th, e), 2.0, spin_slope(f, 0, th, s, v))
    bulge = times(R, add3(add3(bulge, spin_slope(f, 0, th, rho, g)), spin_curve(f, th, rho, v, v)))
    turning = times(R, spin(f, 0, th, v))
    spinning = times(R, add3(spin(f, 0, th, g), spin_slope(f, 0, th, v, v)))
    _put_motion(own, base, R, arm, rate, bulge, turning, spinning)
    put9(own.R, product(R, turn_matrix(sine, cosine, th)))
    for b in range(0, n, WIDTH):
        _put_slopes(work, a, p, moved, b, (rho, th, s, v, e, g), (arm, rate, bulge, turning, spinning))


@compile_inline
def _put_motion(own, base, R, arm, rate, bulge, turning, spinning):
    """Write place, velocity and acceleration of a frame."""
    w, alpha = get3(base.w), get3(base.alpha)
    across = cross(w, arm)
    put3(own.r, add3(get3(base.r), arm))
    put3(own.v, add3(add3(get3(base.v), across), rate))
    put3(own.w, add3(w, turning))
    linear = add3(add3(get3(base.a), cross(alpha, arm)), cross(w, axpy3(across, 2.0, rate)))
    put3(own.a, add3(linear, bulge))
    put3(own.alpha, add3(add3(alpha, cross(w, turning)), spinning))


@compile_inline
def _put_slopes(work, a, p, moved, b, step, turned):
    """Write the derivatives of a frame's motion by four modes."""
    arm, rate, _, turning, _ = turned
    base = work.steps[a]
    w, alpha = get3(base.w), get3(base.alpha)
    before = rows3(work.J[a], 3, b)
    w_q, alpha_q = rows3(work.rates[a], 3, b), rows3(work.rates[a], 9, b)
    arm_q, rate_q, bulge_q, turning_q, spinning_q, partial = _relative_slopes(work, a, p, moved, b, step, turned)
    across_q = add3(cross(w_q, arm), cross(w, arm_q))
    put_rows3(work.J[p], 0, b, add3(rows3(work.J[a], 0, b), arm_q))
    put_rows3(work.J[p], 3, b, add3(before, partial))
    v_q = add3(add3(rows3(work.rates[a], 0, b), across_q), rate_q)
    linear = add3(rows3(work.rates[a], 6, b), add3(cross(alpha_q, arm), cross(alpha, arm_q)))
    linear = add3(linear, cross(w_q, axpy3(cross(w, arm), 2.0, rate)))
    linear = add3(linear, cross(w, axpy3(across_q, 2.0, rate_q)))
    angular = add3(add3(alpha_q, cross(w_q, turning)), add3(cross(w, turning_q), spinning_q))
    w_q = add3(w_q, turning_q)
    linear = add3(linear, bulge_q)
    put_rows6(work.rates[p], 0, b, (v_q[0], v_q[1], v_q[2], w_q[0], w_q[1], w_q[2]))
    put_rows6(work.rates[p], 6, b, (linear[0], linear[1], linear[2], angular[0], angular[1], angular[2]))


@compile_inline
def _relative_slopes(work, a, p, moved, b, step, turned):
    """Return derivatives by four modes of displacement, its rates, spin and its rate; and the partial spin."""
    rho, th, s, v, e, g = step
    arm, rate, bulge, turning, spinning = turned
    f, R = work.steps[p].factors, get9(work.steps[a].R)
    turn = rows3(work.J[a], 3, b)
    r, y = rows3(moved, 0, b), rows3(moved, 3, b)
    arm_q = add3(spin(f, 0, th, r), spin_slope(f, 0, th, rho, y))
    rate_q = add3(spin_slope(f, 0, th, s, y), add3(spin_slope(f, 0, th, r, v), spin_curve(f, th, rho, v, y)))
    bulge_q = add3(spin_slope(f, 0, th, e, y), spin_slope(f, 0, th, r, g))
    bulge_q = add3(axpy3(bulge_q, 2.0, spin_curve(f, th, s, v, y)), spin_curve(f, th, rho, g, y))
    bulge_q = add3(bulge_q, add3(spin_curve(f, th, r, v, v), spin_third(f, th, rho, v, y)))
    spinning_q = add3(spin_slope(f, 0, th, g, y), spin_curve(f, th, v, v, y))
    return (
        add3(cross(turn, arm), times(R, arm_q)),
        add3(cross(turn, rate), times(R, rate_q)),
        add3(cross(turn, bulge), times(R, bulge_q)),
        add3(cross(turn, turning), times(R, spin_slope(f, 0, th, v, y))),
        add3(cross(turn, spinning), times(R, spinning_q)),
        times(R, spin(f, 0, th, y)),
    )
