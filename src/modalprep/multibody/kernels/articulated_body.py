"""Order-n forward dynamics of a tree of rigid and flexible bodies: theory 4 and 5.

One evaluation: `outward`, [`world`, loads by `add_wrench`,] `inward`, `forward`, `kinematic`; `derivative` is all of
them for a system without loads. Cost linear in the links. Nothing is allocated or raised: a pivot that is not
positive is returned as its link's number, -1 otherwise. `dense.py` is the readable twin.

Arguments, the same in all functions (see layout.py): `tree` Tree, `flex` Flex or None, `W (nl + 1, 99)` scratch, `F`
Scratch or None, `y (nx + nu,)` state, `motion (nl, 3)` position, rate and acceleration of prescribed hinges,
`tau (nu,)` hinge forces (modal rows unused). Spatial vectors are (linear, angular), in the link's frame; A is the
specific acceleration of the link's origin (acceleration minus gravity). R maps link to parent-link axes.
"""

from __future__ import annotations

from modalprep.jit import compile_inline, compile_kernel, compile_pass
from modalprep.multibody.kernels.data import (
    ALIGN,
    ARM,
    ARM0,
    BIAS,
    FIRST,
    FREE,
    H_,
    IA,
    INERTIA,
    J_,
    JOINT,
    MASS,
    MODES,
    NODE,
    NODES,
    NX,
    OMEGA,
    PA,
    PARENT,
    PHI,
    PIVOT,
    POSITION,
    PRESCRIBED_PRISMATIC,
    PRESCRIBED_REVOLUTE,
    PRISMATIC,
    REVOLUTE,
    ROTATION,
    SLIDE,
    SLOT,
    SPHERICAL,
    UQ,
    VELOCITY,
    WRENCH,
    XQ,
    A,
    C,
    R,
    Tree,
    U,
    X,
)
from modalprep.multibody.kernels.modal import (
    add_to_modes,
    elastic_acceleration,
    eliminate_load,
    eliminate_modes,
    modal_accelerations,
    node_motion,
    own_flexible,
    turn_shape,
)
from modalprep.multibody.kernels.spatial import (
    ZERO3,
    ZERO6,
    add3,
    add6,
    add9,
    axpy3,
    cross,
    dot3,
    get3,
    get6,
    get9,
    hinged_times,
    inertia_times,
    inverse_symmetric,
    less_outer,
    product,
    product_transposed,
    put3,
    put6,
    put9,
    quaternion_rate,
    quaternion_rotation,
    rotated_hinged,
    rotated_inertia,
    shifted,
    square,
    sub6,
    symmetric_product,
    symmetric_times,
    times,
    transposed_times,
    turned,
)


