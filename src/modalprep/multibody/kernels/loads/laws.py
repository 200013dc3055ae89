"""Force laws of the kernel: hinge elements, springs, bushings. Numbers in, numbers out."""

from __future__ import annotations

import numpy as np

from modalprep.jit import compile_kernel
from modalprep.multibody.kernels.spatial import (
    ZERO3,
    add3,
    axpy3,
    cross,
    dot3,
    product,
    product_transposed,
    row3,
    times,
    transposed_times,
)

# columns of a hinge's constants
STIFFNESS, REST, DAMPING, FRICTION, SLIDING, LOWER, UPPER, STOP, STOP_DAMPING, HINGE = range(10)
# columns of a bushing's constants: stiffness (6), damping (6), position and rotation of the second end at rest
REST_POSITION, REST_ROTATION, GROUND, GROUND_ROTATION, BUSHING = 12, 15, 24, 27, 36
# columns of a rod in water: start, axis, length, drag across and along, added and displaced mass, surface, direction up
ROD_START, ROD_AXIS, ROD_LENGTH, ACROSS, ALONG, ADDED, DISPLACED, SURFACE, UP, ROD = 0, 3, 6, 7, 8, 9, 10, 11, 12, 15
STRIPS = (
    (0.04691007703066802, 0.11846344252809454),
    (0.23076534494715845, 0.23931433524968324),
    (0.5, 64.0 / 225.0),
    (0.76923465505284155, 0.23931433524968324),
    (0.95308992296933193, 0.11846344252809454),
)  # Gauss
SMALL = 1e-2  # rad: below, the series of the rotation vector is exact to round-off
NO_AXIS = 1e-8


@compile_kernel
def hinge_law(c, i, x, u, drive):
    """Force of one hinge at coordinate x and speed u, with row i of the constants `c`.

    Spring ``-k (x - rest)``, damper ``-d u``, Coulomb friction ``-f tanh(u / sliding)``, limits as one-sided springs
    with ``k p max(0, 1 + a p')`` at penetration p (Hunt and Crossley 1975, exponent 1), and the drive.

    Returns
    -------
    tau : N or N m
    power : W, of all but the springs
    stored : J, in the springs
    slope_x, slope_u : derivatives of tau
    """
    stretch = x - c[i, REST]
    tau = -c[i, STIFFNESS] * stretch
    stored = 0.5 * c[i, STIFFNESS] * stretch * stretch
    slip = np.tanh(u / c[i, SLIDING])
    other = drive - c[i, DAMPING] * u - c[i, FRICTION] * slip
    slope_x = -c[i, STIFFNESS]
    slope_u = -c[i, DAMPING] - c[i, FRICTION] * (1.0 - slip * slip) / c[i, SLIDING]
    above, below = x - c[i, UPPER], c[i, LOWER] - x
    if above > 0.0 or below > 0.0:
        side = 1.0 if above > 0.0 else -1.0
        p, k = above if above > 0.0 else below, c[i, STOP]
        factor = 1.0 + c[i, STOP_DAMPING] * side * u
        tau -= side * k * p
        stored += 0.5 * k * p * p
        if factor > 0.0:
            other -= side * k * p * (factor - 1.0)
            slope_x -= k * factor
            slope_u -= k * p * c[i, STOP_DAMPING]
        else:
            other += side * k * p
    return tau + other, other * u, stored, slope_x, slope_u


@compile_kernel
def spring_law(c, i, pull, slack, a, b, va, vb):
    """Axial spring between points a and b with velocities va, vb, inertial: stiffness, damping, length in row i of `c`.

    With `slack` it pulls or does nothing: no force below its length, and none of a damper that would push.
    Returns the force on a (b feels the opposite), length, tension, power of damping and `pull` (N), energy stored.
    """
    d = (b[0] - a[0], b[1] - a[1], b[2] - a[2])
    long = np.sqrt(dot3(d, d))
    g = 1.0 / long if long > 0.0 else 0.0
    rate = g * dot3(d, (vb[0] - va[0], vb[1] - va[1], vb[2] - va[2]))
    stretch = long - c[i, 2]
    elastic, other = c[i, 0] * stretch, c[i, 1] * rate + pull
    if slack:
        if stretch < 0.0:
            return ZERO3, long, 0.0, 0.0, 0.0
        other = max(other, -elastic)
    f = g * (elastic + other)
    return (f * d[0], f * d[1], f * d[2]), long, elastic + other, -other * rate, 0.5 * elastic * stretch


@compile_kernel
def rotation_vector(Q):
    """Rotation vector of a rotation below 180 degrees, and c of ``1 + x~ / 2 + c x~ x~``, which takes moments to it."""
    a = (0.5 * (Q[7] - Q[5]), 0.5 * (Q[2] - Q[6]), 0.5 * (Q[3] - Q[1]))
    s, c = np.sqrt(dot3(a, a)), 0.5 * (Q[0] + Q[4] + Q[8] - 1.0)
    angle = np.arctan2(s, c)
    f = angle / s if s > NO_AXIS else 1.0
    if angle < SMALL:
        g = 1.0 / 12.0 + angle * angle / 720.0 + angle * angle * angle * angle / 30240.0
    else:
        g = 1.0 / (angle * angle) - (1.0 + c) / (2.0 * angle * s)
    return (f * a[0], f * a[1], f * a[2]), g


