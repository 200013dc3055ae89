"""Planar loops, whose hinges are parallel from the ground on and whose rows hold points in their plane: theory 5.4.

What unit multipliers do to such hinges is a force in the plane and a torque about its normal: three numbers of six.
The other three, which the recursion never turns into these, count for what joints carry alone. The rows are those of
constraints.py, and the recursion is that of responses.py, without what vanishes in them.

Arguments as in constraints.py. Numbers (x, y) are in the plane, in the axes of a link.
"""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline
from modalprep.compiler.lanes import four, get_lanes, get_lanes3, put_lanes, put_lanes3
from modalprep.multibody.kernels.algebra.tuples import ZERO3, add3, at, axpy3, dot3, get3
from modalprep.multibody.kernels.closed_loops.products import add_other_products, add_products
from modalprep.multibody.kernels.interfaces import free_position

ABOUT_NORMAL = 20  # of the torque about z in the forces of an entry


@compile_inline
def hold_in_plane(cons, model, data, work, group, own):
    """Write what the rows of a group measure, and let them push their ends."""
    if group.grounded:
        _hold_to_ground(cons, model, data, work, group, own)
    else:
        _hold_together(cons, model, data, work, group, own)


@compile_inline
def _motion(cons, model, data, end):
    """Return the position and the velocity of an end, and where it is on its link."""
    link = at(cons.ends[at(end)].link)
    own = data.links[link]
    r = free_position(model, link, cons.ends[at(end)].interface)
    base = own.orientation
    w = own.omega[2]
    turned = (base[0] * r[0] + base[1] * r[1], base[3] * r[0] + base[4] * r[1], base[6] * r[0] + base[7] * r[1])
    p = axpy3(add3(get3(own.position), turned), r[2], (base[2], base[5], base[8]))
    x, y = -w * r[1], w * r[0]
    v = (base[0] * x + base[1] * y, base[3] * x + base[4] * y, base[6] * x + base[7] * y)
    return p, add3(get3(own.velocity), v), r


@compile_inline
def _hold_to_ground(cons, model, data, work, group, own):
    """Write what rows between the ground and an end of a link measure, and let them push it."""
    e = get_lanes3(group.in_a, 0)
    bundle = work.bundles[at(group.bundle)]
    base = data.links[at(group.link_b)].orientation
    p, v, r = _motion(cons, model, data, group.b)
    put_lanes3(own.measured, 0, (dot3(e, axpy3(p, -1.0, get3(cons.ends[at(group.a)].position))), dot3(e, v), four(0.0)))
    put_lanes(bundle.free, 0, get_lanes(bundle.free, 0) - dot3(e, get3(data.links[at(len(model.links))].acceleration)))
    x = dot3((base[0], base[3], base[6]), e)
    y = dot3((base[1], base[4], base[7]), e)
    _push(data, work, group.link_b, bundle.free, group.at_b, group.adds_b, x, y, r[0], r[1], r)


@compile_inline
def _hold_together(cons, model, data, work, group, own):
    """Do as `_hold_to_ground` with rows between an end of a link and one of another link, or of the ground."""
    bundle = work.bundles[at(group.bundle)]
    i = at(group.link_a)
    base = data.links[i].orientation
    w = data.links[i].omega[2]
    one, two = (base[0], base[3], base[6]), (base[1], base[4], base[7])
    x, y = get_lanes(group.in_a, 0), get_lanes(group.in_a, 4)
    p, v, r = _motion(cons, model, data, group.a)
    if group.link_b >= 0:
        p_b, v_b, r_b = _motion(cons, model, data, group.b)
        other = data.links[at(group.link_b)].orientation
        c = dot3((other[0], other[3], other[6]), one)
        s = dot3((other[0], other[3], other[6]), two)
        _push(
            data,
            work,
            group.link_b,
            bundle.free,
            group.at_b,
            group.adds_b,
            c * x + s * y,
            c * y - s * x,
            r_b[0],
            r_b[1],
            r_b,
        )
    else:
        p_b = get3(cons.ends[at(group.b)].position)
        v_b = ZERO3
        g = get3(data.links[at(len(model.links))].acceleration)
        put_lanes(bundle.free, 0, get_lanes(bundle.free, 0) + dot3(g, one) * x + dot3(g, two) * y)
    p, v = axpy3(p_b, -1.0, p), axpy3(v_b, -1.0, v)
    px, py, vx, vy = dot3(one, p), dot3(two, p), dot3(one, v), dot3(two, v)
    # from end a, which turns
    sx = vx + w * py
    sy = vy - w * px
    bias = (w * (sy + vy)) * x - (w * (sx + vx)) * y
    put_lanes3(own.measured, 0, (px * x + py * y, sx * x + sy * y, bias))
    put_lanes(bundle.bias, 0, get_lanes(bundle.bias, 0) + bias)
    x, y = -1.0 * x, -1.0 * y
    _push(data, work, i, bundle.free, group.at_a, group.adds_a, x, y, r[0] + px, r[1] + py, r)


