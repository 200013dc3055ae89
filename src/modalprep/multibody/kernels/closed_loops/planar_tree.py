"""Recursions of a system that moves in one plane: theory 4 and 5 with the rows of planar.py.

An articulated inertia is six numbers of 21: masses M (xx, xy, yy) in the plane, the force h = (x, y) of a unit angular
acceleration, and the inertia J about the normal z. An eliminated hinge leaves no torque about itself, so that only a
mass and a force in the plane reach the parent. Inertias and bias forces in the data stay those of the bodies;
`complete_bias_forces` makes those in space of them, for what joints carry.

Arguments as in articulated_body.py and constraints.py.
"""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline
from modalprep.compiler.lanes import WIDTH, add_lanes, four, get_lanes, put_lanes
from modalprep.multibody.kernels.algebra.tuples import dot3, get3, put6, unsigned
from modalprep.multibody.kernels.closed_loops.factor import solve_multipliers
from modalprep.multibody.kernels.closed_loops.planar import TORQUE, planar_residual, put_planar
from modalprep.multibody.kernels.closed_loops.products import add_coupling, add_outer_product

HINGE = 8  # in `pivot`: the hinge's acceleration without that of its parent, before multipliers


@compile_inline
def planar_accelerations(cons, model, data, t, work, tau, udot):
    """Write the accelerations ``udot (nu,)`` of a system in its plane, after `outward_in_world`.

    Returns the link whose pivot is not positive, else -1. Leaves the multipliers in `work`, and accelerations in the
    data.
    """
    planar_residual(cons, model, data, t, work)
    status = _inward(model, data, work, tau)
    if status < 0:
        solve_multipliers(work)
        _forward(model, data, work, udot)
    return status


@compile_inline
def _normal_acceleration(model, data):
    """Return the acceleration of the ground along the normal."""
    base = data.links[unsigned(0)].orientation
    ground = data.links[unsigned(len(model.links))].acceleration
    return base[2] * ground[0] + base[5] * ground[1] + base[8] * ground[2]


@compile_inline
def _inward(model, data, work, tau):
    """Do as `inward_with_rows` in the plane; returns the link whose pivot is not positive, else -1."""
    normal = _normal_acceleration(model, data)
    p = 0
    for i in range(len(model.links) - 1, -1, -1):
        M, h, J, force, t = _articulated(model.links[unsigned(i)], data.links[unsigned(i)], normal)
        if not J > 0.0:
            return i
        g = 1.0 / J
        e = tau[unsigned(model.links[unsigned(i)].u)] - t
        while p < len(work.entries) and work.paths.entries[unsigned(p)].link == i:
            _eliminate_from_row(model, data, work, p, g, h, e)
            p += 1
        _eliminate(model, data, i, g, e, M, h, force, tau)
    return -1


@compile_inline
def _articulated(link, own, normal):
    """Return inertia and bias force of a link in the plane, with those of its children."""
    a, b, c, x, y, J = own.M[0], own.M[1], own.M[3], own.H[2], own.H[5], own.J[5]
    fx = own.force[0] - own.wrench[0] + normal * own.M[2]
    fy = own.force[1] - own.wrench[1] + normal * own.M[4]
    t = own.force[5] - own.wrench[5] + normal * own.H[8]
    if link.last_child >= 0:
        children = own.children
        a = a + children[0]
        b = b + children[1]
        c = c + children[2]
        x = x + children[3]
        y = y + children[4]
        J = J + children[5]
        fx, fy, t = fx + children[6], fy + children[7], t + children[8]
    return (a, b, c), (x, y), J, (fx, fy), t


