"""The part of the order-n kernel that concerns modes: theory 4 and 5."""

from __future__ import annotations

from modalprep.body import mass
from modalprep.jit import compile_inline
from modalprep.multibody.kernels.data import (
    H_,
    HAS_KG,
    IA,
    J_,
    KIND,
    MASS,
    MODES,
    NODES,
    OMEGA,
    PA,
    SLOT,
    UQ,
    XQ,
    A,
)
from modalprep.multibody.kernels.modal_mass import GROWS, apply_slopes, grown_mass, rest_coordinates
from modalprep.multibody.kernels.spatial import (
    ZERO6,
    ZERO8,
    ZERO9,
    add3,
    add6,
    add8,
    add9,
    axpy3,
    axpy6,
    axpy8,
    axpy9,
    cayley,
    cayley_rate,
    cross,
    dot3,
    dot8,
    dot12,
    get3,
    get6,
    get8,
    get12,
    half_tangent,
    half_tangent_rate,
    inertia_times,
    product_transposed,
    put3,
    put6,
    put8,
    put9,
    row8,
    take6,
    take9,
    take12,
    times,
)

shortening = compile_inline(mass.shortening)


@compile_inline
def expand(tree, flex, F, i):
    """Write dp(q), ``D q'``, ``P' q`` and the gyroscopic products with q' of link i's body to F.

    F.affine gets p(q), its rate and, without q'', its acceleration, then t and its rate.
    """
    k, s, n = tree.ints[i, KIND], tree.ints[i, SLOT], tree.ints[i, MODES]
    for r in range(12 * n):
        F.dp[r], F.Dqd[r] = 0.0, 0.0
    for r in range(9 * n):
        F.rest[r] = 0.0
    for r in range(3 * n):
        F.gyro[r] = 0.0
    rest_coordinates(tree, flex, F, i)
    for b in range(0, n, 4):  # rows are filled up with zeros; four at once spare the loads and stores of the sums
        f0, f1, f2, f3 = F.q[s, b], F.q[s, b + 1], F.q[s, b + 2], F.q[s, b + 3]
        g0, g1, g2, g3 = F.qd[s, b], F.qd[s, b + 1], F.qd[s, b + 2], F.qd[s, b + 3]
        if tree.ints[i, HAS_KG]:
            for r in range(12 * n):
                d0, d1, d2, d3 = (
                    flex.by_q[k, b, r],
                    flex.by_q[k, b + 1, r],
                    flex.by_q[k, b + 2, r],
                    flex.by_q[k, b + 3, r],
                )
                F.dp[r] += f0 * d0 + f1 * d1 + f2 * d2 + f3 * d3
                F.Dqd[r] += g0 * d0 + g1 * d1 + g2 * d2 + g3 * d3
        f0, f1, f2, f3 = F.eta[0, b], F.eta[0, b + 1], F.eta[0, b + 2], F.eta[0, b + 3]
        g0, g1, g2, g3 = F.eta[1, b], F.eta[1, b + 1], F.eta[1, b + 2], F.eta[1, b + 3]
        for r in range(9 * n):
            F.rest[r] += f0 * flex.rest[k, b, r] + f1 * flex.rest[k, b + 1, r]
            F.rest[r] += f2 * flex.rest[k, b + 2, r] + f3 * flex.rest[k, b + 3, r]
        for r in range(3 * n):
            F.gyro[r] += g0 * flex.gyro[k, b, r] + g1 * flex.gyro[k, b + 1, r]
            F.gyro[r] += g2 * flex.gyro[k, b + 2, r] + g3 * flex.gyro[k, b + 3, r]
    for c in range(12):
        p, pd, t, td, tdd = flex.place[k, c], 0.0, 0.0, 0.0, 0.0
        for a in range(n):
            f, g, base, bent = F.q[s, a], F.qd[s, a], flex.base[k, 12 * a + c], F.dp[12 * a + c]
            p, pd = p + f * base, pd + g * base
            t, td, tdd = t + 0.5 * f * bent, td + g * bent, tdd + g * F.Dqd[12 * a + c]
        F.affine[0, c], F.affine[1, c], F.affine[2, c], F.affine[3, c], F.affine[4, c] = p, pd, tdd, t, td
    tau, speed, change = 0.0, 0.0, 0.0
    for c in range(12):
        f = flex.place[k, 12 + c]
        tau, speed, change = tau + f * F.affine[3, c], speed + f * F.affine[4, c], change + f * F.affine[2, c]
    g, slope, curvature = shortening(tau)
    change = curvature * speed * speed + slope * change
    for c in range(12):
        t, td = F.affine[3, c], F.affine[4, c]
        F.affine[0, c] += g * t
        F.affine[1, c] += g * td + slope * speed * t
        F.affine[2, c] = g * F.affine[2, c] + 2.0 * slope * speed * td + change * t
    for a in range(n):
        f = 0.0
        for c in range(12):
            f += flex.place[k, 12 + c] * F.dp[12 * a + c]
        for c in range(12):
            F.dp[12 * a + c] = flex.base[k, 12 * a + c] + g * F.dp[12 * a + c] + slope * f * F.affine[3, c]


