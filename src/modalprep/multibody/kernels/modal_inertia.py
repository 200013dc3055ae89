"""Inertia and bias force of a single body, with its modes (theory 4)."""

from __future__ import annotations

from modalprep.body import line
from modalprep.compiler.jit import compile_inline
from modalprep.multibody.kernels.algebra.lanes import WIDTH, four, get_lanes, put_lanes
from modalprep.multibody.kernels.algebra.matrices import (
    product_transposed,
    symmetric_times,
    times,
)
from modalprep.multibody.kernels.algebra.rows import (
    combined3,
    combined9,
    dots4,
    dots9,
    mode12,
    put_heads,
    put_rows3,
    put_rows6,
    rows3,
    rows9,
    rows12,
    twice_combined6,
)
from modalprep.multibody.kernels.algebra.tuples import (
    add3,
    add9,
    axpy3,
    cross,
    dot3,
    dot12,
    get3,
    get6,
    put3,
    put6,
    put9,
    put_angular,
    take12,
)
from modalprep.multibody.kernels.data import GROWS, UNIT
from modalprep.multibody.kernels.modal_mass import apply_slopes, grown_mass, rest_coordinates

shortening, swing = compile_inline(line.shortening), compile_inline(line.swing)


@compile_inline
def expand(modal, model, i):
    """Write dp(q), ``D q'``, ``P' q`` and the gyroscopic products with q' of link i's body to modal.

    modal.affine gets p(q), its rate and, without q'', its acceleration; two more rows are workspace.
    """
    k = model.links[i].kind
    s = model.links[i].slot
    n = model.links[i].modes
    N = modal.q.shape[1]
    rest_coordinates(modal, model, i)
    for b in range(0, n, WIDTH):
        rest = combined9(modal.integrals.rest[k], modal.eta[0], n, b, N)
        put_rows6(modal.rest, b, N, (rest[0], rest[1], rest[2], rest[3], rest[4], rest[5]))
        put_rows3(modal.rest, b + 6 * N, N, (rest[6], rest[7], rest[8]))
        put_rows3(modal.gyro, b, N, combined3(modal.integrals.gyro[k], modal.eta[1], n, b, N))
    if model.links[i].modal_mass == UNIT:
        _move_straight(modal, k, s, n, N)
        return
    for b in range(0, n, WIDTH):
        for r in (b, b + 6 * N):
            bent, turning = twice_combined6(modal.integrals.by_q[k], modal.q[s], modal.qd[s], n, r, N)
            put_rows6(modal.dp, r, N, bent)
            put_rows6(modal.Dqd, r, N, turning)
    _affine_sums(modal, k, s, n, N)
    _as_a_line(modal, k, n, N)


@compile_inline
def _move_straight(modal, k, s, n, N):
    """Write p, p', p'' and dp of a body without second order: dp is constant."""
    base, place = modal.integrals.base[k], modal.integrals.place[k]
    for c in range(0, 12, WIDTH):
        put_lanes(modal.affine[0], c, get_lanes(place, c) + dots4(base, c * N, N, modal.q[s], n))
        put_lanes(modal.affine[1], c, dots4(base, c * N, N, modal.qd[s], n))
        put_lanes(modal.affine[2], c, four(0.0))
        for a in range(0, n, WIDTH):
            for r in range(c * N + a, (c + WIDTH) * N + a, N):
                put_lanes(modal.dp, r, get_lanes(base, r))


@compile_inline
def _affine_sums(modal, k, s, n, N):
    """Write ``B q``, ``B q'``, ``q' D q'``, ``t = q D q / 2`` and its rate to the rows of modal.affine."""
    base, q, qd = modal.integrals.base[k], modal.q[s], modal.qd[s]
    for c in range(0, 12, WIDTH):
        put_lanes(modal.affine[0], c, dots4(base, c * N, N, q, n))
        put_lanes(modal.affine[1], c, dots4(base, c * N, N, qd, n))
        put_lanes(modal.affine[2], c, dots4(modal.Dqd, c * N, N, qd, n))
        put_lanes(modal.affine[3], c, 0.5 * dots4(modal.dp, c * N, N, q, n))
        put_lanes(modal.affine[4], c, dots4(modal.dp, c * N, N, qd, n))


