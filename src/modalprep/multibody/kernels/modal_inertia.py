"""Mass matrix and bias force of a single body (theory 4).

A flexible body of link i has the mass matrix ``[[M_rr, M_rf], [M_fr, M_ff]]``, rigid rows r and modal rows f, with

    M_rr = [[m, -s~], [s~, J]]     M_rf = [[S], [C]]     M_ff = d eta^T M' d eta + dp^T dp

and the bias force b, what remains of the equations (4.3) where A, alpha and q'' are zero. All follow from its motion
``X_r p_r(q) + phi' eta(q)``, four affine functions and the rest. `modal` is as in modal_interfaces.py.
"""

from __future__ import annotations

from modalprep.body import line
from modalprep.compiler.jit import compile_inline
from modalprep.compiler.lanes import WIDTH, four, get_lanes, put_lanes
from modalprep.multibody.kernels.algebra.matrices import antisymmetric, plus_product, symmetric_times, times
from modalprep.multibody.kernels.algebra.rows import (
    combined3,
    combined9,
    dots9,
    put_dots12,
    put_rows3,
    put_rows6,
    row_vectors,
    rows3,
    rows9,
    twice_combined6,
    vectors,
)
from modalprep.multibody.kernels.algebra.tuples import (
    ZERO3,
    add3,
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
    take3,
)
from modalprep.multibody.kernels.data import GROWS, UNIT
from modalprep.multibody.kernels.modal_dampers import add_damper_forces
from modalprep.multibody.kernels.modal_mass import add_second_order, apply_slopes, rest_coordinates
from modalprep.multibody.kernels.stations.inertia import own_stations
from modalprep.multibody.kernels.stations.motion import move_parts

shortening, swing = compile_inline(line.shortening), compile_inline(line.swing)


@compile_inline
def modal_coordinates(modal, model, i, y):
    """Copy the modal coordinates of link i's body and their rates from a state, and move its stations.

    `modal` may be None.
    """
    if modal is not None:
        s = model.links[i].slot
        if s >= 0:
            for a in range(model.links[i].modes):
                modal.q[s, a] = y[model.links[i].xq + a]
                modal.qd[s, a] = y[model.nx + model.links[i].uq + a]
            if model.links[i].stations >= 0:
                move_parts(modal, model, i)


@compile_inline
def own_inertia(modal, model, data, i):
    """Write the mass matrix and bias force of link i's body alone to the data, after `modal_coordinates`."""
    if modal is not None:
        if model.links[i].slot >= 0:
            own_flexible(modal, model, data, i)
            add_damper_forces(modal, model, i)
            return
    own_rigid(data.links[i])


@compile_inline
def own_rigid(own):
    """Write the inertia and bias force of a link's rigid body to its record of the data."""
    J = get6(own.inertia)
    s = get3(own.first_moment)
    w = get3(own.omega)
    put_inertia(own, own.mass, s, J)
    put3(own.force, cross(w, cross(w, s)))
    put_angular(own.force, cross(w, symmetric_times(J, w)))


@compile_inline
def put_inertia(own, m, s, J):
    """Write ``M_rr = [[m, -s~], [s~, J]]`` to a link's record of the data."""
    put6(own.M, (m, 0.0, 0.0, m, 0.0, m))
    put9(own.H, (0.0, s[2], -s[1], -s[2], 0.0, s[0], s[1], -s[0], 0.0))
    put6(own.J, J)


@compile_inline
def own_flexible(modal, model, data, i):
    """Write the mass matrix and bias force of link i's flexible body to the data; its external modal forces are zero.

    The affine coordinate p_r moves as a point: its acceleration where A, alpha and q'' are zero is
    ``f_r = w x (w x p_r) + 2 w x p_r' + p_r''``.
    """
    if model.links[i].stations >= 0:
        deflect(modal, model, i)
        own_stations(model, data, i)
        return
    deflect(modal, model, i)
    k = model.links[i].kind
    n = model.links[i].modes
    E = dots9(modal.P_eta, modal.eta, n)  # eta P' eta
    Y = dots9(modal.P_eta, modal.etad, n)  # eta' P' eta
    torque = ZERO3
    if model.links[i].modal_mass == GROWS:
        torque = apply_slopes(modal, model, i)
    w = get3(data.links[i].omega)
    p = vectors(modal.p)
    pd = vectors(modal.pd)
    pdd = vectors(modal.pdd)
    f0 = _bias_acceleration(w, p[0], pd[0], pdd[0])
    f1 = _bias_acceleration(w, p[1], pd[1], pdd[1])
    f2 = _bias_acceleration(w, p[2], pd[2], pdd[2])
    f3 = _bias_acceleration(w, p[3], pd[3], pdd[3])
    _modal_rows(modal, model, i, w, p, (f0, f1, f2, f3))
    _modal_mass(modal, model, i)
    root = modal.integrals.root_mass[k]
    own = data.links[i]
    put_inertia(own, own.mass, _scaled(root, p[0]), _moment_of_inertia(E, p))
    put3(own.force, _scaled(root, f0))
    torque = add3(torque, _rest_torque(w, E, Y))
    torque = add3(torque, add3(add3(cross(p[0], f0), cross(p[1], f1)), add3(cross(p[2], f2), cross(p[3], f3))))
    put_angular(own.force, torque)