@compile_pass
def outward(tree, flex, W, F, y, motion):
    """Kinematics of every link, its own inertia and bias, root to tips; external wrenches and modal loads to zero."""
    nx = tree.ints[0, NX]
    for i in range(len(tree.ints)):
        p, joint, x, u = tree.ints[i, PARENT], tree.ints[i, JOINT], tree.ints[i, X], nx + tree.ints[i, U]
        turn, arm, wP = get9(tree.fixed, i, C), get3(tree.fixed, i, ARM0), get3(W, p, OMEGA)
        # the hinge frame: angular velocity, and the acceleration left when A and q'' of the parent are zero
        wF, linear, angular = wP, cross(wP, cross(wP, arm)), ZERO3
        shape, scale, slide, t = ZERO3, 1.0, ZERO3, ZERO3
        if flex is not None:
            if tree.ints[i, PHI] >= 0:
                arm, node, shape, scale, slide, t, linear, angular = node_motion(
                    tree, flex, W, F, p, tree.ints[i, NODE], tree.ints[i, PHI], arm
                )
                turn, wF = product(node, turn), add3(wP, t)
        offset, rate, spin, extra = ZERO3, ZERO3, ZERO3, ZERO6
        if joint == REVOLUTE:
            turn, spin = turned(turn, y[x]), (0.0, 0.0, y[u])
        elif joint == PRISMATIC:
            offset, rate = times(turn, (0.0, 0.0, y[x])), (0.0, 0.0, y[u])
        elif joint == SPHERICAL:
            turn = product(turn, quaternion_rotation((y[x], y[x + 1], y[x + 2], y[x + 3])))
            spin = (y[u], y[u + 1], y[u + 2])
        elif joint == FREE:
            offset = times(turn, (y[x], y[x + 1], y[x + 2]))
            turn = product(turn, quaternion_rotation((y[x + 3], y[x + 4], y[x + 5], y[x + 6])))
            rate, spin = (y[u], y[u + 1], y[u + 2]), (y[u + 3], y[u + 4], y[u + 5])
            c = cross(spin, rate)
            extra = (c[0], c[1], c[2], 0.0, 0.0, 0.0)
        elif joint == PRESCRIBED_REVOLUTE:
            turn, spin = turned(turn, motion[i, 0]), (0.0, 0.0, motion[i, 1])
            extra = (0.0, 0.0, 0.0, 0.0, 0.0, motion[i, 2])
        elif joint == PRESCRIBED_PRISMATIC:
            offset, rate = times(turn, (0.0, 0.0, motion[i, 0])), (0.0, 0.0, motion[i, 1])
            extra = (0.0, 0.0, motion[i, 2], 0.0, 0.0, 0.0)
        if joint != REVOLUTE:
            rate = times(turn, rate)
            moved = axpy3(cross(wF, offset), 2.0, rate)
            linear = add3(add3(linear, cross(angular, offset)), cross(wF, moved))
            slide = add3(add3(slide, cross(t, offset)), rate)
        if flex is not None:
            if tree.ints[i, PHI] >= 0:
                turn_shape(F, tree.ints[i, PHI], tree.ints[p, MODES], shape, scale, offset)
        w = add3(transposed_times(turn, wF), spin)
        bias, own = transposed_times(turn, linear), add3(transposed_times(turn, angular), cross(w, spin))
        put9(W, i, R, turn)
        put3(W, i, ARM, add3(arm, offset))
        put3(W, i, SLIDE, slide)
        put3(W, i, OMEGA, w)
        put6(W, i, BIAS, add6((bias[0], bias[1], bias[2], own[0], own[1], own[2]), extra))
        put6(W, i, WRENCH, ZERO6)
        if flex is None:
            own_rigid(tree, W, i, w)
        elif tree.ints[i, SLOT] >= 0:
            own_flexible(tree, flex, W, F, i, nx, y)
        else:
            own_rigid(tree, W, i, w)


@compile_inline
def own_rigid(tree, W, i, w):
    """Write the inertia and bias of link i's rigid body, spinning at w, to W."""
    m, s, J = tree.fixed[i, MASS], get3(tree.fixed, i, FIRST), get6(tree.fixed, i, INERTIA)
    put6(W, i, IA, (m, 0.0, 0.0, m, 0.0, m))
    put9(W, i, H_, (0.0, s[2], -s[1], -s[2], 0.0, s[0], s[1], -s[0], 0.0))
    put6(W, i, J_, J)
    put3(W, i, PA, cross(w, cross(w, s)))
    put3(W, i, PA + 3, cross(w, symmetric_times(J, w)))


