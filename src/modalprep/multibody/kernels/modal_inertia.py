"""Inertia and bias force of a single body, with its modes (theory 4)."""

from __future__ import annotations

from modalprep.body import line
from modalprep.jit import compile_inline
from modalprep.multibody.kernels.algebra.matrices import (
    product_transposed,
    symmetric_times,
    times,
)
from modalprep.multibody.kernels.algebra.tuples import (
    ZERO8,
    ZERO9,
    add3,
    add9,
    axpy3,
    axpy9,
    cross,
    dot3,
    dot12,
    get3,
    get6,
    put3,
    put6,
    put8,
    put9,
    put_angular,
    take9,
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
    k, s, n = model.links[i].kind, model.links[i].slot, model.links[i].modes
    rest_coordinates(modal, model, i)
    _products_by_modes(modal, k, s, n, model.links[i].modal_mass != UNIT)
    _affine_sums(modal, k, s, n)
    _as_a_line(modal, k, n)


@compile_inline
def _products_by_modes(modal, k, s, n, bends):
    """Write ``D q`` (to dp), ``D q'``, ``P' eta`` and the gyroscopic products; without `bends` D is zero."""
    for r in range(12 * n):
        modal.dp[r], modal.Dqd[r] = 0.0, 0.0
    for r in range(9 * n):
        modal.rest[r] = 0.0
    for r in range(3 * n):
        modal.gyro[r] = 0.0
    for b in range(0, n, 4):  # rows are filled up with zeros; four at once spare the loads and stores of the sums
        if bends:
            f0, f1, f2, f3 = modal.q[s, b], modal.q[s, b + 1], modal.q[s, b + 2], modal.q[s, b + 3]
            g0, g1, g2, g3 = modal.qd[s, b], modal.qd[s, b + 1], modal.qd[s, b + 2], modal.qd[s, b + 3]
            for r in range(12 * n):
                d0, d1 = modal.integrals.by_q[k, b, r], modal.integrals.by_q[k, b + 1, r]
                d2, d3 = modal.integrals.by_q[k, b + 2, r], modal.integrals.by_q[k, b + 3, r]
                modal.dp[r] += f0 * d0 + f1 * d1 + f2 * d2 + f3 * d3
                modal.Dqd[r] += g0 * d0 + g1 * d1 + g2 * d2 + g3 * d3
        f0, f1, f2, f3 = modal.eta[0, b], modal.eta[0, b + 1], modal.eta[0, b + 2], modal.eta[0, b + 3]
        g0, g1, g2, g3 = modal.eta[1, b], modal.eta[1, b + 1], modal.eta[1, b + 2], modal.eta[1, b + 3]
        for r in range(9 * n):
            modal.rest[r] += f0 * modal.integrals.rest[k, b, r] + f1 * modal.integrals.rest[k, b + 1, r]
            modal.rest[r] += f2 * modal.integrals.rest[k, b + 2, r] + f3 * modal.integrals.rest[k, b + 3, r]
        for r in range(3 * n):
            modal.gyro[r] += g0 * modal.integrals.gyro[k, b, r] + g1 * modal.integrals.gyro[k, b + 1, r]
            modal.gyro[r] += g2 * modal.integrals.gyro[k, b + 2, r] + g3 * modal.integrals.gyro[k, b + 3, r]


@compile_inline
def _affine_sums(modal, k, s, n):
    """Write ``B q``, ``B q'``, ``q' D q'``, ``t = q D q / 2`` and its rate to the rows of modal.affine."""
    for c in range(12):
        b, bd, t, td, tdd = 0.0, 0.0, 0.0, 0.0, 0.0
        for a in range(n):
            f, g, base, bent = modal.q[s, a], modal.qd[s, a], modal.integrals.base[k, 12 * a + c], modal.dp[12 * a + c]
            b, bd = b + f * base, bd + g * base
            t, td, tdd = t + 0.5 * f * bent, td + g * bent, tdd + g * modal.Dqd[12 * a + c]
        modal.affine[0, c], modal.affine[1, c], modal.affine[2, c] = b, bd, tdd
        modal.affine[3, c], modal.affine[4, c] = t, td


@compile_inline
def _as_a_line(modal, k, n):
    """Make the sums of `_affine_sums` p, p' and p'', and ``D q`` dp, for a body that bends as a line: theory (4.6)."""
    tau, speed, change = 0.0, 0.0, 0.0
    for c in range(12):
        f = modal.integrals.place[k, 12 + c]
        tau, speed = tau + f * modal.affine[3, c], speed + f * modal.affine[4, c]
        change += f * modal.affine[2, c]
    g, g_slope, g_curve = shortening(tau)
    h, h_slope, h_curve = swing(tau)
    for c in range(12):
        b, bd, t, td = modal.affine[0, c], modal.affine[1, c], modal.affine[3, c], modal.affine[4, c]
        along, rate, curve = h_slope * b + g_slope * t, h_slope * bd + g_slope * td, h_curve * b + g_curve * t
        modal.affine[0, c] = modal.integrals.place[k, c] + h * b + g * t
        modal.affine[1, c] = h * bd + g * td + speed * along
        modal.affine[2, c] = g * modal.affine[2, c] + 2.0 * speed * rate + speed * speed * curve + change * along
        modal.affine[3, c] = along
    for a in range(n):
        f = 0.0
        for c in range(12):
            f += modal.integrals.place[k, 12 + c] * modal.dp[12 * a + c]
        for c in range(12):
            base = modal.integrals.base[k, 12 * a + c]
            modal.dp[12 * a + c] = h * base + g * modal.dp[12 * a + c] + f * modal.affine[3, c]


@compile_inline
def mode_moments(modal, model, i, p, a):
    """Return S_a(q) (3) and L_ab(q) (9) of mode a of link i's body, after `expand`, which gave p."""
    d, e, root = take12(modal.dp, 12 * a), take9(modal.rest, 9 * a), modal.integrals.place[model.links[i].kind, 24]
    L = product_transposed((d[0], d[3], d[6], d[1], d[4], d[7], d[2], d[5], d[8]),
                           (p[0], p[3], p[6], p[1], p[4], p[7], p[2], p[5], p[8]))  # fmt: skip
    x, y, z = d[9], d[10], d[11]
    last = (x * p[9], x * p[10], x * p[11], y * p[9], y * p[10], y * p[11], z * p[9], z * p[10], z * p[11])
    return (root * d[0], root * d[1], root * d[2]), add9(add9(L, last), e)


@compile_inline
def own_inertia(modal, model, data, i, y):
    """Write the own inertia and bias force of link i's body to the data; `modal` may be None."""
    if modal is not None:
        if model.links[i].slot >= 0:
            own_flexible(modal, model, data, i, y)
            return
    own_rigid(data.links[i])


@compile_inline
def own_rigid(own):
    """Write the inertia and bias force of a link's rigid body to its record of the data."""
    m, s, J, w = own.mass, get3(own.first_moment), get6(own.inertia), get3(own.omega)
    put6(own.M, (m, 0.0, 0.0, m, 0.0, m))
    put9(own.H, (0.0, s[2], -s[1], -s[2], 0.0, s[0], s[1], -s[0], 0.0))
    put6(own.J, J)
    put3(own.force, cross(w, cross(w, s)))
    put_angular(own.force, cross(w, symmetric_times(J, w)))


@compile_inline
def own_flexible(modal, model, data, i, y):
    """Write link i's own inertia and bias to the data: the equations of one body, see body/mass.py."""
    k, s, n = model.links[i].kind, model.links[i].slot, model.links[i].modes
    for a in range(n):
        modal.q[s, a] = y[model.links[i].xq + a]
        modal.qd[s, a] = y[model.nx + model.links[i].uq + a]
        modal.load[s, a] = 0.0
    w, m, root = get3(data.links[i].omega), data.links[i].mass, modal.integrals.place[k, 24]
    expand(modal, model, i)
    p, rates, second = take12(modal.affine[0], 0), take12(modal.affine[1], 0), take12(modal.affine[2], 0)
    E, Y = ZERO9, ZERO9
    for a in range(n):
        rest = take9(modal.rest, 9 * a)
        E, Y = axpy9(E, modal.eta[0, a], rest), axpy9(Y, modal.eta[1, a], rest)
    grows = model.links[i].modal_mass == GROWS
    growing = (0.0, 0.0, 0.0)
    if grows:
        growing = apply_slopes(modal, model, i)
    f0, t0 = _affine_force(w, p[:3], rates[:3], second[:3])
    f1, t1 = _affine_force(w, p[3:6], rates[3:6], second[3:6])
    f2, t2 = _affine_force(w, p[6:9], rates[6:9], second[6:9])
    f3, t3 = _affine_force(w, p[9:], rates[9:], second[9:])
    ww = dot3(w, w)
    for a in range(n):
        d, e = take12(modal.dp, 12 * a), take9(modal.rest, 9 * a)
        # w~ w~ = w w^T - w.w, 2 w~_ab P'_ab q' = 2 w_c eps_cab P'_ba q'
        f = w[0] * (w[0] * e[0] + w[1] * e[1] + w[2] * e[2])
        f += w[1] * (w[0] * e[3] + w[1] * e[4] + w[2] * e[5])
        f += w[2] * (w[0] * e[6] + w[1] * e[7] + w[2] * e[8]) - ww * (e[0] + e[4] + e[8])
        f += 2.0 * (w[0] * modal.gyro[3 * a] + w[1] * modal.gyro[3 * a + 1] + w[2] * modal.gyro[3 * a + 2])
        f += dot3(f0, d[:3]) + dot3(f1, d[3:6]) + dot3(f2, d[6:9]) + dot3(f3, d[9:])
        f += model.modal.diagonal[k, a, 0] * modal.q[s, a] + model.modal.diagonal[k, a, 1] * modal.qd[s, a]
        if grows:
            f += modal.curved[1, a]
        c = add3(add3(cross(p[:3], d[:3]), cross(p[3:6], d[3:6])), add3(cross(p[6:9], d[6:9]), cross(p[9:], d[9:])))
        c = add3(c, (e[7] - e[5], e[2] - e[6], e[3] - e[1]))
        put8(modal.Z, s, a, 0, (root * d[0], root * d[1], root * d[2], c[0], c[1], c[2], f, 0.0))
    _own_modal_mass(modal, model, i)
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
    )  # fmt: skip
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
def _own_modal_mass(modal, model, i):
    """Write link i's own M_ff to modal.Z: ``d eta^T (1 - B^T B) d eta + dp^T dp``, 1 without geometric stiffness."""
    k, s, n = model.links[i].kind, model.links[i].slot, model.links[i].modes
    for a in range(n):
        for b in range(n + 7 >> 3):
            put8(modal.Z, s, a, 1 + b, ZERO8)
        modal.Z[s, a, 1 + (a >> 3), a & 7] = 1.0
    if model.links[i].modal_mass != UNIT:
        for a in range(n):
            d = take12(modal.dp, 12 * a)
            for b in range(a, n):
                modal.Z[s, a, 1 + (b >> 3), b & 7] = modal.integrals.mass[k, a, b] + dot12(d, take12(modal.dp, 12 * b))
    if model.links[i].modal_mass == GROWS:
        grown_mass(modal, k, s, n)