@compile_inline
def _scaled(f, v):
    """Return ``f v``."""
    return f * v[0], f * v[1], f * v[2]


@compile_inline
def _bias_acceleration(w, p, pd, pdd):
    """Return ``w x (w x p) + 2 w x p' + p''``."""
    return add3(cross(w, axpy3(cross(w, p), 2.0, pd)), pdd)


@compile_inline
def _moment_of_inertia(E, p):
    """Return ``J = tr(E) - E`` (6) of ``E = eta P' eta + p_r p_r^T``."""
    E = plus_product(plus_product(E, p[0], p[0]), p[1], p[1])
    E = plus_product(plus_product(E, p[2], p[2]), p[3], p[3])
    return E[4] + E[8], -E[1], -E[2], E[0] + E[8], -E[5], E[0] + E[4]


@compile_inline
def _rest_torque(w, E, Y):
    """Bias torque ``w x J w + 2 (tr(Y) - Y) w`` of the rest of the motion, ``J = tr(E) - E``."""
    return axpy3(axpy3(cross(times(E, w), w), 2.0 * (Y[0] + Y[4] + Y[8]), w), -2.0, times(Y, w))


@compile_inline
def _modal_rows(modal, model, i, w, p, f):
    """Write S, C and b_f of link i's body, four modes at a time; external modal forces become zero.

    ``b_f = dp_r.f_r + (w~ w~)_ab P'_ab eta + 2 w~_ab P'_ab eta' + K q + D q'``, where ``w~ w~ = w w^T - w.w`` and
    ``w~_ab P'_ab = w_c eps_cab P'_ba``.
    """
    k = model.links[i].kind
    s = model.links[i].slot
    K = model.modal.K[k]
    D = model.modal.D[k]
    root = modal.integrals.root_mass[k]
    for b in range(0, model.links[i].modes, WIDTH):
        dp = row_vectors(modal.dp, b)
        P_eta = rows9(modal.P_eta, b)
        put_rows3(modal.M_rf[s], 0, b, _scaled(root, dp[0]))
        put_rows3(modal.M_rf[s], 3, b, coupling(dp, p, P_eta))
        force = dot3(w, times(P_eta, w)) - dot3(w, w) * (P_eta[0] + P_eta[4] + P_eta[8])
        force = force + 2.0 * dot3(w, rows3(modal.gyro, 0, b))
        force = force + (dot3(f[0], dp[0]) + dot3(f[1], dp[1]) + dot3(f[2], dp[2]) + dot3(f[3], dp[3]))
        force = force + get_lanes(K, b) * get_lanes(modal.q[s], b) + get_lanes(D, b) * get_lanes(modal.qd[s], b)
        if model.links[i].modal_mass == GROWS:
            force = force + get_lanes(modal.eta_force, b)
        put_lanes(modal.b_f[s], b, force)
        put_lanes(modal.load[s], b, four(0.0))


@compile_inline
def coupling(dp, p, P_eta):
    """Return ``C_c = eps_cab L_ba`` of four modes: ``p_r x dp_r`` and the antisymmetric part of ``P' eta``."""
    C = add3(add3(cross(p[0], dp[0]), cross(p[1], dp[1])), add3(cross(p[2], dp[2]), cross(p[3], dp[3])))
    return add3(C, antisymmetric(P_eta))


@compile_inline
def mode_moments(modal, model, i, b):
    """Return S_a(q) (3) and L_ab(q) (9) of four modes from b on of link i's body, after `deflect`."""
    root = modal.integrals.root_mass[model.links[i].kind]
    p = vectors(modal.p)
    dp = row_vectors(modal.dp, b)
    L = plus_product(plus_product(rows9(modal.P_eta, b), dp[0], p[0]), dp[1], p[1])
    return _scaled(root, dp[0]), plus_product(plus_product(L, dp[2], p[2]), dp[3], p[3])


@compile_inline
def _modal_mass(modal, model, i):
    """Write the upper half of link i's own ``M_ff = d eta^T M' d eta + dp^T dp``: 1 without geometric stiffness."""
    k = model.links[i].kind
    s = model.links[i].slot
    n = model.links[i].modes
    M_ff = modal.M_ff[s]
    if model.links[i].modal_mass == UNIT:
        for a in range(n):
            for b in range(a & -WIDTH, n, WIDTH):
                put_lanes(M_ff[a], b, four(0.0))
            M_ff[a, a] = 1.0
        return
    for a in range(n):
        M_rest = modal.integrals.M_rest[k, a]
        for b in range(a & -WIDTH, n, WIDTH):
            put_lanes(M_ff[a], b, get_lanes(M_rest, b) + _affine_mass(modal.dp, a, b))
    if model.links[i].modal_mass == GROWS:
        add_second_order(modal, k, s, n)


