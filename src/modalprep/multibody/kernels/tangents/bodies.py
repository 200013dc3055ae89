"""The inertia and internal forces of a flexible body and their derivatives in closed form (theory 5.8).

A particle at x in the body accelerates by ``a + S x + 2 W x' + x''``, with ``S = alpha~ + w~ w~`` and ``W = w~``. All
in axes of the link, at its origin.
"""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.compiler.lanes import WIDTH, four, get_lanes, put_lanes
from modalprep.multibody.kernels.algebra.matrices import antisymmetric, product, spin_matrix, times, transposed
from modalprep.multibody.kernels.algebra.rows import (
    combined9,
    dots9,
    put_rows3,
    put_rows6,
    rows3,
    rows9,
)
from modalprep.multibody.kernels.algebra.tuples import (
    add3,
    add9,
    axpy3,
    axpy9,
    cross,
    dot3,
    get3,
    put3,
    put_angular,
    scaled3,
    take3,
    unit3,
)
from modalprep.multibody.kernels.data import GROWS, UNIT
from modalprep.multibody.kernels.tangents.bends import (
    add_bend_curvature,
    bent,
    second_order,
    straight,
)
from modalprep.multibody.kernels.tangents.station_forces import station_forces


@compile_kernel
def flexible_slopes(modal, model, work, i, a, S, w):
    """Write force and derivatives of link i's flexible body at an acceleration a of its origin; S as above.

    Those by spin are at a constant acceleration of the origin.
    """
    own = work.bodies
    s = model.links[i].slot
    n = model.links[i].modes
    k = model.links[i].kind
    _clear(own, s, n)
    _rest(modal, model, own, i, S, spin_matrix(w), w)
    if model.links[i].stations >= 0:
        station_forces(modal, model, work, i, a, S, w)
    else:
        _affine(modal, model, work, i, a, S, w)
    for m in range(n):
        K, D = model.modal.K[k, m], model.modal.D[k, m]
        own.force[s, 6 + m] += K * modal.q[s, m] + D * modal.qd[s, m]
        own.by_q[s, 6 + m, m] += K
        own.by_qd[s, 6 + m, m] += D
    if model.links[i].dampers >= 0:
        _dampers(model.modal.dampers[model.links[i].dampers], own, s, n, modal.qd[s])


@compile_kernel
def _dampers(C, own, s, n, rates):
    """Add what dampers do that couple modes."""
    for a in range(n):
        for b in range(n):
            own.force[s, 6 + a] += C[a, b] * rates[b]
            own.by_qd[s, 6 + a, b] += C[a, b]


@compile_inline
def _clear(own, s, n):
    for c in range(6 + n):
        own.force[s, c] = 0.0
        for b in range(0, n, WIDTH):
            put_lanes(own.by_q[s, c], b, four(0.0))
            put_lanes(own.by_qd[s, c], b, four(0.0))
        for r in range(3):
            own.by_spin[r, c] = 0.0


@compile_inline
def _affine(modal, model, work, i, a, S, w):
    """Add what the particles ``p_r(q)`` of the affine part do."""
    s = model.links[i].slot
    n = model.links[i].modes
    k = model.links[i].kind
    own, bends, end = work.bodies, work.bends, len(work.bends.p) - 1
    B = modal.integrals.B[k]
    q, qd, qdd = modal.q[s], modal.qd[s], modal.qdd[s]
    curved = model.links[i].modal_mass != UNIT
    if curved:
        second_order(bends, end, modal.integrals.Kg_p[k], 1.0, 12, q, qd, qdd, n)
        bent(bends, end, B, modal.integrals.strain[k], 12, q, qd, qdd, n)
    else:
        straight(bends, end, B, 12, q, qd, qdd, n)
    root = modal.integrals.root_mass[k]
    for r in range(4):
        _particle(modal, own, bends, end, s, k, n, r, a, S, w, root)
    for m in range(n):
        _on_modes(own, bends, end, s, m, n)
    if curved:
        acc = bends.acceleration[end]
        out = own.by_q[s, 6:]
        table, strain = modal.integrals.Kg_p[k], modal.integrals.strain[k]
        add_bend_curvature(bends, end, B, table, 1.0, strain, 12, acc, n, out)


