"""What the wrenches of stations do on the modes, brought from the ends to the root, and its derivatives.

With F and T of all that a frame carries, about its centre and in the axes of its parent, its modes feel ``W' F`` along
rho and ``(d W rho / d th)' F + W' T`` along th. Derivatives by four modes: y of th, r of rho.
"""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.compiler.lanes import WIDTH, get_lanes, put_lanes
from modalprep.multibody.kernels.algebra.matrices import transposed_times
from modalprep.multibody.kernels.algebra.rows import mode6, put_rows3, rows3
from modalprep.multibody.kernels.algebra.tuples import (
    add3,
    axpy3,
    combined,
    cross,
    dot3,
    get3,
    get9,
    put3,
    put_angular,
    scaled3,
    sub3,
    take3,
)
from modalprep.multibody.kernels.tangents.spins import B, C, back_slope, spin, spin_slope, spin_transposed


@compile_kernel
def bring_back(model, own, at, i):
    """Add the derivatives of the forces on the modes of link i's body, and of the wrench on its frame."""
    parts, link = model.modal.parts, model.links[i]
    s = link.slot
    n = link.modes
    first = parts.first[link.kind]
    last = len(at.steps) - 1
    for b in range(0, n, WIDTH):
        for c in range(0, 12, 3):
            put_rows3(at.forces[last], c, b, scaled3(0.0, rows3(at.J[last], 0, b)))
    for p in range(parts.number[link.kind] - 1, -1, -1):
        row = link.stations + p
        _on_modes(own, at, row, s, n, parts.moved[first + p])
        _to_parent(at, row, n)
    for b in range(0, n, WIDTH):
        for c in range(0, 6, 3):
            put_rows3(own.by_q[s], c, b, add3(rows3(own.by_q[s], c, b), rows3(at.forces[last], c, b)))
            put_rows3(own.by_qd[s], c, b, add3(rows3(own.by_qd[s], c, b), rows3(at.forces[last], 6 + c, b)))
    force = own.force[s]
    put3(force, add3(get3(force), get3(at.steps[last].force)))
    put_angular(force, add3(take3(force, 3), get3(at.steps[last].torque)))
    put3(at.steps[last].force, (0.0, 0.0, 0.0))
    put3(at.steps[last].torque, (0.0, 0.0, 0.0))


@compile_inline
def _on_modes(own, at, row, s, n, moved):
    """Add the rows of the modes that a frame's twist has."""
    step = at.steps[row]
    F, T = get3(step.force), get3(step.torque)
    for b in range(0, n, WIDTH):
        push, twist = rows3(at.forces[row], 0, b), rows3(at.forces[row], 3, b)
        along, turning = back_slopes(at, row, b, moved, (F, T), (push, twist))
        pull, slide = _back(at, row, rows3(at.forces[row], 6, b), rows3(at.forces[row], 9, b))
        for a in range(n):
            x = mode6(moved, a)
            by_q = dot3(x[:3], along) + dot3(x[3:], turning)
            by_qd = dot3(x[:3], pull) + dot3(x[3:], slide)
            put_lanes(own.by_q[s, 6 + a], b, get_lanes(own.by_q[s, 6 + a], b) + by_q)
            put_lanes(own.by_qd[s, 6 + a], b, get_lanes(own.by_qd[s, 6 + a], b) + by_qd)


@compile_inline
def back_slopes(at, row, b, moved, wrench, changes):
    """Return the derivatives by four modes of the forces along rho and th of a frame, axes of the link given."""
    step = at.steps[row]
    R, turn = get9(at.steps[step.parent].R), rows3(at.J[step.parent], 3, b)
    v, rho, f = get3(step.th), get3(step.rho), step.factors
    r, y = rows3(moved, 0, b), rows3(moved, 3, b)
    F, T = transposed_times(R, wrench[0]), transposed_times(R, wrench[1])
    push = add3(changes[0], cross(wrench[0], turn))
    twist = add3(changes[1], cross(wrench[1], turn))
    along, turning = _back(at, row, push, twist)
    along = add3(along, back_slope(f, v, F, y))
    turning = add3(turning, add3(back_slope(f, v, T, y), _arm_curve(f, v, rho, F, r, y)))
    return along, turning