@compile_pass
def inward(tree, flex, W, F, tau, hinge, c1, c2):
    """Articulated inertias and biases, tips to root; returns the link whose pivot is not positive, else -1.

    Parameters
    ----------
    hinge : (nu,) or None
        Added to the hinges' inertias (an implicit integrator's damping and stiffness), modal rows unused.
    c1, c2 : float
        Modal rows get ``1 + c1 D + c2 K`` in place of 1; 0 for the accelerations.
    """
    for i in range(len(tree.ints) - 1, -1, -1):
        if flex is not None:
            if tree.ints[i, SLOT] >= 0:
                if not eliminate_modes(tree, flex, W, F, i, c1, c2):
                    return i
        p, joint, u = tree.ints[i, PARENT], tree.ints[i, JOINT], tree.ints[i, U]
        M, H, J = get6(W, i, IA), get9(W, i, H_), get6(W, i, J_)
        b, P = get6(W, i, BIAS), sub6(get6(W, i, PA), get6(W, i, WRENCH))
        put6(W, i, PA, P)
        turn = get9(W, i, R)
        if joint == REVOLUTE:
            d = J[5]
            if hinge is not None:
                d += hinge[u]
            if not d > 0.0:
                return i
            g = 1.0 / d
            W[i, PIVOT] = g
            if p < 0:
                continue
            f, t = (H[2], H[5], H[8]), (J[2], J[4], J[5])
            M, e = less_outer(M, g, f), g * (tau[u] - P[5])
            H = (
                H[0] - g * f[0] * t[0], H[1] - g * f[0] * t[1], f[0] - g * f[0] * t[2],
                H[3] - g * f[1] * t[0], H[4] - g * f[1] * t[1], f[1] - g * f[1] * t[2],
                H[6] - g * f[2] * t[0], H[7] - g * f[2] * t[1], f[2] - g * f[2] * t[2],
            )  # fmt: skip
            J = less_outer(J, g, t)
            P = add6(P, (e * f[0], e * f[1], e * f[2], e * t[0], e * t[1], e * t[2]))
        elif joint == PRISMATIC:
            d = M[5]
            if hinge is not None:
                d += hinge[u]
            if not d > 0.0:
                return i
            g = 1.0 / d
            W[i, PIVOT] = g
            f, t, e = (M[2], M[4], M[5]), (H[6], H[7], H[8]), g * (tau[u] - P[2])
            M, J = less_outer(M, g, f), less_outer(J, g, t)
            H = (
                H[0] - g * f[0] * t[0], H[1] - g * f[0] * t[1], H[2] - g * f[0] * t[2],
                H[3] - g * f[1] * t[0], H[4] - g * f[1] * t[1], H[5] - g * f[1] * t[2],
                H[6] - g * f[2] * t[0], H[7] - g * f[2] * t[1], H[8] - g * f[2] * t[2],
            )  # fmt: skip
            P = add6(P, (e * f[0], e * f[1], e * f[2], e * t[0], e * t[1], e * t[2]))
        elif joint == SPHERICAL:
            d = J
            if hinge is not None:
                d = (J[0] + hinge[u], J[1], J[2], J[3] + hinge[u + 1], J[4], J[5] + hinge[u + 2])
            g, pivots = inverse_symmetric(d)
            if not (pivots[0] > 0.0 and pivots[1] > 0.0 and pivots[2] > 0.0):
                return i
            put6(W, i, PIVOT, g)
            e = symmetric_times(g, (tau[u] - P[3], tau[u + 1] - P[4], tau[u + 2] - P[5]))
            f, t = times(H, e), symmetric_times(J, e)
            P = add6(P, (f[0], f[1], f[2], t[0], t[1], t[2]))
            HG, JG = product(H, square(g)), product(square(J), square(g))
            M = sub6(M, symmetric_product(HG, H))
            D = product(HG, square(J))
            H = (
                H[0] - D[0], H[1] - D[1], H[2] - D[2], H[3] - D[3], H[4] - D[4], H[5] - D[5], H[6] - D[6],
                H[7] - D[7], H[8] - D[8],
            )  # fmt: skip
            J = sub6(J, symmetric_product(JG, square(J)))
        elif joint == FREE:
            if not _factor(W, i, M, H, J, hinge, u):
                return i
            if p < 0:
                continue
            x = _solve(W, i, sub6(_six(tau, u), P))
            P = add6(P, inertia_times(M, H, J, x))
            M, H, J = _left_of_free(W, i, hinge, u)
        if p < 0:
            continue
        arm = get3(W, i, ARM)
        if hinge is None:
            if joint == REVOLUTE:  # the common case, at half the cost
                P = add6(P, hinged_times(M, H, J, b))
                M, H, J = rotated_hinged(turn, M, H, J)
            else:
                P = add6(P, inertia_times(M, H, J, b))
                M, H, J = rotated_inertia(turn, M, H, J)
        else:
            P = add6(P, inertia_times(M, H, J, b))
            M, H, J = rotated_inertia(turn, M, H, J)
        f, t = times(turn, (P[0], P[1], P[2])), times(turn, (P[3], P[4], P[5]))
        if flex is not None:
            if tree.ints[i, PHI] >= 0:
                add_to_modes(
                    F, tree.ints[i, PHI], tree.ints[p, SLOT], tree.ints[p, MODES], M, H, J,
                    (f[0], f[1], f[2], t[0], t[1], t[2]), arm,
                )  # fmt: skip
        H, J = shifted(M, H, J, arm)
        t = add3(t, cross(arm, f))
        put6(W, p, IA, add6(get6(W, p, IA), M))
        put9(W, p, H_, add9(get9(W, p, H_), H))
        put6(W, p, J_, add6(get6(W, p, J_), J))
        put6(W, p, PA, add6(get6(W, p, PA), (f[0], f[1], f[2], t[0], t[1], t[2])))
    return -1