@compile_inline
def _particle(modal, own, bends, end, s, k, n, r, a, S, w, root):
    """Add what affine function r does to the wrench, with its derivatives; its acceleration becomes the whole one."""
    c = 3 * r
    p = add3(take3(modal.integrals.p0[k], c), take3(bends.p[end], c))
    pd = take3(bends.rate[end], c)
    acc = add3(add3(times(S, p), scaled3(2.0, cross(w, pd))), take3(bends.acceleration[end], c))
    if r == 0:
        acc = axpy3(acc, root, a)
    put3(bends.acceleration[end, c:], acc)
    force = own.force[s]
    put_angular(force, add3(take3(force, 3), cross(p, acc)))
    if r == 0:
        put3(force, add3(get3(force), scaled3(root, acc)))
    for b in range(0, n, WIDTH):
        dp, rate_q = rows3(bends.dp[end], c, b), rows3(bends.rate_q[end], c, b)
        by_q = add3(times(S, dp), scaled3(2.0, cross(w, rate_q)))
        by_q = add3(by_q, rows3(bends.acceleration_q[end], c, b))
        by_qd = scaled3(2.0, add3(cross(w, dp), rate_q))
        put_rows3(own.acc_q, c, b, by_q)
        put_rows3(own.acc_qd, c, b, by_qd)
        torque = add3(rows3(own.by_q[s], 3, b), add3(cross(p, by_q), cross(dp, acc)))
        put_rows3(own.by_q[s], 3, b, torque)
        put_rows3(own.by_qd[s], 3, b, add3(rows3(own.by_qd[s], 3, b), cross(p, by_qd)))
        if r == 0:
            put_rows3(own.by_q[s], 0, b, add3(rows3(own.by_q[s], 0, b), scaled3(root, by_q)))
            put_rows3(own.by_qd[s], 0, b, add3(rows3(own.by_qd[s], 0, b), scaled3(root, by_qd)))
    for axis in range(3):
        _particle_spin(own, bends, end, n, c, axis, p, pd, w, root if r == 0 else 0.0)


@compile_inline
def _particle_spin(own, bends, end, n, c, axis, p, pd, w, root):
    """Add the derivative of an affine function's forces by the spin about an axis."""
    x = scaled3(-2.0, cross(pd, unit3(axis)))
    x = axpy3(axpy3(x, p[axis], w), -2.0 * w[axis], p)
    x = axpy3(x, dot3(w, p), unit3(axis))
    out = own.by_spin[axis]
    put3(out, axpy3(get3(out), root, x))
    put_angular(out, add3(take3(out, 3), cross(p, x)))
    for m in range(n):
        out[6 + m] += x[0] * bends.dp[end, c, m] + x[1] * bends.dp[end, c + 1, m] + x[2] * bends.dp[end, c + 2, m]


@compile_inline
def _on_modes(own, bends, end, s, m, n):
    """Add the forces of the affine part on mode m, and their derivatives but for its curvature."""
    force = 0.0
    for c in range(12):
        force += bends.dp[end, c, m] * bends.acceleration[end, c]
    own.force[s, 6 + m] += force
    for b in range(0, n, WIDTH):
        x, y = get_lanes(own.by_q[s, 6 + m], b), get_lanes(own.by_qd[s, 6 + m], b)
        for c in range(12):
            dp = bends.dp[end, c, m]
            x = x + dp * get_lanes(own.acc_q[c], b)
            y = y + dp * get_lanes(own.acc_qd[c], b)
        put_lanes(own.by_q[s, 6 + m], b, x)
        put_lanes(own.by_qd[s, 6 + m], b, y)