@compile_inline
def mode_moments(tree, flex, F, i, p, a):
    """Return S_a(q) (3) and L_ab(q) (9) of mode a of link i's body, after `expand`, which gave p."""
    d, e, root = take12(F.dp, 12 * a), take9(F.rest, 9 * a), flex.place[tree.ints[i, KIND], 24]
    L = product_transposed((d[0], d[3], d[6], d[1], d[4], d[7], d[2], d[5], d[8]),
                           (p[0], p[3], p[6], p[1], p[4], p[7], p[2], p[5], p[8]))  # fmt: skip
    x, y, z = d[9], d[10], d[11]
    last = (x * p[9], x * p[10], x * p[11], y * p[9], y * p[10], y * p[11], z * p[9], z * p[10], z * p[11])
    return (root * d[0], root * d[1], root * d[2]), add9(add9(L, last), e)


@compile_inline
def own_flexible(tree, flex, W, F, i, nx, y):
    """Write link i's own inertia and bias to W and F: the equations of one body, see body/mass.py and dense.py."""
    k, s, n = tree.ints[i, KIND], tree.ints[i, SLOT], tree.ints[i, MODES]
    for a in range(n):
        F.q[s, a] = y[tree.ints[i, XQ] + a]
        F.qd[s, a] = y[nx + tree.ints[i, UQ] + a]
        F.load[s, a] = 0.0
    w, m, root = get3(W, i, OMEGA), tree.fixed[i, MASS], flex.place[k, 24]
    expand(tree, flex, F, i)
    p, rates, second = get12(F.affine, 0, 0), get12(F.affine, 1, 0), get12(F.affine, 2, 0)
    E, Y = ZERO9, ZERO9
    for a in range(n):
        rest = take9(F.rest, 9 * a)
        E, Y = axpy9(E, F.eta[0, a], rest), axpy9(Y, F.eta[1, a], rest)
    grows = tree.ints[i, HAS_KG] == GROWS
    growing = (0.0, 0.0, 0.0)
    if grows:
        growing = apply_slopes(tree, flex, F, i)
    f0, t0 = _affine_force(w, p[:3], rates[:3], second[:3])
    f1, t1 = _affine_force(w, p[3:6], rates[3:6], second[3:6])
    f2, t2 = _affine_force(w, p[6:9], rates[6:9], second[6:9])
    f3, t3 = _affine_force(w, p[9:], rates[9:], second[9:])
    ww = dot3(w, w)
    for a in range(n):
        d, e = take12(F.dp, 12 * a), take9(F.rest, 9 * a)
        # w~ w~ = w w^T - w.w, 2 w~_ab P'_ab q' = 2 w_c eps_cab P'_ba q'
        f = w[0] * (w[0] * e[0] + w[1] * e[1] + w[2] * e[2])
        f += w[1] * (w[0] * e[3] + w[1] * e[4] + w[2] * e[5])
        f += w[2] * (w[0] * e[6] + w[1] * e[7] + w[2] * e[8]) - ww * (e[0] + e[4] + e[8])
        f += 2.0 * (w[0] * F.gyro[3 * a] + w[1] * F.gyro[3 * a + 1] + w[2] * F.gyro[3 * a + 2])
        f += dot3(f0, d[:3]) + dot3(f1, d[3:6]) + dot3(f2, d[6:9]) + dot3(f3, d[9:])
        f += flex.diagonal[k, a, 0] * F.q[s, a] + flex.diagonal[k, a, 1] * F.qd[s, a]
        if grows:
            f += F.turned[9, a]
        c = add3(add3(cross(p[:3], d[:3]), cross(p[3:6], d[3:6])), add3(cross(p[6:9], d[6:9]), cross(p[9:], d[9:])))
        c = add3(c, (e[7] - e[5], e[2] - e[6], e[3] - e[1]))
        put8(F.Z, s, a, 0, (root * d[0], root * d[1], root * d[2], c[0], c[1], c[2], f, 0.0))
    _own_modal_mass(tree, flex, F, i)
    torque = add3(add3(add3(t0, t1), add3(t2, t3)), add3(_rest_torque(w, E, Y), growing))
    E = (
        E[0] + p[0] * p[0] + p[3] * p[3] + p[6] * p[6] + p[9] * p[9],
        E[1] + p[0] * p[1] + p[3] * p[4] + p[6] * p[7] + p[9] * p[10],
        E[2] + p[0] * p[2] + p[3] * p[5] + p[6] * p[8] + p[9] * p[11],
        E[4] + p[1] * p[1] + p[4] * p[4] + p[7] * p[7] + p[10] * p[10],
        E[5] + p[1] * p[2] + p[4] * p[5] + p[7] * p[8] + p[10] * p[11],
        E[8] + p[2] * p[2] + p[5] * p[5] + p[8] * p[8] + p[11] * p[11],
    )
    put6(W, i, IA, (m, 0.0, 0.0, m, 0.0, m))
    put9(
        W, i, H_,
        (0.0, root * p[2], -root * p[1], -root * p[2], 0.0, root * p[0], root * p[1], -root * p[0], 0.0),
    )  # fmt: skip
    put6(W, i, J_, (E[3] + E[5], -E[1], -E[2], E[0] + E[5], -E[4], E[0] + E[3]))
    put3(W, i, PA, (root * f0[0], root * f0[1], root * f0[2]))
    put3(W, i, PA + 3, torque)


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
def _own_modal_mass(tree, flex, F, i):
    """Write link i's own M_ff to F.Z: ``d eta^T (1 - B^T B) d eta + dp^T dp``, 1 without geometric stiffness."""
    k, s, n = tree.ints[i, KIND], tree.ints[i, SLOT], tree.ints[i, MODES]
    for a in range(n):
        for b in range(n + 7 >> 3):
            put8(F.Z, s, a, 1 + b, ZERO8)
        F.Z[s, a, 1 + (a >> 3), a & 7] = 1.0
    if tree.ints[i, HAS_KG]:
        for a in range(n):
            d = take12(F.dp, 12 * a)
            for b in range(a, n):
                F.Z[s, a, 1 + (b >> 3), b & 7] = flex.mass[k, a, b] + dot12(d, take12(F.dp, 12 * b))
    if tree.ints[i, HAS_KG] == GROWS:
        grown_mass(flex, F, k, s, n)