@compile_inline
def _six(v, u):
    return v[u], v[u + 1], v[u + 2], v[u + 3], v[u + 4], v[u + 5]


@compile_kernel
def _factor(W, i, M, H, J, hinge, u):
    """Eliminate the whole articulated inertia of link i by rows in its PIVOT columns; False when not positive."""
    put6(W, i, PIVOT, (M[0], M[1], M[2], H[0], H[1], H[2]))
    put6(W, i, PIVOT + 6, (M[3], M[4], H[3], H[4], H[5], M[5]))
    put9(W, i, PIVOT + 12, (H[6], H[7], H[8], J[0], J[1], J[2], J[3], J[4], J[5]))
    start = PIVOT
    for a in range(6):
        if hinge is not None:
            W[i, start] += hinge[u + a]
        d = W[i, start]
        if not d > 0.0:
            return False
        row = start
        for b in range(1, 6 - a):
            row += 7 - a - b
            f = W[i, start + b] / d
            for c in range(b, 6 - a):
                W[i, row + c - b] -= f * W[i, start + c]
        start += 6 - a
    return True


@compile_kernel
def _solve(W, i, v):
    """Solve with the rows of `_factor`; the A columns of link i serve as scratch."""
    put6(W, i, A, v)
    start = PIVOT
    for a in range(6):
        for b in range(1, 6 - a):
            W[i, A + a + b] -= W[i, start + b] / W[i, start] * W[i, A + a]
        start += 6 - a
    for a in range(5, -1, -1):
        start -= 6 - a
        x = W[i, A + a]
        for b in range(1, 6 - a):
            x -= W[i, start + b] * W[i, A + a + b]
        W[i, A + a] = x / W[i, start]
    return get6(W, i, A)


@compile_kernel
def _left_of_free(W, i, hinge, u):
    """What a free hinge hands to its parent: ``h - h (I_A + h)^-1 h`` of the added hinge inertia h, else nothing."""
    zero9 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    if hinge is None:
        return ZERO6, zero9, ZERO6
    h = _six(hinge, u)
    a = _solve(W, i, (h[0], 0.0, 0.0, 0.0, 0.0, 0.0))
    b = _solve(W, i, (0.0, h[1], 0.0, 0.0, 0.0, 0.0))
    c = _solve(W, i, (0.0, 0.0, h[2], 0.0, 0.0, 0.0))
    d = _solve(W, i, (0.0, 0.0, 0.0, h[3], 0.0, 0.0))
    e = _solve(W, i, (0.0, 0.0, 0.0, 0.0, h[4], 0.0))
    f = _solve(W, i, (0.0, 0.0, 0.0, 0.0, 0.0, h[5]))
    M = (
        h[0] - h[0] * a[0], -h[0] * b[0], -h[0] * c[0], h[1] - h[1] * b[1], -h[1] * c[1], h[2] - h[2] * c[2],
    )  # fmt: skip
    H = (
        -h[0] * d[0], -h[0] * e[0], -h[0] * f[0], -h[1] * d[1], -h[1] * e[1], -h[1] * f[1], -h[2] * d[2],
        -h[2] * e[2], -h[2] * f[2],
    )  # fmt: skip
    J = (
        h[3] - h[3] * d[3], -h[3] * e[3], -h[3] * f[3], h[4] - h[4] * e[4], -h[4] * f[4], h[5] - h[5] * f[5],
    )  # fmt: skip
    return M, H, J


@compile_pass
def forward(tree, flex, W, F, tau, udot):
    """Accelerations after `inward`, root to tips: ``udot (nu,)``, A in W, q'' in F."""
    _accelerate(tree, flex, W, F, tau, udot, 1.0)


