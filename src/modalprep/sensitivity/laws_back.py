"""What the power of force elements at given velocities W of their ends changes by with the motion of the ends.

Each function adds the derivatives of ``P = f . W`` of the forces f on its two ends a, b (ENDS of force_back.py) by
their displacements and rotations to ``by_pose``, by their velocities to ``by_rate``; inertial axes.
"""

from __future__ import annotations

import numpy as np

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.multibody.elements.bushing import BENT, rotation_vector
from modalprep.multibody.elements.rotational_spring import curve, twist
from modalprep.multibody.kernels.algebra.matrices import product, product_transposed, times, transposed_times
from modalprep.multibody.kernels.algebra.rotations import rotation_quaternion
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
    scaled3,
    sub3,
)


@compile_kernel
def spring_back(c, tension, a, b):
    """Go back through an `AxialSpring` that draws its ends together by its tension."""
    apart = sub3(get3(b.position), get3(a.position))
    speed = sub3(get3(b.velocity), get3(a.velocity))
    length = np.sqrt(dot3(apart, apart))
    if length <= 0.0 or (c.tension_only and tension <= 0.0):
        return
    e = scaled3(1.0 / length, apart)
    z = sub3(get3(b.twist), get3(a.twist))
    along = dot3(e, z)
    turned, moved = axpy3(z, -along, e), axpy3(speed, -dot3(e, speed), e)
    place = axpy3(scaled3(c.stiffness * along, e), c.damping * along / length, moved)
    place = axpy3(place, tension / length, turned)
    rate = scaled3(c.damping * along, e)
    _add(a.by_pose, place)
    _add(a.by_rate, rate)
    _add(b.by_pose, scaled3(-1.0, place))
    _add(b.by_rate, scaled3(-1.0, rate))


@compile_inline
def _add(out, v):
    """Add three numbers."""
    put3(out, add3(get3(out), v))


@compile_inline
def _add_angular(out, v):
    """Add three numbers to the last three of six."""
    put_angular(out, add3(get_angular(out), v))


@compile_inline
def _seen(R, a, v):
    """Return a vector in the axes of the first frame, which are R."""
    return transposed_times(R, sub3(v, a))


@compile_kernel
def bushing_back(c, a, b):
    """Go back through a `Bushing`: in axes of its first frame ``P = F . z + M . o`` of the relative velocities z, o."""
    R = get9(a.rotation)
    r = _seen(R, get3(a.position), get3(b.position))
    V = _seen(R, get3(a.velocity), get3(b.velocity))
    w = _seen(R, get3(a.omega), get3(b.omega))
    Z = _seen(R, get3(a.twist), get3(b.twist))
    o = _seen(R, get_angular(a.twist), get_angular(b.twist))
    s = transposed_times(R, get3(a.omega))
    q = transposed_times(R, get_angular(a.twist))
    v, z = sub3(V, cross(s, r)), sub3(Z, cross(q, r))
    k, d = c.stiffness, c.damping
    x, g = _bent(c, R, get9(b.rotation))
    stretch = sub3(r, get3(c.free_position))
    F = (
        -k[0] * stretch[0] - d[0] * v[0],
        -k[1] * stretch[1] - d[1] * v[1],
        -k[2] * stretch[2] - d[2] * v[2],
    )
    m = (-k[3] * x[0], -k[4] * x[1], -k[5] * x[2])
    M = sub3(_to_rate(x, g, m, 1.0), (d[3] * w[0], d[4] * w[1], d[5] * w[2]))
    rate = (-d[0] * z[0], -d[1] * z[1], -d[2] * z[2])
    brake = (-d[3] * o[0], -d[4] * o[1], -d[5] * o[2])
    place = (-k[0] * z[0], -k[1] * z[1], -k[2] * z[2])
    place = sub3(place, add3(cross(rate, s), cross(F, q)))
    arms = cross(r, rate), cross(r, F)
    both = add3(cross(rate, V), cross(F, Z))
    both = sub3(both, add3(cross(arms[0], s), cross(arms[1], q)))
    both = add3(both, add3(cross(brake, w), cross(M, o)))
    both = add3(both, cross(place, r))
    turn = _moment_back(k, x, g, m, o)
    _add(b.by_pose, times(R, place))
    _add(a.by_pose, times(R, scaled3(-1.0, place)))
    _add_angular(b.by_pose, times(R, turn))
    _add_angular(a.by_pose, times(R, sub3(both, turn)))
    _add(b.by_rate, times(R, rate))
    _add(a.by_rate, times(R, scaled3(-1.0, rate)))
    _add_angular(b.by_rate, times(R, brake))
    _add_angular(a.by_rate, times(R, scaled3(-1.0, add3(brake, arms[0]))))


