"""What moves the rows between rigid bodies: their forces in the axes of the links that they push (theory 5.4).

The same as the rows of constraints.py between ends that their bodies do not move, and what `responses.respond` begins
with, but nothing is turned to inertial axes and back, and ends and lines of action stay what they were. Loops have no
rows ABOUT, which are those of bushings in an implicit step.

Arguments as in constraints.py; the ground is at rest.
"""

from __future__ import annotations

import numpy as np

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.compiler.lanes import four, get_lanes, get_lanes3, put_lanes, put_lanes3
from modalprep.multibody.kernels.algebra.matrices import times, transposed_times
from modalprep.multibody.kernels.algebra.tuples import ZERO3, add3, at, axpy3, cross, dot3, get3, get9, sub3
from modalprep.multibody.kernels.closed_loops.constraints import (
    ANGLE,
    COUPLER,
    DISTANCE,
    POINT,
    constraint_residual,
    couplers,
    less_values,
)
from modalprep.multibody.kernels.closed_loops.planar import hold_in_plane
from modalprep.multibody.kernels.closed_loops.products import clear, zeros
from modalprep.multibody.kernels.interfaces import free_position, ground_rate


@compile_kernel
def moving_residual(cons, model, data, y, motion, t, work):
    """Do as `constraint_residual` with the rows that something moves; between rigid bodies, only what moves them.

    Of these, ends and lines of action stay what they were, and the forces that `respond` begins with are written.
    `cons` may be None.
    """
    if cons is None:
        return
    if not work.paths.rigid or ground_rate(data) != 0.0:
        constraint_residual(cons, model, data, y, motion, t, work, True)
        return
    work.flat[0] = 1
    for b in range(len(work.bundles)):
        own = work.bundles[at(b)]
        put_lanes(own.bias, 0, zeros(work))
        put_lanes(own.free, 0, zeros(work))
        clear(work, own.S)
        for q in range(b):
            clear(work, work.between[at(b), at(q)].S)
    for k in range(work.paths.moving):
        group, own = work.paths.groups[at(k)], work.groups[at(k)]
        if work.paths.planar:
            hold_in_plane(cons, model, data, work, group, own)
        elif group.kind != COUPLER:
            _hold(cons, model, data, work, group, own)
        less_values(cons, work, group, own, t)
    couplers(cons, y, model.nx, motion, work)


@compile_inline
def _hold(cons, model, data, work, group, own):
    """Write what the rows of a group measure, and let them push their ends."""
    if group.kind == ANGLE:
        _hold_turns(data, work, group, own)
    elif group.kind == DISTANCE:
        _hold_distance(cons, model, data, work, group, own)
    elif group.grounded:
        _hold_to_ground(cons, model, data, work, group, own)
    else:
        _hold_together(cons, model, data, work, group, own)


@compile_inline
def _motion(cons, model, data, end):
    """Return the position, velocity and acceleration of an end, inertial axes, and where it is on its link.

    Its acceleration is what is left when that of its link is zero; on the ground, what gravity makes of it.
    """
    end = cons.ends[at(end)]
    if end.link < 0:
        return get3(end.position), ZERO3, get3(data.links[at(len(model.links))].acceleration), ZERO3
    link = at(end.link)
    own = data.links[link]
    r = free_position(model, link, end.interface)
    base = get9(own.orientation)
    w = get3(own.omega)
    v = cross(w, r)
    p = add3(get3(own.position), times(base, r))
    moving = add3(get3(own.velocity), times(base, v))
    return p, moving, times(base, cross(w, v)), r


@compile_inline
def _hold_to_ground(cons, model, data, work, group, own):
    """Hold points of a link along axes of the ground."""
    e = get_lanes3(group.in_a, 0)
    bundle = work.bundles[at(group.bundle)]
    place, _, ground, _ = _motion(cons, model, data, group.a)
    p, v, moved, r = _motion(cons, model, data, group.b)
    put_lanes3(own.measured, 0, (_if_point(group, dot3(e, sub3(p, place))), dot3(e, v), four(0.0)))
    put_lanes(bundle.free, 0, get_lanes(bundle.free, 0) + dot3(e, sub3(moved, ground)))
    f = transposed_times(get9(data.links[at(group.link_b)].orientation), e)
    _push(work, group.at_b, group.adds_b, f, cross(r, f))


@compile_inline
def _if_point(group, phi):
    """Return what rows of points measure; nothing is measured of sliding but its rate."""
    return phi if group.kind == POINT else four(0.0)