@compile_inline
def _accelerate(tree, flex, W, F, tau, udot, own):
    """`own` = 1: biases and gravity count; 0: the response to the forces of `inward_bias` alone."""
    for i in range(len(tree.ints)):
        p, joint, u = tree.ints[i, PARENT], tree.ints[i, JOINT], tree.ints[i, U]
        linear, angular, turn = get3(W, p, A), get3(W, p, A + 3), get9(W, i, R)
        if p < 0:
            linear = (own * linear[0], own * linear[1], own * linear[2])
        linear = add3(linear, cross(angular, get3(W, i, ARM)))
        if flex is not None:
            if tree.ints[i, PHI] >= 0:
                v, t = elastic_acceleration(F, tree.ints[i, PHI], tree.ints[p, MODES], tree.ints[p, SLOT])
                linear, angular = add3(linear, v), add3(angular, t)
        v = axpy3(transposed_times(turn, linear), own, get3(W, i, BIAS))
        t = axpy3(transposed_times(turn, angular), own, get3(W, i, BIAS + 3))
        if joint == REVOLUTE:
            f = W[i, H_ + 2] * v[0] + W[i, H_ + 5] * v[1] + W[i, H_ + 8] * v[2]
            f += W[i, J_ + 2] * t[0] + W[i, J_ + 4] * t[1] + W[i, J_ + 5] * t[2]
            x = (tau[u] - W[i, PA + 5] - f) * W[i, PIVOT]
            udot[u] = x
            t = (t[0], t[1], t[2] + x)
        elif joint == PRISMATIC:
            f = W[i, IA + 2] * v[0] + W[i, IA + 4] * v[1] + W[i, IA + 5] * v[2]
            f += W[i, H_ + 6] * t[0] + W[i, H_ + 7] * t[1] + W[i, H_ + 8] * t[2]
            x = (tau[u] - W[i, PA + 2] - f) * W[i, PIVOT]
            udot[u] = x
            v = (v[0], v[1], v[2] + x)
        elif joint == SPHERICAL:
            f = add3(transposed_times(get9(W, i, H_), v), symmetric_times(get6(W, i, J_), t))
            b = get3(W, i, PA + 3)
            b = (tau[u] - b[0] - f[0], tau[u + 1] - b[1] - f[1], tau[u + 2] - b[2] - f[2])
            b = symmetric_times(get6(W, i, PIVOT), b)
            udot[u], udot[u + 1], udot[u + 2] = b
            t = add3(t, b)
        elif joint == FREE:
            f = inertia_times(get6(W, i, IA), get9(W, i, H_), get6(W, i, J_), (v[0], v[1], v[2], t[0], t[1], t[2]))
            x = _solve(W, i, sub6(sub6(_six(tau, u), get6(W, i, PA)), f))
            udot[u], udot[u + 1], udot[u + 2], udot[u + 3], udot[u + 4], udot[u + 5] = x
            v, t = add3(v, (x[0], x[1], x[2])), add3(t, (x[3], x[4], x[5]))
        put3(W, i, A, v)
        put3(W, i, A + 3, t)
        if flex is not None:
            if tree.ints[i, SLOT] >= 0:
                modal_accelerations(tree, W, F, i, udot)


@compile_kernel
def clear_wrenches(tree, flex, W, F):
    """Set all external wrenches and modal loads to zero."""
    for i in range(len(tree.ints)):
        put6(W, i, WRENCH, ZERO6)
    if flex is not None:
        F.load[:] = 0.0