@compile_inline
def _bent(c, Ra, Rb):
    """Return `rotation_vector` of a bushing's frames."""
    turn = product((Ra[0], Ra[3], Ra[6], Ra[1], Ra[4], Ra[7], Ra[2], Ra[5], Ra[8]), Rb)
    return rotation_vector(product_transposed(turn, get9(c.free_rotation)))


@compile_inline
def _to_rate(x, g, y, sign):
    """Return ``(1 + sign x~ / 2 + g x~ x~) y``."""
    xy = cross(x, y)
    return add3(axpy3(y, 0.5 * sign, xy), scaled3(g, cross(x, xy)))


@compile_inline
def _moment_back(k, x, g, m, o):
    """Return the derivative of ``o . moment`` of the rotational springs by a rotation of the second frame.

    The moment is ``(1 + x~ / 2 + g x~ x~) m``, ``m = -k x``; x changes by the transposed matrix.
    """
    square = dot3(x, x)
    angle = np.sqrt(square)
    if angle < BENT:
        slope = 1.0 / 360.0 + square / 7560.0 + square * square / 201600.0 + square * square * square / 5987520.0
    else:
        cot = 1.0 / np.tan(0.5 * angle)
        slope = ((1.0 + cot * cot) / (4.0 * angle) + cot / (2.0 * square) - 2.0 / (square * angle)) / angle
    y, xm = _to_rate(x, g, o, -1.0), cross(x, m)
    found = (-k[3] * y[0], -k[4] * y[1], -k[5] * y[2])
    found = axpy3(found, 0.5, cross(m, o))
    found = axpy3(found, slope * dot3(cross(x, xm), o), x)
    found = axpy3(found, g, sub3(cross(xm, o), cross(m, cross(x, o))))
    return _to_rate(x, g, found, 1.0)


@compile_kernel
def rotational_back(knots, c, a, b):
    """Go back through a `RotationalSpring`: ``P = -T(angle, G . w) G . o`` of the relative spins w, o, first axes."""
    R, n = get9(a.rotation), get3(c.axis)
    turned = product((R[0], R[3], R[6], R[1], R[4], R[7], R[2], R[5], R[8]), get9(b.rotation))
    angle, direction = twist(R, get9(b.rotation), n)
    G = transposed_times(R, direction)
    if dot3(G, G) == 0.0:
        return
    w = _seen(R, get3(a.omega), get3(b.omega))
    o = _seen(R, get_angular(a.twist), get_angular(b.twist))
    _, spring, stiffness = curve(knots, c.spring[0], c.spring[1], angle - c.free_angle)
    _, damper, damping = curve(knots, c.damper[0], c.damper[1], dot3(G, w))
    torque, along = spring + damper, dot3(G, o)
    turn = scaled3(-stiffness * along, G)
    turn = axpy3(turn, -damping * along, _direction_back(turned, n, G, w))
    turn = axpy3(turn, -torque, _direction_back(turned, n, G, o))
    both = axpy3(scaled3(-damping * along, cross(G, w)), -torque, cross(G, o))
    brake = times(R, scaled3(-damping * along, G))
    _add_angular(b.by_pose, times(R, turn))
    _add_angular(a.by_pose, times(R, sub3(both, turn)))
    _add_angular(b.by_rate, brake)
    _add_angular(a.by_rate, scaled3(-1.0, brake))


@compile_inline
def _direction_back(R, n, G, y):
    """Return the derivative of ``G . y`` by a rotation of the second frame; G as `twist` has it, all in first axes."""
    e = rotation_quaternion(R)
    sign = -1.0 if e[0] < 0.0 else 1.0
    w, v = sign * e[0], (sign * e[1], sign * e[2], sign * e[3])
    s = dot3(v, n)
    by_w = dot3(add3(scaled3(2.0 * w, n), cross(v, n)), y) - 2.0 * w * dot3(G, y)
    by_v = add3(scaled3(w, cross(n, y)), scaled3(dot3(v, y) - 2.0 * s * dot3(G, y), n))
    by_v = axpy3(by_v, s, y)
    found = axpy3(add3(scaled3(w, by_v), cross(v, by_v)), -by_w, v)
    return scaled3(0.5 / (w * w + s * s), found)


@compile_kernel
def follower_back(f, t, a):
    """Go back through a force and a torque on one end, with which they turn."""
    _add_angular(a.by_pose, add3(cross(f, get3(a.twist)), cross(t, get_angular(a.twist))))
