"""What conditions of closed loops change by with the motion of their ends: theory 5.4, 5.9.

A condition has a line of action (f, ta, tb): its rate is ``f.(vb - va) + ta.wa + tb.wb``. Each function adds the
derivatives of a rate or of an acceleration, times a number, to what stands at the ends a, b (END of force_back.py), by
their displacements and rotations to ``by_pose``, by velocities to ``by_rate``, by accelerations to ``by_acceleration``;
inertial axes.
"""

from __future__ import annotations

import numpy as np

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.multibody.kernels.algebra.matrices import times
from modalprep.multibody.kernels.algebra.tuples import (
    ZERO3,
    add3,
    axpy3,
    combined,
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
from modalprep.multibody.kernels.closed_loops.constraints import ANGLE, DISTANCE


@compile_inline
def _apart(a, b):
    """Return the place of the second end against the first."""
    return sub3(get3(b.position), get3(a.position))


@compile_inline
def _directions(row, a, b):
    """Return the directions of a row in both ends."""
    return times(get9(a.rotation), get3(row.in_a)), times(get9(b.rotation), get3(row.in_b))


@compile_inline
def _add(out, size, f, t):
    """Add a number times a force and a torque."""
    put3(out, axpy3(get3(out), size, f))
    put_angular(out, axpy3(get_angular(out), size, t))


@compile_inline
def _add_both(a, b, size, f, ta, tb):
    """Add to both ends, of the first the opposite of the second's force."""
    _add(a, -size, f, scaled3(-1.0, ta))
    _add(b, size, f, tb)


@compile_kernel
def line(row, a, b):
    """Return the line of action of a row: force, torque on a, torque on b."""
    e, h = _directions(row, a, b)
    if row.kind == ANGLE:
        torque = cross(h, e)
        return ZERO3, scaled3(-1.0, torque), torque
    r = _apart(a, b)
    if row.kind == DISTANCE:
        return scaled3(1.0 / np.sqrt(dot3(r, r)), r), ZERO3, ZERO3
    return e, cross(e, r), ZERO3


@compile_kernel
def add_line(row, a, b, out_a, out_b, size):
    """Add a number times the line of action to what stands at the ends."""
    f, ta, tb = line(row, a, b)
    _add_both(out_a, out_b, size, f, ta, tb)


@compile_kernel
def rate_back(row, a, b, u_a, u_b, size):
    """Go back through a number times the rate at velocities u_a, u_b (6,) of the ends, by their poses."""
    e, h = _directions(row, a, b)
    if row.kind == ANGLE:
        d = sub3(get_angular(u_b), get_angular(u_a))
        _add_both(a.by_pose, b.by_pose, size, ZERO3, cross(e, cross(d, h)), cross(h, cross(e, d)))
        return
    r = _apart(a, b)
    z = sub3(get3(u_b), get3(u_a))
    if row.kind == DISTANCE:
        g = 1.0 / np.sqrt(dot3(r, r))
        n = scaled3(g, r)
        _add_both(a.by_pose, b.by_pose, size, scaled3(g, axpy3(z, -dot3(n, z), n)), ZERO3, ZERO3)
        return
    o = get_angular(u_a)
    _add_both(a.by_pose, b.by_pose, size, cross(o, e), cross(e, add3(z, cross(r, o))), ZERO3)


@compile_kernel
def acceleration_back(row, a, b, size):
    """Go back through a number times the acceleration of a condition, by poses, velocities and accelerations."""
    if row.kind == ANGLE:
        _angle_back(row, a, b, size)
    elif row.kind == DISTANCE:
        _distance_back(a, b, size)
    else:
        _point_back(row, a, b, size)
    add_line(row, a, b, a.by_acceleration, b.by_acceleration, size)


@compile_inline
def _centripetal(w, e):
    """Return ``w x (w x e)``."""
    return cross(w, cross(w, e))


@compile_inline
def _by_spin(w, e, h):
    """Return the derivative of ``h . w x (w x e)`` by w."""
    return axpy3(combined(dot3(w, h), e, dot3(w, e), h), -2.0 * dot3(e, h), w)


@compile_inline
def _point_back(row, a, b, size):
    """Do so of ``e . r``, e fixed to the first end: ``e . r'' + 2 (w x e) . r' + (alpha x e + w x (w x e)) . r``."""
    e, _ = _directions(row, a, b)
    r, w, alpha = _apart(a, b), get3(a.omega), get_angular(a.acceleration)
    speed = sub3(get3(b.velocity), get3(a.velocity))
    second = sub3(get3(b.acceleration), get3(a.acceleration))
    by_e = add3(axpy3(second, 2.0, cross(speed, w)), add3(cross(r, alpha), _centripetal(w, r)))
    by_place = add3(cross(alpha, e), _centripetal(w, e))
    _add_both(a.by_pose, b.by_pose, size, by_place, cross(e, by_e), ZERO3)
    by_w = axpy3(_by_spin(w, e, r), 2.0, cross(e, speed))
    _add_both(a.by_rate, b.by_rate, size, scaled3(2.0, cross(w, e)), by_w, ZERO3)


@compile_inline
def _distance_back(a, b, size):
    """Do so of the length of r."""
    r = _apart(a, b)
    speed = sub3(get3(b.velocity), get3(a.velocity))
    second = sub3(get3(b.acceleration), get3(a.acceleration))
    g = 1.0 / np.sqrt(dot3(r, r))
    n = scaled3(g, r)
    s = dot3(n, speed)
    across = axpy3(speed, -s, n)
    place = axpy3(second, -dot3(n, second) - g * dot3(across, across), n)
    place = axpy3(place, -2.0 * g * s, across)
    _add_both(a.by_pose, b.by_pose, size * g, place, ZERO3, ZERO3)
    _add_both(a.by_rate, b.by_rate, 2.0 * size * g, across, ZERO3, ZERO3)


@compile_inline
def _angle_back(row, a, b, size):
    """Do so of ``e . h`` with e fixed to the first end, h to the second: ``e''. h + 2 e'. h' + e . h''``."""
    e, h = _directions(row, a, b)
    w, v = get3(a.omega), get3(b.omega)
    alpha, beta = get_angular(a.acceleration), get_angular(b.acceleration)
    ed, hd = cross(w, e), cross(v, h)
    edd, hdd = add3(cross(alpha, e), cross(w, ed)), add3(cross(beta, h), cross(v, hd))
    by_e = add3(add3(cross(h, alpha), _centripetal(w, h)), axpy3(hdd, 2.0, cross(hd, w)))
    by_h = add3(add3(cross(e, beta), _centripetal(v, e)), axpy3(edd, 2.0, cross(ed, v)))
    _add_both(a.by_pose, b.by_pose, size, ZERO3, cross(e, by_e), cross(h, by_h))
    by_w = axpy3(_by_spin(w, e, h), 2.0, cross(e, hd))
    by_v = axpy3(_by_spin(v, h, e), 2.0, cross(h, ed))
    _add_both(a.by_rate, b.by_rate, size, ZERO3, by_w, by_v)
