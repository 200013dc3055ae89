"""Constraint rows of a system that moves in one plane: all hinges parallel, all rows on points in it (theory 5.4).

The force of a unit multiplier on a link is then a force (x, y) in the plane and a torque about its normal z, in the
axes of the link: three numbers of six. The other three never come into these. Rows are those of constraints.py, without
what vanishes in the plane. Arguments as there.
"""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline
from modalprep.compiler.lanes import four, get_lanes, get_lanes3, put_lanes, put_lanes3
from modalprep.multibody.kernels.algebra.tuples import ZERO3, add3, axpy3, dot3, get3, unsigned
from modalprep.multibody.kernels.closed_loops.constraints import subtract_prescribed
from modalprep.multibody.kernels.closed_loops.products import clear_responses
from modalprep.multibody.kernels.interfaces import free_position, ground_rate

TORQUE = 20  # lanes of the torque about z in the forces of an entry


@compile_inline
def moves_in_plane(work, data):
    """Return whether the system moves in one plane, and the ground does not turn."""
    return work.paths.planar and ground_rate(data) == 0.0


@compile_inline
def planar_residual(cons, model, data, t, work):
    """Write ``phi``, ``rate``, ``bias`` of the movable rows, and the forces of their unit multipliers on the ends.

    After `outward_in_world`. Lines of action and motions of ends stay what they were.
    """
    work.in_plane[0] = 1
    clear_responses(work)
    for k in range(len(work.bundles)):
        put_lanes(work.bundles[unsigned(k)].bias, 0, four(0.0))
    for k in range(work.paths.movable):
        group, own = work.paths.groups[unsigned(k)], work.groups[unsigned(k)]
        if group.link_a < 0:
            _from_ground(cons, model, data, work, group, own)
        else:
            _from_link(cons, model, data, work, group, own)
        subtract_prescribed(cons, work, group, own, t)


@compile_inline
def _motion(cons, model, data, end):
    """Return position and velocity of an end on a link, inertial axes, and its position on the link."""
    link = unsigned(cons.ends[unsigned(end)].link)
    own = data.links[link]
    r = free_position(model, link, cons.ends[unsigned(end)].interface)
    base = own.orientation
    w = own.omega[2]
    arm = (base[0] * r[0] + base[1] * r[1], base[3] * r[0] + base[4] * r[1], base[6] * r[0] + base[7] * r[1])
    p = axpy3(add3(get3(own.position), arm), r[2], (base[2], base[5], base[8]))
    x, y = -w * r[1], w * r[0]
    v = (base[0] * x + base[1] * y, base[3] * x + base[4] * y, base[6] * x + base[7] * y)
    return p, add3(get3(own.velocity), v), r


@compile_inline
def _in_plane(data, i):
    """Return the x and the y axis of a link, inertial axes."""
    base = data.links[unsigned(i)].orientation
    return (base[0], base[3], base[6]), (base[1], base[4], base[7])


@compile_inline
def _from_ground(cons, model, data, work, group, own):
    """Write the rows of a group whose end a is on the ground."""
    e = get_lanes3(group.in_a, 0)
    free = work.bundles[unsigned(group.bundle)].free
    p, v, r = _motion(cons, model, data, group.b)
    put_lanes3(
        own.terms, 0, (dot3(e, axpy3(p, -1.0, get3(cons.ends[unsigned(group.a)].position))), dot3(e, v), four(0.0))
    )
    put_lanes(free, 0, get_lanes(free, 0) - dot3(e, get3(data.links[unsigned(len(model.links))].acceleration)))
    one, two = _in_plane(data, group.link_b)
    force = dot3(one, e), dot3(two, e)
    _force_on_end(data, work, group.link_b, free, group.entry_b, group.accumulates_b, force, (r[0], r[1]), r)


@compile_inline
def _from_link(cons, model, data, work, group, own):
    """Write the rows of a group whose end a is on a link, end b on another one or on the ground."""
    bundle = work.bundles[unsigned(group.bundle)]
    one, two = _in_plane(data, group.link_a)
    x, y = get_lanes(group.in_a, 0), get_lanes(group.in_a, 4)
    p, v, r = _motion(cons, model, data, group.a)
    if group.link_b >= 0:
        p_b, v_b, r_b = _motion(cons, model, data, group.b)
        other, _ = _in_plane(data, group.link_b)
        c, s = dot3(other, one), dot3(other, two)
        force, arm = (c * x + s * y, c * y - s * x), (r_b[0], r_b[1])
        _force_on_end(data, work, group.link_b, bundle.free, group.entry_b, group.accumulates_b, force, arm, r_b)
    else:
        p_b = get3(cons.ends[unsigned(group.b)].position)
        v_b = ZERO3
        g = get3(data.links[unsigned(len(model.links))].acceleration)
        put_lanes(bundle.free, 0, get_lanes(bundle.free, 0) + dot3(g, one) * x + dot3(g, two) * y)
    p, v = axpy3(p_b, -1.0, p), axpy3(v_b, -1.0, v)
    px, py, vx, vy = dot3(one, p), dot3(two, p), dot3(one, v), dot3(two, v)
    w = data.links[unsigned(group.link_a)].omega[2]
    rx, ry = vx + w * py, vy - w * px  # velocity of b relative to link a
    bias = (w * (ry + vy)) * x - (w * (rx + vx)) * y
    put_lanes3(own.terms, 0, (px * x + py * y, rx * x + ry * y, bias))
    put_lanes(bundle.bias, 0, get_lanes(bundle.bias, 0) + bias)
    force, arm = (-1.0 * x, -1.0 * y), (r[0] + px, r[1] + py)
    _force_on_end(data, work, group.link_a, bundle.free, group.entry_a, group.accumulates_a, force, arm, r)


@compile_inline
def _force_on_end(data, work, link, free, p, accumulates, force, arm, r):
    """Write forces on a link, at an arm from its origin, to entry p; the centripetal acceleration of its end at r."""
    x, y = force
    w = data.links[unsigned(link)].omega[2]
    put_lanes(free, 0, get_lanes(free, 0) - ((w * w * r[0]) * x + (w * w * r[1]) * y))
    put_planar(work.entries[unsigned(p)].force, accumulates, x, y, arm[0] * y - arm[1] * x)


@compile_inline
def put_planar(force, accumulates, x, y, t):
    """Write a force in the plane and a torque to the forces of an entry, or add them if it `accumulates`."""
    if accumulates:
        x = get_lanes(force, 0) + x
        y = get_lanes(force, 4) + y
        t = get_lanes(force, TORQUE) + t
    put_lanes(force, 0, x)
    put_lanes(force, 4, y)
    put_lanes(force, TORQUE, t)