@compile_kernel
def bushing_law(c, i, first, second):
    """Six springs and dampers in the axes of the first of two frames (position, rotation, velocity, spin; inertial).

    Displacement ``d = R1' (p2 - p1) - rest``, rotation vector x of ``R1' R2 rest'``; potential
    ``d K d / 2 + x K x / 2``, dampers on ``d'`` and the relative angular velocity; all in the first frame's axes.

    Returns
    -------
    force, torque : on the second frame, at its origin, inertial axes
    torque on the first frame; the force on it is opposite
    power of the dampers, energy stored
    """
    pa, Ra, va, wa = first
    pb, Rb, vb, wb = second
    r = transposed_times(Ra, (pb[0] - pa[0], pb[1] - pa[1], pb[2] - pa[2]))
    v = transposed_times(Ra, (vb[0] - va[0], vb[1] - va[1], vb[2] - va[2]))
    v = axpy3(v, -1.0, cross(transposed_times(Ra, wa), r))
    w = transposed_times(Ra, (wb[0] - wa[0], wb[1] - wa[1], wb[2] - wa[2]))
    d = (r[0] - c[i, REST_POSITION], r[1] - c[i, REST_POSITION + 1], r[2] - c[i, REST_POSITION + 2])
    turn = product((Ra[0], Ra[3], Ra[6], Ra[1], Ra[4], Ra[7], Ra[2], Ra[5], Ra[8]), Rb)
    k = REST_ROTATION
    rest = (
        c[i, k], c[i, k + 1], c[i, k + 2], c[i, k + 3], c[i, k + 4], c[i, k + 5], c[i, k + 6], c[i, k + 7], c[i, k + 8],
    )  # fmt: skip
    x, g = rotation_vector(product_transposed(turn, rest))
    spring = (-c[i, 0] * d[0], -c[i, 1] * d[1], -c[i, 2] * d[2])
    damper = (-c[i, 6] * v[0], -c[i, 7] * v[1], -c[i, 8] * v[2])
    moment = (-c[i, 3] * x[0], -c[i, 4] * x[1], -c[i, 5] * x[2])
    brake = (-c[i, 9] * w[0], -c[i, 10] * w[1], -c[i, 11] * w[2])
    stored = -0.5 * (dot3(spring, d) + dot3(moment, x))
    power = dot3(damper, v) + dot3(brake, w)
    xm = cross(x, moment)
    moment = add3(add3(moment, brake), axpy3((0.5 * xm[0], 0.5 * xm[1], 0.5 * xm[2]), g, cross(x, xm)))
    f = add3(spring, damper)
    back = add3(moment, cross(r, f))
    back = (-back[0], -back[1], -back[2])
    return times(Ra, f), times(Ra, moment), times(Ra, back), power, stored


@compile_kernel
def rod_law(c, i, profile, first, count, base, p, v, w, g):
    """Rod i in water, axes of the link: drag, buoyancy, and the reaction of the water that it moves across.

    Link of rotation `base`, origin p and velocity v (inertial), angular velocity w, gravity g (inertial); the current
    is that of rows `first` to ``first + count`` of ``profile (rows, 4)``, depth and velocity. The reaction of a strip
    is ``-m P a``, P across the rod, a its acceleration; what the accelerations of the link give of it, gravity taken
    off, is left to the inertia `hydrodynamics.added_inertia`.

    Returns
    -------
    force, torque : on the link, at its origin
    power of the drag, and of the water where the rod's turn changes what is across
    kinetic energy of the water, ``m v P v / 2``
    potential of the buoyancy
    """
    start, axis, up = row3(c, i, ROD_START), row3(c, i, ROD_AXIS), row3(c, i, UP)
    added, displaced = c[i, ADDED], c[i, DISPLACED]
    own, turn = transposed_times(base, v), cross(w, axis)
    weight = transposed_times(base, g)
    force, torque, power, stored, potential = ZERO3, ZERO3, 0.0, 0.0, 0.0
    for k in range(len(STRIPS)):
        x, part = STRIPS[k]
        ds = part * c[i, ROD_LENGTH]
        r = axpy3(start, x * c[i, ROD_LENGTH], axis)
        wr = cross(w, r)
        moves = add3(own, wr)
        place = add3(p, times(base, r))
        current = _current(profile, first, count, c[i, SURFACE] - dot3(up, place))
        slip = axpy3(moves, -1.0, transposed_times(base, current))
        ahead = dot3(axis, slip)
        across = axpy3(slip, -ahead, axis)
        a, b = -c[i, ACROSS] * np.sqrt(dot3(across, across)), -c[i, ALONG] * abs(ahead) * ahead
        drag = axpy3((a * across[0], a * across[1], a * across[2]), b, axis)
        swing = add3(cross(w, wr), weight)
        swing = axpy3(swing, -dot3(axis, swing), axis)
        f = axpy3(axpy3(drag, -added, swing), -displaced, weight)
        force, torque = axpy3(force, ds, f), axpy3(torque, ds, cross(r, f))
        along = dot3(axis, moves)
        power += ds * (dot3(drag, moves) - added * dot3(turn, moves) * along)
        stored += 0.5 * ds * added * (dot3(moves, moves) - along * along)
        potential += ds * displaced * dot3(g, place)
    return force, torque, power, stored, potential


@compile_kernel
def _current(profile, first, count, depth):
    """Velocity of the water at a depth, inertial axes."""
    last = first + count - 1
    if depth <= profile[first, 0]:
        return row3(profile, first, 1)
    if depth >= profile[last, 0]:
        return row3(profile, last, 1)
    k = first
    while depth > profile[k + 1, 0]:
        k += 1
    part = (depth - profile[k, 0]) / (profile[k + 1, 0] - profile[k, 0])
    below = row3(profile, k, 1)
    return axpy3(below, part, axpy3(row3(profile, k + 1, 1), -1.0, below))