@compile_kernel
def inward_bias(tree, flex, W, F, tau):
    """Biases of external wrenches, modal loads and `tau` alone, with the inertias of the last `inward`.

    Own biases and gravity are left out; `forward_bias` then gives the response of the accelerations: columns of the
    inverse mass matrix in O(n) each. It overwrites the biases (pA, b_f) and A, q'' of the last evaluation.
    """
    for i in range(len(tree.ints)):
        P = get6(W, i, WRENCH)
        put6(W, i, PA, (-P[0], -P[1], -P[2], -P[3], -P[4], -P[5]))
        if flex is not None:
            s = tree.ints[i, SLOT]
            if s >= 0:
                for a in range(tree.ints[i, MODES]):
                    F.Z[s, a, 0, 6] = -F.load[s, a]
    for i in range(len(tree.ints) - 1, -1, -1):
        if flex is not None:
            if tree.ints[i, SLOT] >= 0:
                eliminate_load(tree, W, F, i)
        p = tree.ints[i, PARENT]
        if p < 0:
            continue
        P, turn, arm = _through_hinge(tree, W, i, tau), get9(W, i, R), get3(W, i, ARM)
        f, t = times(turn, (P[0], P[1], P[2])), times(turn, (P[3], P[4], P[5]))
        if flex is not None:
            if tree.ints[i, PHI] >= 0:
                s, slot = tree.ints[p, SLOT], tree.ints[i, PHI]
                for a in range(tree.ints[p, MODES]):
                    v = dot3(f, (F.Phi[slot, a, 0], F.Phi[slot, a, 1], F.Phi[slot, a, 2]))
                    F.Z[s, a, 0, 6] += v + dot3(t, (F.Phi[slot, a, 3], F.Phi[slot, a, 4], F.Phi[slot, a, 5]))
        t = add3(t, cross(arm, f))
        put6(W, p, PA, add6(get6(W, p, PA), (f[0], f[1], f[2], t[0], t[1], t[2])))


@compile_inline
def _through_hinge(tree, W, i, tau):
    """Bias that link i hands to its parent, its hinge eliminated: ``p_A + I_A Hinge Delta^-1 (tau - Hinge^T p_A)``."""
    joint, u, P = tree.ints[i, JOINT], tree.ints[i, U], get6(W, i, PA)
    x = ZERO6
    if joint == REVOLUTE:
        x = (0.0, 0.0, 0.0, 0.0, 0.0, W[i, PIVOT] * (tau[u] - P[5]))
    elif joint == PRISMATIC:
        x = (0.0, 0.0, W[i, PIVOT] * (tau[u] - P[2]), 0.0, 0.0, 0.0)
    elif joint == SPHERICAL:
        t = symmetric_times(get6(W, i, PIVOT), (tau[u] - P[3], tau[u + 1] - P[4], tau[u + 2] - P[5]))
        x = (0.0, 0.0, 0.0, t[0], t[1], t[2])
    elif joint == FREE:
        x = _solve(W, i, sub6(_six(tau, u), P))
    return add6(P, inertia_times(get6(W, i, IA), get9(W, i, H_), get6(W, i, J_), x))


@compile_kernel
def forward_bias(tree, flex, W, F, tau, udot):
    """Response of the accelerations to the forces of `inward_bias`: ``udot (nu,)``, A in W, q'' in F."""
    _accelerate(tree, flex, W, F, tau, udot, 0.0)


@compile_kernel
def spread(tree, flex, W, F, udot):
    """Write to A in W and q'' in F what accelerations ``udot (nu,)`` are to a system at rest, after `outward`."""
    for i in range(len(tree.ints)):
        p, joint, u = tree.ints[i, PARENT], tree.ints[i, JOINT], tree.ints[i, U]
        linear, angular, turn = get3(W, p, A), get3(W, p, A + 3), get9(W, i, R)
        if p < 0:
            linear = ZERO3
        linear = add3(linear, cross(angular, get3(W, i, ARM)))
        if flex is not None:
            if tree.ints[i, PHI] >= 0:
                v, t = elastic_acceleration(F, tree.ints[i, PHI], tree.ints[p, MODES], tree.ints[p, SLOT])
                linear, angular = add3(linear, v), add3(angular, t)
        v, t = transposed_times(turn, linear), transposed_times(turn, angular)
        if joint == REVOLUTE:
            t = (t[0], t[1], t[2] + udot[u])
        elif joint == PRISMATIC:
            v = (v[0], v[1], v[2] + udot[u])
        elif joint == SPHERICAL:
            t = add3(t, (udot[u], udot[u + 1], udot[u + 2]))
        elif joint == FREE:
            x = _six(udot, u)
            v, t = add3(v, (x[0], x[1], x[2])), add3(t, (x[3], x[4], x[5]))
        put3(W, i, A, v)
        put3(W, i, A + 3, t)
        if flex is not None:
            s = tree.ints[i, SLOT]
            if s >= 0:
                for a in range(tree.ints[i, MODES]):
                    F.qdd[s, a >> 3, a & 7] = udot[tree.ints[i, UQ] + a]