@compile_inline
def _push(data, work, link, free, p, adds, x, y, arm_x, arm_y, r):
    """Let rows push a link, at entry p, at an arm; what they push moves with its end at r."""
    w = data.links[at(link)].omega[2]
    put_lanes(free, 0, get_lanes(free, 0) - ((w * w * r[0]) * x + (w * w * r[1]) * y))
    _add(work.entries[at(p)].force, adds, x, y, arm_x * y - arm_y * x)


@compile_inline
def _add(force, adds, x, y, t):
    """Write a force in the plane and a torque to the forces of an entry, or add it to them if it `adds`."""
    if adds:
        x = get_lanes(force, 0) + x
        y = get_lanes(force, 4) + y
        t = get_lanes(force, ABOUT_NORMAL) + t
    put_lanes(force, 0, x)
    put_lanes(force, 4, y)
    put_lanes(force, ABOUT_NORMAL, t)


@compile_inline
def normal_acceleration(model, data, i):
    """Return what the ground accelerates along the hinge of link i, to which those of planar loops are parallel."""
    base = data.links[at(i)].orientation
    ground = data.links[at(len(model.links))].acceleration
    return base[2] * ground[0] + base[5] * ground[1] + base[8] * ground[2]


@compile_inline
def through_planes(model, data, work, tau):
    """Let the hinges of planar loops yield to the forces of all entries, from the tips to the root.

    After an `inward` without inertias of its own for the joints. Forces along the normal, which inertia has of
    anisotropic masses alone, come to the ground as they are: what the ground accelerates along it acts on them.
    """
    if len(work.entries) == 0:
        return
    normal = normal_acceleration(model, data, work.paths.entries[0].link)
    for k in range(len(work.entries)):
        entry = work.paths.entries[at(k)]
        own = data.links[at(entry.link)]
        H = own.H
        drive = tau[at(entry.u)] - own.force[5] - normal * own.H[8]
        through_plane(model, data, work, k, own.pivot[0], H[2], H[5], drive)


@compile_inline
def through_plane(model, data, work, p, g, hx, hy, drive):
    """Let the hinge of entry p yield to its forces, and hand the rest to the parent: no torque about the hinge.

    g is the inverse of the inertia about the hinge, (hx, hy) the force of a unit acceleration about it, `drive` the
    torque that acts about it.
    """
    entry, mine = work.paths.entries[at(p)], work.entries[at(p)]
    own = data.links[at(entry.link)]
    total = work.bundles[at(entry.bundle)].free
    turn, bias = own.rotation, own.bias
    e = get_lanes(mine.force, ABOUT_NORMAL)
    v = g * e
    put_lanes(mine.drive, 0, e)
    x, y = get_lanes(mine.force, 0) - hx * v, get_lanes(mine.force, 4) - hy * v
    free = get_lanes(total, 0) + drive * v + bias[0] * x + bias[1] * y
    fx, fy = turn[0] * x + turn[1] * y, turn[3] * x + turn[4] * y
    if entry.up < 0:
        fz = turn[6] * x + turn[7] * y  # the ground's z need not be the normal
        free = free + dot3((fx, fy, fz), get3(data.links[at(len(model.links))].acceleration))
    else:
        _add(work.entries[at(entry.up)].force, entry.adds, fx, fy, own.arm[0] * fy - own.arm[1] * fx)
    put_lanes(total, 0, free)
    add_products(work.bundles[at(entry.bundle)].S, entry.count, mine.drive, v)
    if p > entry.begin:
        add_other_products(work, p, g)