@compile_inline
def _back(at, row, push, twist):
    """Return the forces along rho and th of wrenches on a frame, axes of the link."""
    step = at.steps[row]
    R = get9(at.steps[step.parent].R)
    v, rho, f = get3(step.th), get3(step.rho), step.factors
    F, T = transposed_times(R, push), transposed_times(R, twist)
    turning = axpy3(scaled3(2.0 * dot3(F, spin(f, 1, v, rho)), v), f[B] * dot3(v, F), rho)
    turning = add3(turning, combined(f[B] * dot3(v, rho), F, f[C], cross(rho, F)))
    return spin_transposed(f, 0, v, F), add3(turning, spin_transposed(f, 0, v, T))


@compile_inline
def _arm_curve(f, v, rho, F, r, y):
    """Return the derivative of ``(d W rho / d th)' F`` at a constant F."""
    first = dot3(F, spin(f, 1, v, rho))
    second = dot3(add3(spin(f, 1, v, r), spin_slope(f, 1, v, rho, y)), F)
    along, through, n = dot3(v, F), dot3(v, rho), dot3(v, y)
    found = add3(scaled3(2.0 * second, v), scaled3(2.0 * first, y))
    found = add3(found, scaled3(2.0 * f[B + 1] * n, combined(along, rho, through, F)))
    found = add3(found, scaled3(f[B] * dot3(y, F), rho))
    found = axpy3(found, f[B] * along, r)
    found = add3(found, scaled3(f[B] * (dot3(y, rho) + dot3(v, r)), F))
    found = add3(found, scaled3(2.0 * f[C + 1] * n, cross(rho, F)))
    return add3(found, scaled3(f[C], cross(r, F)))


@compile_inline
def _to_parent(at, row, n):
    """Add the wrench of a frame and its derivatives to those of its parent."""
    step = at.steps[row]
    base = at.steps[step.parent]
    F, arm = get3(step.force), sub3(get3(step.r), get3(base.r))
    put3(base.force, add3(get3(base.force), F))
    put3(base.torque, add3(get3(base.torque), add3(get3(step.torque), cross(arm, F))))
    for b in range(0, n, WIDTH):
        own, to = at.forces[row], at.forces[step.parent]
        longer = sub3(rows3(at.J[row], 0, b), rows3(at.J[step.parent], 0, b))
        for c in range(0, 12, 6):
            push = rows3(own, c, b)
            twist = add3(rows3(own, c + 3, b), cross(arm, push))
            if c == 0:
                twist = add3(twist, cross(longer, F))
            put_rows3(to, c, b, add3(rows3(to, c, b), push))
            put_rows3(to, c + 3, b, add3(rows3(to, c + 3, b), twist))


@compile_inline
def add_chain_curvature(model, at, link, row, leaf, force, torque, n, out):
    """Add the derivative by q of what a force and a torque on an interface do along its chain, both constant.

    ``leaf`` is the row of its frame, ``row`` that of its constants.
    """
    parts = model.modal.parts
    first = parts.first[model.links[link].kind] - model.links[link].stations
    last, T, p = len(at.steps) - 1, torque, leaf
    while p != last:
        moved = parts.leaf_moved[row] if p == leaf else parts.moved[first + p]
        for b in range(0, n, WIDTH):
            longer = sub3(rows3(at.J[leaf], 0, b), rows3(at.J[p], 0, b))
            push = scaled3(0.0, longer)
            along, turning = back_slopes(at, p, b, moved, (force, T), (push, cross(longer, force)))
            for a in range(n):
                x = mode6(moved, a)
                more = dot3(x[:3], along) + dot3(x[3:], turning)
                put_lanes(out[a], b, get_lanes(out[a], b) + more)
        a = at.steps[p].parent
        T = add3(T, cross(sub3(get3(at.steps[p].r), get3(at.steps[a].r)), force))
        p = a