@compile_inline
def _affine_mass(dp, a, b):
    """Return ``dp^T dp`` of mode a and four modes from b on."""
    own = dp[:, a]
    other = row_vectors(dp, b)
    x = dot3(take3(own, 0), other[0]) + dot3(take3(own, 3), other[1])
    return x + (dot3(take3(own, 6), other[2]) + dot3(take3(own, 9), other[3]))


@compile_inline
def deflect(modal, model, i):
    """Write the affine coordinates p(q), their rates and dp, and ``P' eta`` of link i's body: (4.4) to (4.9)."""
    k = model.links[i].kind
    s = model.links[i].slot
    n = model.links[i].modes
    rest_coordinates(modal, model, i)
    for b in range(0, n, WIDTH):
        P_eta = combined9(modal.integrals.P_rest[k], modal.eta, n, b)
        put_rows6(modal.P_eta, 0, b, P_eta[:6])
        put_rows3(modal.P_eta, 6, b, P_eta[6:])
        put_rows3(modal.gyro, 0, b, combined3(modal.integrals.gyro[k], modal.etad, n, b))
    put_dots12(modal.integrals.B[k], modal.q[s], n, modal.Bq)
    put_dots12(modal.integrals.B[k], modal.qd[s], n, modal.Bqd)
    if model.links[i].modal_mass == UNIT:
        _first_order(modal, k, n)
    else:
        _second_order_terms(modal, k, s, n)
        _as_a_line(modal, k, n)


@compile_inline
def _first_order(modal, k, n):
    """Write p, p', p'' and dp of a body without geometric stiffness: ``p = p(0) + B q``."""
    for c in range(0, 12, WIDTH):
        put_lanes(modal.p, c, get_lanes(modal.integrals.p0[k], c) + get_lanes(modal.Bq, c))
        put_lanes(modal.pd, c, get_lanes(modal.Bqd, c))
        put_lanes(modal.pdd, c, four(0.0))
    for c in range(12):
        for b in range(0, n, WIDTH):
            put_lanes(modal.dp[c], b, get_lanes(modal.integrals.B[k, c], b))


@compile_inline
def _second_order_terms(modal, k, s, n):
    """Write ``D q``, ``D q'``, ``t = q D q / 2``, its rate and ``q' D q'``: theory (4.4)."""
    q = modal.q[s]
    qd = modal.qd[s]
    for b in range(0, n, WIDTH):
        for c in range(0, 12, 6):
            Kg_q, Kg_qd = twice_combined6(modal.integrals.Kg_p[k], c, b, q, qd, n)
            put_rows6(modal.Kg_q, c, b, Kg_q)
            put_rows6(modal.Kg_qd, c, b, Kg_qd)
    put_dots12(modal.Kg_q, q, n, modal.t)
    put_dots12(modal.Kg_q, qd, n, modal.td)
    put_dots12(modal.Kg_qd, qd, n, modal.tdd)
    for c in range(0, 12, WIDTH):
        put_lanes(modal.t, c, 0.5 * get_lanes(modal.t, c))


@compile_inline
def _as_a_line(modal, k, n):
    """Write p, p', p'' and dp of a body that bends as a line, ``p = p(0) + h(tau) B q + g(tau) t``: theory (4.6)."""
    B = modal.integrals.B[k]
    p0 = modal.integrals.p0[k]
    strain = modal.integrals.strain[k]
    tau = dot12(strain, modal.t)
    taud = dot12(strain, modal.td)
    taudd = dot12(strain, modal.tdd)
    g, g_slope, g_curve = shortening(tau)
    h, h_slope, h_curve = swing(tau)
    for c in range(0, 12, WIDTH):
        Bq = get_lanes(modal.Bq, c)
        Bqd = get_lanes(modal.Bqd, c)
        t = get_lanes(modal.t, c)
        td = get_lanes(modal.td, c)
        p_tau = h_slope * Bq + g_slope * t
        put_lanes(modal.p_tau, c, p_tau)
        put_lanes(modal.p, c, get_lanes(p0, c) + h * Bq + g * t)
        put_lanes(modal.pd, c, h * Bqd + g * td + taud * p_tau)
        pdd = g * get_lanes(modal.tdd, c) + (2.0 * taud) * (h_slope * Bqd + g_slope * td) + taudd * p_tau
        put_lanes(modal.pdd, c, pdd + (taud * taud) * (h_curve * Bq + g_curve * t))
    for b in range(0, n, WIDTH):
        d_tau = four(0.0)
        for c in range(12):
            d_tau = d_tau + strain[c] * get_lanes(modal.Kg_q[c], b)
        for c in range(12):
            dp = h * get_lanes(B[c], b) + g * get_lanes(modal.Kg_q[c], b) + modal.p_tau[c] * d_tau
            put_lanes(modal.dp[c], b, dp)