@compile_inline
def node_shape(tree, flex, F, p, node, slot):
    """Write the partial velocities of an interface of link p's body to row `slot` of F.Phi, rotations as ``psi(q)``.

    Returns the displacement and ``psi q`` (8), their rates, and ``-q' Kg q'``: 3 + 3 numbers each.
    """
    s, n, row = tree.ints[p, SLOT], tree.ints[p, MODES], tree.ints[p, NODES] + node
    for r in range(6 * n):
        F.phi[r], F.turn[r] = flex.shape[row, r], 0.0
    if tree.ints[p, HAS_KG]:
        for b in range(n):
            f, g = F.q[s, b], F.qd[s, b]
            for r in range(6 * n):
                F.phi[r] -= f * flex.Kg_node[row, b, r]
                F.turn[r] -= g * flex.Kg_node[row, b, r]
    moved, rates, second = ZERO6, ZERO6, ZERO6
    for a in range(n):
        phi = take6(F.phi, 6 * a)
        moved = axpy6(moved, 0.5 * F.q[s, a], add6(get6(flex.shape, row, 6 * a), phi))
        rates = axpy6(rates, F.qd[s, a], phi)
        second = axpy6(second, F.qd[s, a], take6(F.turn, 6 * a))
        for c in range(6):
            F.Phi[slot, a, c] = phi[c]
    return moved, rates, second


