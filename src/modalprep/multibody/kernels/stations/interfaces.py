"""Motion of interfaces of bodies with stations: frames at the ends of the chain, and the second order beyond it."""

from __future__ import annotations

from modalprep.body import line
from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.compiler.lanes import WIDTH, four, get_lanes
from modalprep.multibody.kernels.algebra.matrices import product, times
from modalprep.multibody.kernels.algebra.rotations import cayley, cayley_rate, half_tangent, half_tangent_rate
from modalprep.multibody.kernels.algebra.rows import dots6, put_rows6, rows3, rows6, twice_combined6
from modalprep.multibody.kernels.algebra.tuples import (
    ZERO6,
    add3,
    axpy3,
    combined,
    cross,
    dot3,
    get3,
    get9,
    scaled3,
    sub6,
    take3,
)
from modalprep.multibody.kernels.stations.motion import move_frame

shortening = compile_inline(line.shortening)


@compile_kernel
def station_node(modal, model, i, node, slot, w):
    """Motion of an interface of link i's body in its axes; its partial velocities go to row `slot` of Phi.

    ``w`` is the link's spin.

    Returns
    -------
    r, R : place and rotation
    v, t : velocity and spin by the modal rates
    linear, angular : acceleration where A and q'' are zero
    """
    parts = model.modal.parts
    s = model.links[i].slot
    n = model.links[i].modes
    row = model.links[i].first_interface + node
    leaf = parts.leaves[row]
    last = len(modal.parts.frames) - 1
    a = model.links[i].stations + leaf.parent if leaf.parent >= 0 else -1
    q, qd = modal.q[s], modal.qd[s]
    move_frame(modal.parts.frames, modal.parts.J, a, last, leaf.d, parts.leaf_moved[row], q, qd, n)
    u, v, bulge, turn, turning, bending = _beyond(modal, parts.strain[row], model.modal.Kg_FT[row], q, qd, n, slot)
    x = half_tangent(turn)
    R, scale = cayley(x)
    xd = half_tangent_rate(turn, turning)
    xdd = half_tangent_rate(turn, bending)
    xdd = axpy3(axpy3(xdd, dot3(turn, turning) / 3.0, turning), dot3(turning, turning) / 6.0, turn)
    spin = cayley_rate(x, scale, xd)
    spinning = axpy3(cayley_rate(x, scale, xdd), -0.5 * scale * dot3(x, xd), spin)
    own = modal.parts.frames[last]
    Phi, J = modal.Phi[slot], modal.parts.J[last]
    for b in range(0, n, WIDTH):
        f = add3(rows3(Phi, 0, b), rows3(J, 0, b))
        t = cayley_rate(x, scale, half_tangent_rate(turn, rows3(Phi, 3, b)))
        t = add3(t, times(R, rows3(J, 3, b)))
        put_rows6(Phi, 0, b, (f[0], f[1], f[2], t[0], t[1], t[2]))
    r = add3(get3(own.r), u)
    v = add3(get3(own.v), v)
    inner = times(R, get3(own.w))
    t = add3(spin, inner)
    linear = add3(add3(get3(own.a), bulge), cross(w, axpy3(cross(w, r), 2.0, v)))
    angular = add3(add3(spinning, times(R, get3(own.alpha))), add3(cross(spin, inner), cross(w, t)))
    return r, product(R, get9(own.R)), v, t, linear, angular


@compile_inline
def _beyond(modal, strain, Kg, q, qd, n, slot):
    """Write the slopes of the displacement and the rotation vector beyond the chain to row `slot` of Phi.

    Returns the displacement, its rate and acceleration without q'', and those of the rotation vector.
    """
    Phi = modal.Phi[slot]
    for b in range(0, n, WIDTH):
        Kg_q, Kg_qd = twice_combined6(Kg, 0, b, q, qd, n)
        put_rows6(Phi, 0, b, sub6(ZERO6, Kg_q))
        put_rows6(modal.Kg_FT_qd, 0, b, Kg_qd)
    moved = dots6(Phi, q, n)
    rates = dots6(Phi, qd, n)
    second = sub6(ZERO6, dots6(modal.Kg_FT_qd, qd, n))
    tau, rate, bending = 0.0, 0.0, 0.0
    for a in range(n):
        for b in range(n):
            tau += 0.5 * q[a] * strain[a, b] * q[b]
            rate += q[a] * strain[a, b] * qd[b]
            bending += qd[a] * strain[a, b] * qd[b]
    g, g_slope, g_curve = shortening(tau)
    u = scaled3(0.5, take3(moved, 0))
    v = take3(rates, 0)
    for b in range(0, n, WIDTH):
        d_tau = four(0.0)
        for a in range(n):
            d_tau = d_tau + q[a] * get_lanes(strain[a], b)
        six = rows6(Phi, 0, b)
        along = scaled3(g_slope * d_tau, u)
        x = axpy3(along, g, six[:3])
        put_rows6(Phi, 0, b, (x[0], x[1], x[2], six[3], six[4], six[5]))
    speed = combined(g, v, rate * g_slope, u)
    bulge = combined(g, take3(second, 0), bending * g_slope + rate * rate * g_curve, u)
    bulge = axpy3(bulge, 2.0 * rate * g_slope, v)
    return scaled3(g, u), speed, bulge, scaled3(0.5, take3(moved, 3)), take3(rates, 3), take3(second, 3)