@compile_inline
def _hold_together(cons, model, data, work, group, own):
    """Hold points of a link or of the ground along axes of another link."""
    e = get_lanes3(group.in_a, 0)
    bundle = work.bundles[at(group.bundle)]
    a = data.links[at(group.link_a)]
    base = get9(a.orientation)
    w = get3(a.omega)
    place = free_position(model, at(group.link_a), cons.ends[at(group.a)].interface)
    p, v, moved, r = _motion(cons, model, data, group.b)
    arm = transposed_times(base, sub3(p, get3(a.position)))  # of end b from the origin of link a, its axes
    v = transposed_times(base, sub3(v, get3(a.velocity)))
    turning = cross(w, place)
    seen = sub3(v, cross(w, arm))  # from link a, which turns
    bias = _if_point(group, dot3(e, cross(sub3(add3(seen, v), turning), w)))
    put_lanes3(own.measured, 0, (_if_point(group, dot3(e, sub3(arm, place))), dot3(e, seen), bias))
    put_lanes(bundle.bias, 0, get_lanes(bundle.bias, 0) + bias)
    moved = sub3(transposed_times(base, moved), cross(w, turning))
    put_lanes(bundle.free, 0, get_lanes(bundle.free, 0) + dot3(e, moved))
    if group.link_b >= 0:
        f = transposed_times(get9(data.links[at(group.link_b)].orientation), times(base, e))
        _push(work, group.at_b, group.adds_b, f, cross(r, f))
    _push(work, group.at_a, group.adds_a, (-1.0 * e[0], -1.0 * e[1], -1.0 * e[2]), cross(e, arm))


@compile_inline
def _hold_distance(cons, model, data, work, group, own):
    """Hold the distance between two ends."""
    p, v, moved, r = _motion(cons, model, data, group.b)
    p_a, v_a, moved_a, r_a = _motion(cons, model, data, group.a)
    p = sub3(p, p_a)
    v = sub3(v, v_a)
    lane = get_lanes(group.in_a, 0)
    bundle = work.bundles[at(group.bundle)]
    length = np.sqrt(dot3(p, p))
    g = 1.0 / length if length > 0.0 else 0.0
    line = (g * p[0], g * p[1], g * p[2])
    rate = dot3(line, v)
    across = axpy3(v, -rate, line)
    bias = (g * dot3(across, across)) * lane
    put_lanes3(own.measured, 0, (length * lane, rate * lane, bias))
    put_lanes(bundle.bias, 0, get_lanes(bundle.bias, 0) + bias)
    put_lanes(bundle.free, 0, get_lanes(bundle.free, 0) + dot3(line, sub3(moved, moved_a)) * lane)
    _pull(data, work, group.link_b, group.at_b, group.adds_b, r, line, lane)
    _pull(data, work, group.link_a, group.at_a, group.adds_a, r_a, line, -1.0 * lane)


@compile_inline
def _pull(data, work, i, p, adds, arm, line, lane):
    """Let a row pull link i, at entry p, at an arm along a line; nothing is to be done for the ground."""
    if i >= 0:
        f = transposed_times(get9(data.links[at(i)].orientation), line)
        t = cross(arm, f)
        _push(work, p, adds, (f[0] * lane, f[1] * lane, f[2] * lane), (t[0] * lane, t[1] * lane, t[2] * lane))


@compile_inline
def _hold_turns(data, work, group, own):
    """Hold directions of two links, or of one and the ground: all in the axes of b."""
    wa = _turned(data, group, _spin(data, group.link_a))
    wb = _spin(data, group.link_b)
    e = _turned(data, group, get_lanes3(group.in_a, 0))
    h = get_lanes3(group.in_b, 0)
    t = cross(h, e)
    d = sub3(wb, wa)
    bias = dot3(cross(d, h), cross(e, d)) + dot3(t, cross(wb, wa))
    put_lanes3(own.measured, 0, (dot3(e, h), dot3(t, d), bias))
    total = work.bundles[at(group.bundle)].bias
    put_lanes(total, 0, get_lanes(total, 0) + bias)
    if group.link_b >= 0:
        _turn(work, group.at_b, group.adds_b, t)
        t = times(get9(data.links[at(group.link_b)].orientation), t)
    if group.link_a >= 0:
        t = transposed_times(get9(data.links[at(group.link_a)].orientation), t)
        _turn(work, group.at_a, group.adds_a, (-1.0 * t[0], -1.0 * t[1], -1.0 * t[2]))


@compile_inline
def _spin(data, i):
    """Return the angular velocity of a link, its axes; none of the ground."""
    return get3(data.links[at(i)].omega) if i >= 0 else ZERO3


@compile_inline
def _turned(data, group, v):
    """Return a vector in the axes of link b instead of those of link a; those of the ground are inertial."""
    if group.link_a >= 0:
        v = times(get9(data.links[at(group.link_a)].orientation), v)
    return transposed_times(get9(data.links[at(group.link_b)].orientation), v) if group.link_b >= 0 else v


@compile_inline
def _push(work, p, adds, f, t):
    """Write forces and torques to the forces of an entry, or add them to it if it `adds`."""
    force = work.entries[at(p)].force
    if adds:
        f = add3(get_lanes3(force, 0), f)
    put_lanes3(force, 0, f)
    _push_turns(force, adds, t)


@compile_inline
def _turn(work, p, adds, t):
    """Do as `_push` with torques alone."""
    force = work.entries[at(p)].force
    if not adds:
        put_lanes3(force, 0, (four(0.0), four(0.0), four(0.0)))
    _push_turns(force, adds, t)


@compile_inline
def _push_turns(force, adds, t):
    """Write torques to the forces of an entry, or add them to it if it `adds`."""
    if adds:
        t = add3(get_lanes3(force, 12), t)
    put_lanes3(force, 12, t)