@compile_inline
def turn_shape(F, slot, n, x, s, offset):
    """Turn the rows ``psi(q)`` of F.Phi to angular velocities and move the point by `offset`; fill F.PhiT."""
    argument = half_tangent(x)
    for a in range(n):
        phi = row8(F.Phi, slot, a)
        t = cayley_rate(argument, s, half_tangent_rate(x, (phi[3], phi[4], phi[5])))
        v = add3((phi[0], phi[1], phi[2]), cross(t, offset))
        for c in range(3):
            F.Phi[slot, a, c], F.Phi[slot, a, 3 + c] = v[c], t[c]
            F.PhiT[slot, c, a >> 3, a & 7], F.PhiT[slot, 3 + c, a >> 3, a & 7] = v[c], t[c]


@compile_inline
def node_motion(tree, flex, W, F, p, node, slot, arm):
    """Motion of an interface of a flexible body in its link's axes, F.Phi before `turn_shape`.

    Returns the position, the rotation of the node, its rotation vector ``psi q`` and the s of its Cayley map, the
    elastic velocity and spin, and the acceleration (linear, angular) that remains when A and q'' are zero.
    """
    moved, rates, second = node_shape(tree, flex, F, p, node, slot)
    w = get3(W, p, OMEGA)
    turn, turning = (moved[3], moved[4], moved[5]), (rates[3], rates[4], rates[5])
    x, xd = half_tangent(turn), half_tangent_rate(turn, turning)
    xdd = half_tangent_rate(turn, (second[3], second[4], second[5]))
    xdd = axpy3(axpy3(xdd, dot3(turn, turning) / 3.0, turning), dot3(turning, turning) / 6.0, turn)
    R, s = cayley(x)
    r, v, t = add3(arm, (moved[0], moved[1], moved[2])), (rates[0], rates[1], rates[2]), cayley_rate(x, s, xd)
    linear = add3(cross(w, axpy3(cross(w, r), 2.0, v)), (second[0], second[1], second[2]))
    angular = add3(cayley_rate(x, s, xdd), cross(w, t))
    return r, R, turn, s, v, t, linear, axpy3(angular, -0.5 * s * dot3(x, xd), t)


@compile_inline
def elastic_acceleration(F, slot, n, s):
    """Return the sum of F.Phi[slot] times q'' (linear, angular)."""
    v = ZERO8
    for a in range(n):
        v = axpy8(v, F.qdd[s, a >> 3, a & 7], row8(F.Phi, slot, a))
    return (v[0], v[1], v[2]), (v[3], v[4], v[5])


@compile_inline
def add_to_modes(F, slot, s, n, M, H, J, p, r):
    """Add ``[T Phi]^T I [T Phi]`` and ``[T Phi]^T p`` of a child to its parent's modal rows; r is its arm."""
    blocks = n + 7 >> 3
    for a in range(n):
        phi = row8(F.Phi, slot, a)
        c = inertia_times(M, H, J, (phi[0], phi[1], phi[2], phi[3], phi[4], phi[5]))
        f, t = (c[0], c[1], c[2]), (c[3], c[4], c[5])
        t = add3(t, cross(r, f))
        b = dot8(phi, (p[0], p[1], p[2], p[3], p[4], p[5], 0.0, 0.0))
        put8(F.Z, s, a, 0, add8(get8(F.Z, s, a, 0), (f[0], f[1], f[2], t[0], t[1], t[2], b, 0.0)))
        for k in range(a >> 3, blocks):
            row = get8(F.Z, s, a, 1 + k)
            row = axpy8(axpy8(row, c[0], get8(F.PhiT, slot, 0, k)), c[1], get8(F.PhiT, slot, 1, k))
            row = axpy8(axpy8(row, c[2], get8(F.PhiT, slot, 2, k)), c[3], get8(F.PhiT, slot, 3, k))
            row = axpy8(axpy8(row, c[4], get8(F.PhiT, slot, 4, k)), c[5], get8(F.PhiT, slot, 5, k))
            put8(F.Z, s, a, 1 + k, row)