@compile_inline
def _as_a_line(modal, k, n, N):
    """Make the sums of `_affine_sums` p, p' and p'', and ``D q`` dp, for a body that bends as a line: theory (4.6)."""
    tau, speed, change = 0.0, 0.0, 0.0
    for c in range(12):
        f = modal.integrals.place[k, 12 + c]
        tau, speed = tau + f * modal.affine[3, c], speed + f * modal.affine[4, c]
        change += f * modal.affine[2, c]
    g, g_slope, g_curve = shortening(tau)
    h, h_slope, h_curve = swing(tau)
    for c in range(12):
        b = modal.affine[0, c]
        bd = modal.affine[1, c]
        t = modal.affine[3, c]
        td = modal.affine[4, c]
        along = h_slope * b + g_slope * t
        rate = h_slope * bd + g_slope * td
        curve = h_curve * b + g_curve * t
        modal.affine[0, c] = modal.integrals.place[k, c] + h * b + g * t
        modal.affine[1, c] = h * bd + g * td + speed * along
        modal.affine[2, c] = g * modal.affine[2, c] + 2.0 * speed * rate + speed * speed * curve + change * along
        modal.affine[3, c] = along
    base = modal.integrals.base[k]
    strain = modal.integrals.place[k]
    along = modal.affine[3]
    for b in range(0, n, WIDTH):
        f = four(0.0)
        for c in range(12):
            f = f + strain[12 + c] * get_lanes(modal.dp, c * N + b)
        for c in range(12):
            r = c * N + b
            put_lanes(modal.dp, r, h * get_lanes(base, r) + g * get_lanes(modal.dp, r) + f * along[c])


@compile_inline
def mode_moments(modal, model, i, p, b):
    """Return S_a(q) (3) and L_ab(q) (9) of four modes from b on of link i's body, after `expand`, which gave p."""
    N = modal.q.shape[1]
    root = modal.integrals.place[model.links[i].kind, 24]
    d = rows12(modal.dp, b, N)
    e = rows9(modal.rest, b, N)
    L = product_transposed(
        (d[0], d[3], d[6], d[1], d[4], d[7], d[2], d[5], d[8]), (p[0], p[3], p[6], p[1], p[4], p[7], p[2], p[5], p[8])
    )
    x, y, z = d[9], d[10], d[11]
    last = (x * p[9], x * p[10], x * p[11], y * p[9], y * p[10], y * p[11], z * p[9], z * p[10], z * p[11])
    return (root * d[0], root * d[1], root * d[2]), add9(add9(L, last), e)


@compile_inline
def modal_coordinates(modal, model, i, y):
    """Take the modal coordinates of link i's body and their rates from a state; `modal` may be None."""
    if modal is not None:
        s = model.links[i].slot
        if s >= 0:
            for a in range(model.links[i].modes):
                modal.q[s, a] = y[model.links[i].xq + a]
                modal.qd[s, a] = y[model.nx + model.links[i].uq + a]


@compile_inline
def own_inertia(modal, model, data, i):
    """Write the own inertia and bias force of link i's body to the data, after `modal_coordinates`."""
    if modal is not None:
        if model.links[i].slot >= 0:
            own_flexible(modal, model, data, i)
            return
    own_rigid(data.links[i])


@compile_inline
def own_rigid(own):
    """Write the inertia and bias force of a link's rigid body to its record of the data."""
    m = own.mass
    s = get3(own.first_moment)
    J = get6(own.inertia)
    w = get3(own.omega)
    put6(own.M, (m, 0.0, 0.0, m, 0.0, m))
    put9(own.H, (0.0, s[2], -s[1], -s[2], 0.0, s[0], s[1], -s[0], 0.0))
    put6(own.J, J)
    put3(own.force, cross(w, cross(w, s)))
    put_angular(own.force, cross(w, symmetric_times(J, w)))


