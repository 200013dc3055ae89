"""Frames of stations: `body/stations/motion.py` compiled, with their velocities and accelerations."""

from __future__ import annotations

from modalprep.body import exponential
from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.compiler.lanes import WIDTH
from modalprep.multibody.kernels.algebra.matrices import UNIT9, product, times
from modalprep.multibody.kernels.algebra.rows import put_rows6, rows3, twice_dots6
from modalprep.multibody.kernels.algebra.tuples import (
    ZERO3,
    add3,
    axpy3,
    combined,
    cross,
    dot3,
    get3,
    get9,
    put3,
    put9,
    scaled3,
)

angle_functions = compile_inline(exponential.angle_functions)


@compile_inline
def turn_matrix(f, g, t):
    """Return ``1 + f t~ + g t~ t~``."""
    x, y, z = t
    e = 1.0 - g * dot3(t, t)
    return (
        e + g * x * x,
        g * x * y - f * z,
        g * x * z + f * y,
        g * x * y + f * z,
        e + g * y * y,
        g * y * z - f * x,
        g * x * z - f * y,
        g * y * z + f * x,
        e + g * z * z,
    )


@compile_inline
def slope_matrix(b, c, b1, c1, t, rho, u, w):
    """Return ``d(V rho) / d th = -b rho~ - c (u~ + t~ rho~) + 2 (b1 u + c1 w) t^T``, ``t~ rho~ = rho t^T - t.rho``."""
    e = combined(2.0 * b1, u, 2.0 * c1, w)
    e = axpy3(e, -c, rho)
    h = c * dot3(t, rho)
    k = combined(b, rho, c, u)
    return (
        h + e[0] * t[0],
        k[2] + e[0] * t[1],
        -k[1] + e[0] * t[2],
        -k[2] + e[1] * t[0],
        h + e[1] * t[1],
        k[0] + e[1] * t[2],
        k[1] + e[2] * t[0],
        -k[0] + e[2] * t[1],
        h + e[2] * t[2],
    )


@compile_kernel
def move_frame(frames, J, a, p, d, moved, q, qd, n):
    """Write frame p and its partial velocities: by those of its parent a, -1 the link's frame, and its twist.

    ``d (3,)`` and ``moved (6, N)`` are constants of the frame, see `data.Parts`.
    """
    x, y = twice_dots6(moved, q, qd, n)
    rho = add3(get3(d), (x[0], x[1], x[2]))
    t = (x[3], x[4], x[5])
    s = (y[0], y[1], y[2])
    v = (y[3], y[4], y[5])
    fa, b, c, b1, c1, b2, c2, _, _ = angle_functions(dot3(t, t))
    u = cross(t, rho)
    w = cross(t, u)
    V = turn_matrix(b, c, t)
    D = slope_matrix(b, c, b1, c1, t, rho, u, w)
    speed, turning, bulging, spinning = _rates(b, c, b1, c1, b2, c2, rho, t, s, v, u, w)
    R = UNIT9
    r0, v0, w0, a0, alpha0 = ZERO3, ZERO3, ZERO3, ZERO3, ZERO3
    if a >= 0:
        base = frames[a]
        R = get9(base.R)
        r0, v0, w0 = get3(base.r), get3(base.v), get3(base.w)
        a0, alpha0 = get3(base.a), get3(base.alpha)
    arm = times(R, add3(rho, combined(b, u, c, w)))
    own = frames[p]
    put9(own.R, product(R, turn_matrix(fa, b, t)))
    put3(own.r, add3(r0, arm))
    rate, spin = times(R, speed), times(R, turning)
    put3(own.v, add3(add3(v0, cross(w0, arm)), rate))
    put3(own.w, add3(w0, spin))
    linear = add3(add3(a0, cross(alpha0, arm)), cross(w0, axpy3(cross(w0, arm), 2.0, rate)))
    put3(own.a, add3(linear, times(R, bulging)))
    put3(own.alpha, add3(add3(alpha0, cross(w0, spin)), times(R, spinning)))
    _partial_velocities(J, a, p, moved, product(R, V), product(R, D), arm, n)


@compile_inline
def _partial_velocities(J, a, p, moved, RV, RD, arm, n):
    for b in range(0, n, WIDTH):
        along = rows3(moved, 0, b)
        turn = rows3(moved, 3, b)
        f = add3(times(RV, along), times(RD, turn))
        t = times(RV, turn)
        if a >= 0:
            before = rows3(J[a], 3, b)
            f = add3(f, add3(rows3(J[a], 0, b), cross(before, arm)))
            t = add3(t, before)
        put_rows6(J[p], 0, b, (f[0], f[1], f[2], t[0], t[1], t[2]))


@compile_inline
def _rates(b, c, b1, c1, b2, c2, rho, t, s, v, u, w):
    """Return rates of ``V rho`` and of the rotation in the parent's axes, and their rates without q''."""
    x = 2.0 * dot3(t, v)
    y = 2.0 * dot3(v, v)
    bd, cd = b1 * x, c1 * x
    bdd, cdd = b2 * x * x + b1 * y, c2 * x * x + c1 * y
    ud = cross(v, rho)
    wd = add3(cross(v, u), cross(t, ud))
    wdd = cross(v, ud)
    us = cross(t, s)
    ws = cross(t, us)
    usd = cross(v, s)
    wsd = add3(cross(v, us), cross(t, usd))
    speed = add3(add3(s, combined(b, us, c, ws)), add3(combined(bd, u, b, ud), combined(cd, w, c, wd)))
    bulging = scaled3(2.0, add3(combined(bd, us, b, usd), combined(cd, ws, c, wsd)))
    bulging = add3(bulging, add3(combined(bdd, u, 2.0 * bd, ud), combined(cdd, w, 2.0 * cd, wd)))
    bulging = axpy3(bulging, 2.0 * c, wdd)
    across = cross(t, v)
    twice = cross(t, across)
    turning = add3(v, combined(b, across, c, twice))
    spinning = axpy3(combined(bd, across, cd, twice), c, cross(v, across))
    return speed, turning, bulging, spinning


@compile_kernel
def move_parts(modal, model, i):
    """Write the frames of the parts of link i's body, after its modal coordinates."""
    parts = model.modal.parts
    k = model.links[i].kind
    s = model.links[i].slot
    n = model.links[i].modes
    start = model.links[i].stations
    for p in range(parts.number[k]):
        own = parts.parts[parts.first[k] + p]
        a = start + own.parent if own.parent >= 0 else -1
        moved = parts.moved[parts.first[k] + p]
        move_frame(modal.parts.frames, modal.parts.J, a, start + p, own.d, moved, modal.q[s], modal.qd[s], n)