@compile_pass
def kinematic(tree, y, ydot):
    """Time derivatives of the coordinates: the first nx numbers of ``ydot``."""
    nx = tree.ints[0, NX]
    for i in range(len(tree.ints)):
        joint, x, u = tree.ints[i, JOINT], tree.ints[i, X], nx + tree.ints[i, U]
        if joint == REVOLUTE or joint == PRISMATIC:
            ydot[x] = y[u]
        elif joint == SPHERICAL:
            e = (y[x], y[x + 1], y[x + 2], y[x + 3])
            ydot[x], ydot[x + 1], ydot[x + 2], ydot[x + 3] = quaternion_rate(e, (y[u], y[u + 1], y[u + 2]))
        elif joint == FREE:
            e = (y[x + 3], y[x + 4], y[x + 5], y[x + 6])
            ydot[x], ydot[x + 1], ydot[x + 2] = times(quaternion_rotation(e), (y[u], y[u + 1], y[u + 2]))
            e = quaternion_rate(e, (y[u + 3], y[u + 4], y[u + 5]))
            ydot[x + 3], ydot[x + 4], ydot[x + 5], ydot[x + 6] = e
        x, u = tree.ints[i, XQ], nx + tree.ints[i, UQ]
        for a in range(tree.ints[i, MODES]):
            ydot[x + a] = y[u + a]


@compile_inline
def seen_spin(W, i):
    """Angular velocity of link i relative to the ground, which may turn about z, in the link's axes; after `world`."""
    n, w = W[len(W) - 1, OMEGA + 2], get3(W, i, OMEGA)
    return w[0] - n * W[i, ROTATION + 6], w[1] - n * W[i, ROTATION + 7], w[2] - n * W[i, ROTATION + 8]


@compile_kernel
def carried(W, p, v):
    """Specific acceleration of a point at p that the ground sees moving at a constant velocity v, inertial axes."""
    g, n = get3(W, len(W) - 1, A), W[len(W) - 1, OMEGA + 2]
    return g[0] - n * (n * p[0] + 2.0 * v[1]), g[1] - n * (n * p[1] - 2.0 * v[0]), g[2]


@compile_kernel
def world(tree, W):
    """Position, rotation (link to inertial) and velocity of every link after `outward`, all relative to the ground."""
    for i in range(len(tree.ints)):
        p = tree.ints[i, PARENT]
        base, arm = get9(W, p, ROTATION), get3(W, i, ARM)
        v = add3(cross(seen_spin(W, p), arm), get3(W, i, SLIDE))
        put3(W, i, POSITION, add3(get3(W, p, POSITION), times(base, arm)))
        put3(W, i, VELOCITY, add3(get3(W, p, VELOCITY), times(base, v)))
        put9(W, i, ROTATION, product(base, get9(W, i, R)))


@compile_kernel
def node_state(tree, flex, W, F, link, node):
    """Motion of an interface of a link's body, after `world`.

    Returns
    -------
    position : 3 numbers, m, inertial
    rotation : 9 numbers by rows, interface frame (the body's axes, turned with the node) to inertial
    velocity, spin : 3 numbers each, m/s and rad/s, inertial axes, relative to the ground
    """
    base, spin = get9(W, link, ROTATION), seen_spin(W, link)
    r = get3(tree.fixed, len(tree.ints) + tree.ints[link, NODES] + node, 0)
    v, turn, w = ZERO3, base, spin
    if flex is not None:
        if tree.ints[link, SLOT] >= 0:
            r, t, _, _, v, e, _, _ = node_motion(tree, flex, W, F, link, node, len(F.Phi) - 1, r)
            turn, w = product(base, t), add3(w, e)
    align = get9(tree.fixed, link, ALIGN)
    velocity = add3(get3(W, link, VELOCITY), times(base, add3(cross(spin, r), v)))
    position = add3(get3(W, link, POSITION), times(base, r))
    return position, product_transposed(turn, align), velocity, times(base, w)