@compile_inline
def own_flexible(modal, model, data, i):
    """Write link i's own inertia and bias to the data: the equations of one body, see body/mass.py."""
    k, s, n = model.links[i].kind, model.links[i].slot, model.links[i].modes
    for b in range(0, n, WIDTH):
        put_lanes(modal.load[s], b, four(0.0))
    w = get3(data.links[i].omega)
    m = data.links[i].mass
    root = modal.integrals.place[k, 24]
    N = modal.q.shape[1]
    expand(modal, model, i)
    p = take12(modal.affine[0], 0)
    rates = take12(modal.affine[1], 0)
    second = take12(modal.affine[2], 0)
    E = dots9(modal.rest, N, modal.eta[0], n)
    Y = dots9(modal.rest, N, modal.eta[1], n)
    grows = model.links[i].modal_mass == GROWS
    growing = (0.0, 0.0, 0.0)
    if grows:
        growing = apply_slopes(modal, model, i)
    f0, t0 = _affine_force(w, p[:3], rates[:3], second[:3])
    f1, t1 = _affine_force(w, p[3:6], rates[3:6], second[3:6])
    f2, t2 = _affine_force(w, p[6:9], rates[6:9], second[6:9])
    f3, t3 = _affine_force(w, p[9:], rates[9:], second[9:])
    K, D = model.modal.diagonal[k, 0], model.modal.diagonal[k, 1]
    ww = dot3(w, w)
    for b in range(0, n, WIDTH):
        d = rows12(modal.dp, b, N)
        e = rows9(modal.rest, b, N)
        g = rows3(modal.gyro, b, N)
        # w~ w~ = w w^T - w.w, 2 w~_ab P'_ab q' = 2 w_c eps_cab P'_ba q'
        f = w[0] * (w[0] * e[0] + w[1] * e[1] + w[2] * e[2])
        f = f + w[1] * (w[0] * e[3] + w[1] * e[4] + w[2] * e[5])
        f = f + w[2] * (w[0] * e[6] + w[1] * e[7] + w[2] * e[8]) - ww * (e[0] + e[4] + e[8])
        f = f + 2.0 * dot3(w, g) + dot3(f0, d[:3]) + dot3(f1, d[3:6]) + dot3(f2, d[6:9]) + dot3(f3, d[9:])
        f = f + get_lanes(K, b) * get_lanes(modal.q[s], b) + get_lanes(D, b) * get_lanes(modal.qd[s], b)
        if grows:
            f = f + get_lanes(modal.curved[1], b)
        c = add3(add3(cross(p[:3], d[:3]), cross(p[3:6], d[3:6])), add3(cross(p[6:9], d[6:9]), cross(p[9:], d[9:])))
        c = add3(c, (e[7] - e[5], e[2] - e[6], e[3] - e[1]))
        put_heads(modal.Z[s], b, (root * d[0], root * d[1], root * d[2], c[0], c[1], c[2], f, four(0.0)))
    _own_modal_mass(modal, model, i, N)
    torque = add3(add3(add3(t0, t1), add3(t2, t3)), add3(_rest_torque(w, E, Y), growing))
    E = (
        E[0] + p[0] * p[0] + p[3] * p[3] + p[6] * p[6] + p[9] * p[9],
        E[1] + p[0] * p[1] + p[3] * p[4] + p[6] * p[7] + p[9] * p[10],
        E[2] + p[0] * p[2] + p[3] * p[5] + p[6] * p[8] + p[9] * p[11],
        E[4] + p[1] * p[1] + p[4] * p[4] + p[7] * p[7] + p[10] * p[10],
        E[5] + p[1] * p[2] + p[4] * p[5] + p[7] * p[8] + p[10] * p[11],
        E[8] + p[2] * p[2] + p[5] * p[5] + p[8] * p[8] + p[11] * p[11],
    )
    put6(data.links[i].M, (m, 0.0, 0.0, m, 0.0, m))
    put9(
        data.links[i].H,
        (0.0, root * p[2], -root * p[1], -root * p[2], 0.0, root * p[0], root * p[1], -root * p[0], 0.0),
    )
    put6(data.links[i].J, (E[3] + E[5], -E[1], -E[2], E[0] + E[5], -E[4], E[0] + E[3]))
    put3(data.links[i].force, (root * f0[0], root * f0[1], root * f0[2]))
    put_angular(data.links[i].force, torque)


@compile_inline
def _affine_force(w, p, rate, second):
    """Acceleration of one affine coordinate when A, alpha, q'' are zero, and its moment about the origin."""
    f = add3(cross(w, axpy3(cross(w, p), 2.0, rate)), second)
    return f, cross(p, f)


@compile_inline
def _rest_torque(w, E, Y):
    """Torque ``w x J w + 2 (tr(Y) - Y) w`` of the rest of the motion, ``J = tr(E) - E``."""
    return axpy3(axpy3(cross(times(E, w), w), 2.0 * (Y[0] + Y[4] + Y[8]), w), -2.0, times(Y, w))


@compile_inline
def _own_modal_mass(modal, model, i, N):
    """Write link i's own M_ff to modal.Z: ``d eta^T (1 - B^T B) d eta + dp^T dp``, 1 without geometric stiffness."""
    k = model.links[i].kind
    s = model.links[i].slot
    n = model.links[i].modes
    Z = modal.Z[model.links[i].slot]
    if model.links[i].modal_mass == UNIT:
        for a in range(n):
            for b in range(a & -WIDTH, n, WIDTH):
                put_lanes(Z[a], 8 + b, four(0.0))
            Z[a, 8 + a] = 1.0
        return
    for a in range(n):
        own = mode12(modal.dp, a, N)
        mass = modal.integrals.mass[k, a]
        for b in range(a & -WIDTH, n, WIDTH):
            put_lanes(Z[a], 8 + b, get_lanes(mass, b) + dot12(own, rows12(modal.dp, b, N)))
    if model.links[i].modal_mass == GROWS:
        grown_mass(modal, k, s, n)