@compile_inline
def _eliminate_from_row(model, data, work, p, g, h, torque):
    """Eliminate a hinge from the forces of entry p, and add the rest to the parent's.

    g is the inverse of the inertia about the hinge, h the force of a unit acceleration about it.
    """
    entry, mine = work.paths.entries[unsigned(p)], work.entries[unsigned(p)]
    own = data.links[unsigned(entry.link)]
    total = work.bundles[unsigned(entry.bundle)].free
    turn, bias = own.rotation, own.bias
    e = get_lanes(mine.force, TORQUE)
    v = g * e
    put_lanes(mine.joint_force, 0, e)
    x, y = get_lanes(mine.force, 0) - h[0] * v, get_lanes(mine.force, 4) - h[1] * v
    free = get_lanes(total, 0) + torque * v + bias[0] * x + bias[1] * y
    fx, fy = turn[0] * x + turn[1] * y, turn[3] * x + turn[4] * y
    if entry.parent < 0:
        fz = turn[6] * x + turn[7] * y  # the ground's z need not be the normal
        free = free + dot3((fx, fy, fz), get3(data.links[unsigned(len(model.links))].acceleration))
    else:
        put_planar(
            work.entries[unsigned(entry.parent)].force, entry.accumulates, fx, fy, own.arm[0] * fy - own.arm[1] * fx
        )
    put_lanes(total, 0, free)
    add_outer_product(work.bundles[unsigned(entry.bundle)].S, entry.count, mine.joint_force, v)
    if p > entry.begin:
        add_coupling(work, p, g)


@compile_inline
def _eliminate(model, data, i, g, e, M, h, force, tau):
    """Eliminate the hinge of link i, of inverse inertia g under a torque e, and add the rest to the parent."""
    link, own = model.links[unsigned(i)], data.links[unsigned(i)]
    turn = own.rotation
    bx = own.bias[0]
    by = own.bias[1]
    free = g * (e - (h[0] * bx + h[1] * by))
    own.pivot[0] = g
    own.pivot[7] = g * (h[0] * bx + h[1] * by)
    own.pivot[unsigned(HINGE)] = free
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
    # each sum apart from the hinge's product, so that it need not wait for g
    rx, ry = own.arm[0], own.arm[1]
    k, mx, my = rx * y - ry * x, b * rx - a * ry, c * rx - b * ry
    J = my * rx - mx * ry
    t = tau[unsigned(link.u)] + rx * fy - ry * fx
    gx, gy, gk = g * x, g * y, g * k
    children = data.links[unsigned(link.parent)].children
    first = model.links[unsigned(link.parent)].last_child == i
    _add(children, first, 0, a - gx * x)
    _add(children, first, 1, b - gx * y)
    _add(children, first, 2, c - gy * y)
    _add(children, first, 3, mx - gx * k)
    _add(children, first, 4, my - gy * k)
    _add(children, first, 5, J - gk * k)
    _add(children, first, 6, fx + x * free)
    _add(children, first, 7, fy + y * free)
    _add(children, first, 8, t + k * free)


@compile_inline
def _add(children, first, c, value):
    """Write a number to the sums of a link's children, or add it where the child is not the `first`."""
    children[unsigned(c)] = value if first else children[unsigned(c)] + value


@compile_inline
def _forward(model, data, work, udot):
    """Write the accelerations of links and hinges with the multipliers, root to tips."""
    normal = _normal_acceleration(model, data)
    ground = len(model.links)
    p = len(work.entries) - 1
    for i in range(ground):
        link = model.links[unsigned(i)]
        own = data.links[unsigned(i)]
        constraint_torque = four(0.0)
        while p >= 0 and work.paths.entries[unsigned(p)].link == i:
            multiplier = get_lanes(work.solution, WIDTH * work.paths.entries[unsigned(p)].bundle)
            constraint_torque = constraint_torque + multiplier * get_lanes(work.entries[unsigned(p)].joint_force, 0)
            p -= 1
        free = own.pivot[unsigned(HINGE)] + own.pivot[0] * add_lanes(constraint_torque)
        turn = own.rotation
        parent = data.links[unsigned(link.parent)]
        v = parent.acceleration
        spin = parent.acceleration[5]
        if link.parent == ground:
            x = turn[0] * v[0] + turn[3] * v[1] + turn[6] * v[2]
            y = turn[1] * v[0] + turn[4] * v[1] + turn[7] * v[2]
            hinge = angular = free - dot3(get3(own.pivot[1:]), get3(v))
        else:
            ax = v[0] - spin * own.arm[1]
            ay = v[1] + spin * own.arm[0]
            x, y = turn[0] * ax + turn[3] * ay, turn[1] * ax + turn[4] * ay
            angular = free - (own.pivot[1] * ax + own.pivot[2] * ay)
            hinge = angular - spin
        udot[unsigned(link.u)] = hinge
        put6(own.acceleration, (x + own.bias[0], y + own.bias[1], normal, 0.0, 0.0, angular))