@compile_inline
def _rest(modal, model, own, i, S, W, w):
    """Write what the rest of the motion, ``phi' eta(q)``, does; a body with T by eta first, then by q."""
    s = model.links[i].slot
    n = model.links[i].modes
    grows = model.links[i].modal_mass == GROWS
    _eta(modal, model, own, i, n, grows)
    P = modal.integrals.P_rest[model.links[i].kind]
    M = modal.integrals.M_rest[model.links[i].kind]
    for order in range(3):
        for b in range(0, n, WIDTH):
            _put_rows9(own.P_eta[order], b, combined9(P, own.eta[order], n, b))
    X = dots9(own.P_eta[0], own.eta[0], n)
    if model.links[i].stations >= 0:
        X = add9(X, _add_strains(own, model.modal.parts.H_rest[model.links[i].kind], modal.q[s], n))
    Xd = dots9(own.P_eta[0], own.eta[1], n)
    Xdd = dots9(own.P_eta[0], own.eta[2], n)
    torque = add3(antisymmetric(add9(product(S, X), Xdd)), scaled3(2.0, antisymmetric(product(W, Xd))))
    put_angular(own.force[s], torque)
    for b in range(0, n, WIDTH):
        _rest_rows(own, M, S, W, b, n)
    for axis in range(3):
        put_angular(own.by_spin[axis], _rest_spin_torque(X, Xd, w, axis))
    _rest_modal_spin(own, w, n)
    _rest_by_eta(own, P, transposed(S), transposed(W), n)
    if grows:
        _by_q(model, own, M, i, s, n)
    else:
        _by_eta_is_by_q(own, s, n)


@compile_inline
def _add_strains(own, H, q, n):
    """Add the mean strains of the parts, which the rest of the modes feels: of the place ``x0 + phi' q``.

    Returns what is missing of ``int x x``, its two products with x0.
    """
    for b in range(0, n, WIDTH):
        _put_rows9(own.P_eta[0], b, add9(rows9(own.P_eta[0], b), rows9(H, b)))
    moved = dots9(H, q, n)
    return add9(moved, transposed(moved))


@compile_inline
def _put_rows9(x, b, v):
    """Write nine rows."""
    put_rows6(x, 0, b, v[:6])
    put_rows3(x, 6, b, v[6:])


@compile_inline
def _eta(modal, model, own, i, n, grows):
    """Write eta(q) and its two rates; of a body with T also the derivatives of each by q, q' and q''."""
    s = model.links[i].slot
    q, qd, qdd = modal.q[s], modal.qd[s], modal.qdd[s]
    for a in range(n):
        own.eta[0, a], own.eta[1, a], own.eta[2, a] = q[a], qd[a], qdd[a]
    if not grows:
        return
    c = model.modal.c[model.links[i].kind]
    for a in range(n):
        for b in range(n):
            x, y, z = 0.0, 0.0, 0.0
            for j in range(n):
                x += q[j] * c[j, a, b]
                y += qd[j] * c[j, a, b]
                z += qdd[j] * c[j, a, b]
            own.slope[0, a, b], own.slope[1, a, b], own.slope[2, a, b] = x, y, z
            own.eta[0, a] += 0.5 * x * q[b]
            own.eta[1, a] += x * qd[b]
            own.eta[2, a] += x * qdd[b] + y * qd[b]
        own.slope[0, a, a] += 1.0


@compile_inline
def _rest_rows(own, M, S, W, b, n):
    """Write the torque by four of eta and its rates, and the force on them."""
    P = rows9(own.P_eta[0], b)
    Pd = rows9(own.P_eta[1], b)
    Pdd = rows9(own.P_eta[2], b)
    WP = product(W, P)
    by_eta = product(S, add9(P, transposed(P)))
    by_eta = add9(axpy9(by_eta, 2.0, product(W, transposed(Pd))), transposed(Pdd))
    put_rows3(own.rest, 0, b, antisymmetric(by_eta))
    put_rows3(own.rest, 3, b, scaled3(2.0, antisymmetric(WP)))
    put_rows3(own.rest, 6, b, antisymmetric(P))
    force = four(0.0)
    for c in range(n):
        force = force + own.eta[2, c] * get_lanes(M[c], b)
    put_lanes(own.modal, b, force + dot9(S, P) + 2.0 * dot9(W, Pd))


@compile_inline
def dot9(a, b):
    """Return the sum of the products of nine numbers."""
    return dot3(a[:3], b[:3]) + dot3(a[3:6], b[3:6]) + dot3(a[6:], b[6:])