@compile_inline
def eliminate_modes(tree, flex, W, F, i, c1, c2):
    """Condense link i's modes into W: ``I_A = M_rr - M_rf M_ff^-1 M_fr``; False when a pivot is not positive."""
    k, s, n = tree.ints[i, KIND], tree.ints[i, SLOT], tree.ints[i, MODES]
    for a in range(n):
        F.Z[s, a, 1 + (a >> 3), a & 7] += c1 * flex.diagonal[k, a, 1] + c2 * flex.diagonal[k, a, 0]
        F.Z[s, a, 0, 6] -= F.load[s, a]
    for a in range(n):
        d = F.Z[s, a, 1 + (a >> 3), a & 7]
        if not d > 0.0:
            return False
        g = 1.0 / d
        row = get8(F.Z, s, a, 0)
        for b in range(a + 1, n):
            f = F.Z[s, a, 1 + (b >> 3), b & 7] * g
            put8(F.Z, s, b, 0, axpy8(get8(F.Z, s, b, 0), -f, row))
        for k in range(1 + (a >> 3), 1 + (n + 7 >> 3)):
            right = get8(F.Z, s, a, k)
            for b in range(a + 1, min(n, 8 * k)):
                f = F.Z[s, a, 1 + (b >> 3), b & 7] * g
                put8(F.Z, s, b, k, axpy8(get8(F.Z, s, b, k), -f, right))
        condense(W, i, g, row)
        F.Z[s, a, 0, 7] = g
    return True


@compile_inline
def condense(W, i, g, v):
    """Take ``g v v^T`` off the articulated inertia of link i, and ``g v v[6]`` off its bias."""
    x, y, z = g * v[0], g * v[1], g * v[2]
    M, J = get6(W, i, IA), get6(W, i, J_)
    put6(
        W, i, IA, (M[0] - x * v[0], M[1] - x * v[1], M[2] - x * v[2], M[3] - y * v[1], M[4] - y * v[2], M[5] - z * v[2])
    )
    for c in range(3):
        W[i, H_ + c] -= x * v[3 + c]
        W[i, H_ + 3 + c] -= y * v[3 + c]
        W[i, H_ + 6 + c] -= z * v[3 + c]
    x, y, z = g * v[3], g * v[4], g * v[5]
    put6(
        W, i, J_, (J[0] - x * v[3], J[1] - x * v[4], J[2] - x * v[5], J[3] - y * v[4], J[4] - y * v[5], J[5] - z * v[5])
    )
    condense_bias(W, i, g, v)


@compile_inline
def condense_bias(W, i, g, v):
    """Take ``g v v[6]`` off the bias of link i."""
    f = g * v[6]
    for c in range(6):
        W[i, PA + c] -= f * v[c]


@compile_inline
def eliminate_load(tree, W, F, i):
    """Condense a new modal bias (column b_f of F.Z) of link i with the pivots of `eliminate_modes`."""
    s, n = tree.ints[i, SLOT], tree.ints[i, MODES]
    for a in range(n):
        row = get8(F.Z, s, a, 0)
        for b in range(a + 1, n):
            F.Z[s, b, 0, 6] -= F.Z[s, a, 1 + (b >> 3), b & 7] * row[7] * row[6]
        condense_bias(W, i, row[7], row)


@compile_inline
def modal_accelerations(tree, W, F, i, udot):
    """Solve for q'' of link i from its A: back substitution."""
    s, n, u = tree.ints[i, SLOT], tree.ints[i, MODES], tree.ints[i, UQ]
    at = get6(W, i, A)
    blocks = n + 7 >> 3
    for k in range(blocks):
        for c in range(8):
            F.qdd[s, k, c] = 0.0
    for a in range(n - 1, -1, -1):
        row = get8(F.Z, s, a, 0)
        v = dot8(row, (at[0], at[1], at[2], at[3], at[4], at[5], 1.0, 0.0))
        for k in range(a >> 3, blocks):
            v += dot8(get8(F.Z, s, a, 1 + k), row8(F.qdd, s, k))
        v = -v * row[7]
        F.qdd[s, a >> 3, a & 7] = v
        udot[u + a] = v
