"""The recursions of a tree whose links all move in the plane of its loops (planar.py): theory 4 and 5.

Three numbers of six, and six of the 21 of an inertia: masses M (xx, xy, yy) in the plane, the force h = (x, y) of a
unit acceleration about the normal, and the inertia J about it. What a hinge hands on has no torque about itself, so
that it is a mass in the plane and a force there, beside the joint's own torque. Inertias and bias forces in the data
stay those of the bodies: `pushing.push_links` makes those in space of them, for what joints carry.

Arguments as in articulated_body.py and constraints.py.
"""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline
from modalprep.compiler.lanes import WIDTH, add_lanes, four, get_lanes
from modalprep.multibody.kernels.algebra.tuples import at, dot3, get3, put6
from modalprep.multibody.kernels.articulated_body import inward
from modalprep.multibody.kernels.closed_loops.planar import normal_acceleration, through_plane, through_planes
from modalprep.multibody.kernels.closed_loops.responses import inward_and_respond

FREE = 8  # in `pivot`: the hinge's acceleration without that of its parent, before multipliers


@compile_inline
def inward_of_closed(cons, model, data, work, tau, more, c1, c2):
    """Do as `inward`, and as `respond` where there are rows, in the plane after `moving_residual` of planar loops.

    `cons` and `work` may be None.
    """
    if cons is None:
        return inward(model, data, tau, more, c1, c2)
    if not (work.flat[0] and work.paths.planar):
        return inward_and_respond(cons, model, data, work, tau, more, c1, c2)
    if work.paths.in_plane:
        return _inward_in_plane(model, data, work, tau)
    status = inward(model, data, tau, more, c1, c2)
    if status < 0:
        through_planes(model, data, work, tau)
    return status


@compile_inline
def _inward_in_plane(model, data, work, tau):
    """Do as `inward` in the plane, and let the hinges yield to the forces of all entries."""
    normal = normal_acceleration(model, data, 0)
    p = 0
    for i in range(len(model.links) - 1, -1, -1):
        M, h, J, force, t = _own(model.links[at(i)], data.links[at(i)], normal)
        if not J > 0.0:
            return i
        g = 1.0 / J
        e = tau[at(model.links[at(i)].u)] - t
        while p < len(work.entries) and work.paths.entries[at(p)].link == i:
            through_plane(model, data, work, p, g, h[0], h[1], e)
            p += 1
        _hand_on(model, data, i, g, e, M, h, force, tau)
    return -1


@compile_inline
def _own(link, own, normal):
    """Return inertia and bias force of a link in the plane, with what its children handed to it."""
    a, b, c, x, y, J = own.M[0], own.M[1], own.M[3], own.H[2], own.H[5], own.J[5]
    fx = own.force[0] - own.wrench[0] + normal * own.M[2]
    fy = own.force[1] - own.wrench[1] + normal * own.M[4]
    t = own.force[5] - own.wrench[5] + normal * own.H[8]
    if link.last_child >= 0:
        more = own.children
        a = a + more[0]
        b = b + more[1]
        c = c + more[2]
        x = x + more[3]
        y = y + more[4]
        J = J + more[5]
        fx, fy, t = fx + more[6], fy + more[7], t + more[8]
    return (a, b, c), (x, y), J, (fx, fy), t


@compile_inline
def _hand_on(model, data, i, g, e, M, h, force, tau):
    """Eliminate the hinge of link i, of inverse inertia g under a torque e, and hand the rest to the parent."""
    link, own = model.links[at(i)], data.links[at(i)]
    turn = own.rotation
    bx = own.bias[0]
    by = own.bias[1]
    free = g * (e - (h[0] * bx + h[1] * by))
    own.pivot[0] = g
    own.pivot[7] = g * (h[0] * bx + h[1] * by)
    own.pivot[at(FREE)] = free
    x, y = turn[0] * h[0] + turn[1] * h[1], turn[3] * h[0] + turn[4] * h[1]
    if link.parent == len(model.links):
        z = turn[6] * h[0] + turn[7] * h[1]
        put6(own.pivot[1:], (g * x, g * y, g * z, turn[2], turn[5], turn[8]))
        return
    put6(own.pivot[1:], (g * x, g * y, 0.0, 0.0, 0.0, 1.0))
    fx, fy = force[0] + M[0] * bx + M[1] * by, force[1] + M[1] * bx + M[2] * by
    fx, fy = turn[0] * fx + turn[1] * fy, turn[3] * fx + turn[4] * fy
    ax, ay = turn[0] * M[0] + turn[1] * M[1], turn[0] * M[1] + turn[1] * M[2]
    bx, by = turn[3] * M[0] + turn[4] * M[1], turn[3] * M[1] + turn[4] * M[2]
    a = ax * turn[0] + ay * turn[1]
    b = ax * turn[3] + ay * turn[4]
    c = bx * turn[3] + by * turn[4]
    # each sum beside its part of the hinge, so that it need not wait for g
    rx, ry = own.arm[0], own.arm[1]
    k, mx, my = rx * y - ry * x, b * rx - a * ry, c * rx - b * ry
    J = my * rx - mx * ry
    t = tau[at(link.u)] + rx * fy - ry * fx
    gx, gy, gk = g * x, g * y, g * k
    own = data.links[at(link.parent)].children
    first = model.links[at(link.parent)].last_child == i
    _add(own, first, 0, a - gx * x)
    _add(own, first, 1, b - gx * y)
    _add(own, first, 2, c - gy * y)
    _add(own, first, 3, mx - gx * k)
    _add(own, first, 4, my - gy * k)
    _add(own, first, 5, J - gk * k)
    _add(own, first, 6, fx + x * free)
    _add(own, first, 7, fy + y * free)
    _add(own, first, 8, t + k * free)


@compile_inline
def _add(children, first, c, value):
    """Write a number to what a link is handed, or add it where the child is not the `first`."""
    children[at(c)] = value if first else children[at(c)] + value


@compile_inline
def forward_in_plane(model, data, work, udot):
    """Do as `push`, then as `forward`, after `inward_of_closed` in the plane."""
    normal = normal_acceleration(model, data, 0)
    ground = len(model.links)
    p = len(work.entries) - 1
    for i in range(ground):
        link = model.links[at(i)]
        own = data.links[at(i)]
        more = four(0.0)
        while p >= 0 and work.paths.entries[at(p)].link == i:
            multiplier = get_lanes(work.solution, WIDTH * work.paths.entries[at(p)].bundle)
            more = more + multiplier * get_lanes(work.entries[at(p)].drive, 0)
            p -= 1
        free = own.pivot[at(FREE)] + own.pivot[0] * add_lanes(more)
        turn = own.rotation
        parent = data.links[at(link.parent)]
        v = parent.acceleration
        spin = parent.acceleration[5]
        if link.parent == ground:
            x = turn[0] * v[0] + turn[3] * v[1] + turn[6] * v[2]
            y = turn[1] * v[0] + turn[4] * v[1] + turn[7] * v[2]
            found = turned = free - dot3(get3(own.pivot[1:]), get3(v))
        else:
            ax = v[0] - spin * own.arm[1]
            ay = v[1] + spin * own.arm[0]
            x, y = turn[0] * ax + turn[3] * ay, turn[1] * ax + turn[4] * ay
            turned = free - (own.pivot[1] * ax + own.pivot[2] * ay)
            found = turned - spin
        udot[at(link.u)] = found
        put6(own.acceleration, (x + own.bias[0], y + own.bias[1], normal, 0.0, 0.0, turned))