@compile_kernel
def node_acceleration(tree, flex, W, F, link, node, own):
    """Acceleration of an interface (linear, angular, 3 numbers each, inertial axes), after `forward` and `world`.

    own = 1 after `forward`: specific acceleration (acceleration minus gravity); own = 0 after `forward_bias`: the
    response.
    """
    base, w = get9(W, link, ROTATION), get3(W, link, OMEGA)
    r = get3(tree.fixed, len(tree.ints) + tree.ints[link, NODES] + node, 0)
    linear, angular = cross(w, cross(w, r)), ZERO3
    v, t = ZERO3, ZERO3
    if flex is not None:
        if tree.ints[link, SLOT] >= 0:
            slot, n = len(F.Phi) - 1, tree.ints[link, MODES]
            r, _, x, s, _, _, linear, angular = node_motion(tree, flex, W, F, link, node, slot, r)
            turn_shape(F, slot, n, x, s, ZERO3)
            v, t = elastic_acceleration(F, slot, n, tree.ints[link, SLOT])
    v = axpy3(add3(get3(W, link, A), add3(cross(get3(W, link, A + 3), r), v)), own, linear)
    return times(base, v), times(base, axpy3(add3(get3(W, link, A + 3), t), own, angular))


@compile_kernel
def add_wrench(tree, flex, W, F, link, node, force, torque):
    """Add a force (N) and a torque (N m), inertial axes, 3 numbers each, at an interface of a link's body.

    After `world`, before `inward` or `inward_bias`; a flexible body's modes take their share ``Phi_k(q)``.
    """
    base = get9(W, link, ROTATION)
    f, t = transposed_times(base, force), transposed_times(base, torque)
    r = get3(tree.fixed, len(tree.ints) + tree.ints[link, NODES] + node, 0)
    if flex is not None:
        s = tree.ints[link, SLOT]
        if s >= 0:
            slot, n = len(F.Phi) - 1, tree.ints[link, MODES]
            r, _, x, scale, _, _, _, _ = node_motion(tree, flex, W, F, link, node, slot, r)
            turn_shape(F, slot, n, x, scale, ZERO3)
            for a in range(n):
                v = dot3(f, (F.Phi[slot, a, 0], F.Phi[slot, a, 1], F.Phi[slot, a, 2]))
                F.load[s, a] += v + dot3(t, (F.Phi[slot, a, 3], F.Phi[slot, a, 4], F.Phi[slot, a, 5]))
    t = add3(t, cross(r, f))
    put6(W, link, WRENCH, add6(get6(W, link, WRENCH), (f[0], f[1], f[2], t[0], t[1], t[2])))


@compile_kernel
def reactions(tree, W, out):
    """Write the force and torque that each hinge exerts on its link, ``out (nl, 6)``, link frame, after `forward`.

    They act at the link's origin and hold the hinge forces `tau`; along z, the actuator force or torque of a
    prescribed hinge.
    """
    for i in range(len(tree.ints)):
        f = inertia_times(get6(W, i, IA), get9(W, i, H_), get6(W, i, J_), get6(W, i, A))
        put6(out, i, 0, add6(f, get6(W, i, PA)))


@compile_pass
def accelerations(tree, flex, W, F, y, motion, tau, udot):
    """All accelerations ``udot (nu,)`` of a system without loads but `tau`; returns the status of `inward`."""
    outward(tree, flex, W, F, y, motion)
    status = inward(tree, flex, W, F, tau, None, 0.0, 0.0)
    if status < 0:
        forward(tree, flex, W, F, tau, udot)
    return status


def _rigid_accelerations(ints, fixed, W, y, forces):
    """`accelerations` of rigid bodies without prescribed hinges, from five bare arrays: the quickest call from Python.

    The first row of ``forces (2, nu)`` holds `tau`, the second receives the accelerations.
    """
    return accelerations(Tree(ints, fixed), None, W, None, y, W, forces[0], forces[1])


rigid_accelerations = compile_kernel(_rigid_accelerations, nogil=False)


@compile_kernel
def derivative(tree, flex, W, F, y, motion, tau, ydot):
    """Time derivative of the state of a system without loads but `tau`; returns the status of `inward`."""
    kinematic(tree, y, ydot)
    return accelerations(tree, flex, W, F, y, motion, tau, ydot[tree.ints[0, NX] :])