@compile_inline
def _turning(w, axis, X):
    """Return ``tr(X (e~ w~ + w~ e~)')`` of a matrix X and the direction e of an axis."""
    e = unit3(axis)
    across = dot3(w, times(X, e)) + dot3(e, times(X, w))
    return across - 2.0 * w[axis] * (X[0] + X[4] + X[8])


@compile_inline
def _rest_spin_torque(X, Xd, w, axis):
    """Return the derivative of the torque by the spin about an axis."""
    E, W = spin_matrix(unit3(axis)), spin_matrix(w)
    turning = product(add9(product(E, W), product(W, E)), X)
    return antisymmetric(axpy9(turning, 2.0, product(E, Xd)))


@compile_inline
def _rest_modal_spin(own, w, n):
    """Write the derivatives of the forces on eta by the spin."""
    for b in range(0, n, WIDTH):
        P, bending = rows9(own.P_eta[0], b), antisymmetric(rows9(own.P_eta[1], b))
        for axis in range(3):
            put_lanes(own.by_spin[axis, 6:], b, _turning(w, axis, P) + 2.0 * bending[axis])


@compile_inline
def _rest_by_eta(own, P, S, W, n):
    """Write the derivatives of the forces on eta by eta and its rate; S and W are transposed."""
    for a in range(n):
        for b in range(0, n, WIDTH):
            row = rows9(P[a], b)
            put_lanes(own.by_eta[0, a], b, dot9(S, row))
            put_lanes(own.by_eta[1, a], b, 2.0 * dot9(W, row))


@compile_inline
def _by_eta_is_by_q(own, s, n):
    """Add what was found by eta, where that is q."""
    for b in range(0, n, WIDTH):
        put_rows3(own.by_q[s], 3, b, rows3(own.rest, 0, b))
        put_rows3(own.by_qd[s], 3, b, rows3(own.rest, 3, b))
        for a in range(n):
            put_lanes(own.by_q[s, 6 + a], b, get_lanes(own.by_eta[0, a], b))
            put_lanes(own.by_qd[s, 6 + a], b, get_lanes(own.by_eta[1, a], b))
    for a in range(n):
        own.force[s, 6 + a] = own.modal[a]


@compile_inline
def _by_q(model, own, M, i, s, n):
    """Add what was found by eta, as derivatives by q."""
    c = model.modal.c[model.links[i].kind]
    slope, growing, rising = own.slope[0], own.slope[1], own.slope[2]
    for r in range(3):
        for b in range(n):
            x, y = 0.0, 0.0
            for a in range(n):
                x += (
                    own.rest[r, a] * slope[a, b]
                    + own.rest[3 + r, a] * growing[a, b]
                    + own.rest[6 + r, a] * rising[a, b]
                )
                y += own.rest[3 + r, a] * slope[a, b] + 2.0 * own.rest[6 + r, a] * growing[a, b]
            own.by_q[s, 3 + r, b], own.by_qd[s, 3 + r, b] = x, y
    for a in range(n):
        for b in range(n):
            x, y = 0.0, 0.0
            for j in range(n):
                x += own.by_eta[0, a, j] * slope[j, b] + own.by_eta[1, a, j] * growing[j, b] + M[a, j] * rising[j, b]
                y += own.by_eta[1, a, j] * slope[j, b] + 2.0 * M[a, j] * growing[j, b]
            own.product[0, a, b], own.product[1, a, b] = x, y
    for a in range(n):
        for b in range(n):
            x, y = 0.0, 0.0
            for j in range(n):
                x += slope[j, a] * own.product[0, j, b] + own.modal[j] * c[a, j, b]
                y += slope[j, a] * own.product[1, j, b]
            own.by_q[s, 6 + a, b], own.by_qd[s, 6 + a, b] = x, y
    for a in range(n):
        own.force[s, 6 + a] = along_column(slope, a, own.modal, n)
    for axis in range(3):
        for a in range(n):
            own.modal[a] = own.by_spin[axis, 6 + a]
        for a in range(n):
            own.by_spin[axis, 6 + a] = along_column(slope, a, own.modal, n)


@compile_inline
def along_column(A, a, f, n):
    """Return the product of a column with n numbers."""
    total = 0.0
    for j in range(n):
        total += A[j, a] * f[j]
    return total
