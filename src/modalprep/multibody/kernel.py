"""Order-n forward dynamics of a tree of flexible bodies: FORMULATION sections 4 and 5, equations in its order.

One backward and two forward passes; cost linear in the bodies. Every array is allocated by the caller, nothing
is raised: a pivot that is not positive leaves its body's number in `status[0]`. `dense.py` is the readable twin.

Spatial vectors are (linear, angular), resolved in the body's own frame; `A` is the specific acceleration of the
root (acceleration minus gravity). R maps child to parent axes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.jit import compile_kernel
from modalprep.multibody.layout import FREE, PRESCRIBED, REVOLUTE, Bodies, Tree


class Work(NamedTuple):
    """Scratch of one evaluation, one row per body (n padded to N)."""

    R: np.ndarray  # (nb, 3, 3) child to parent axes
    arm: np.ndarray  # (nb, 3) hinge point in the parent's frame
    Phi: np.ndarray  # (nb, 6, N) motion of the hinge point per modal rate of the parent, parent axes
    V: np.ndarray  # (nb, 6)
    bias: np.ndarray  # (nb, 6)
    Hinge: np.ndarray  # (nb, 6, 6), as many columns as speeds
    Mrr: np.ndarray  # (nb, 6, 6)
    Mrf: np.ndarray  # (nb, 6, N)
    Mff: np.ndarray  # (nb, N, N)
    br: np.ndarray  # (nb, 6)
    bf: np.ndarray  # (nb, N)
    G: np.ndarray  # (nb, N, 6) M_ff^-1 M_fr
    z: np.ndarray  # (nb, N) M_ff^-1 b_f
    IA: np.ndarray  # (nb, 6, 6)
    pA: np.ndarray  # (nb, 6)
    U: np.ndarray  # (nb, 6, 6) I_A Hinge
    Delta: np.ndarray  # (nb, 6, 6) its Cholesky factor
    A: np.ndarray  # (nb, 6)
    qdd: np.ndarray  # (nb, N)
    L: np.ndarray  # (3, 3, N)
    v3: np.ndarray  # small vectors and matrices of one body: allocation would cost more than the arithmetic
    v6: np.ndarray
    m3: np.ndarray
    m6: np.ndarray


def workspace(tree: Tree, bodies: Bodies) -> Work:
    """Allocate the scratch for a packed system."""
    nb, N = len(tree.parent), bodies.S.shape[2]
    shapes = {
        "R": (3, 3), "arm": (3,), "Phi": (6, N), "V": (6,), "bias": (6,), "Hinge": (6, 6), "Mrr": (6, 6),
        "Mrf": (6, N), "Mff": (N, N), "br": (6,), "bf": (N,), "G": (N, 6), "z": (N,), "IA": (6, 6), "pA": (6,),
        "U": (6, 6), "Delta": (6, 6), "A": (6,), "qdd": (N,),
    }  # fmt: skip
    small = {"L": (3, 3, N), "v3": (10, 3), "v6": (7, 6), "m3": (4, 3, 3), "m6": (5, 6, 6)}
    return Work(
        **{name: np.zeros((nb, *shape)) for name, shape in shapes.items()},
        **{name: np.zeros(shape) for name, shape in small.items()},
    )


@compile_kernel
def coordinates(tree):
    """Number of coordinates: where the speeds begin in the state."""
    last = len(tree.joint) - 1
    joint = tree.joint[last]
    return tree.x[last] + (1 if joint == REVOLUTE else 7 if joint == FREE else 0) + tree.n[last]


@compile_kernel
def cross(a, b):
    """``a x b`` of two sequences of three."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compile_kernel
def add_skew(R, f, v):
    """Add ``f v~`` to R."""
    R[0, 1] -= f * v[2]
    R[1, 0] += f * v[2]
    R[0, 2] += f * v[1]
    R[2, 0] -= f * v[1]
    R[1, 2] -= f * v[0]
    R[2, 1] += f * v[0]


@compile_kernel
def cholesky(A, n):
    """Factor the leading n x n block of A in place (lower triangle); False when it is not positive definite."""
    for j in range(n):
        d = A[j, j]
        for k in range(j):
            d -= A[j, k] * A[j, k]
        if not d > 0.0:
            return False
        d = np.sqrt(d)
        A[j, j] = d
        for i in range(j + 1, n):
            v = A[i, j]
            for k in range(j):
                v -= A[i, k] * A[j, k]
            A[i, j] = v / d
    return True


@compile_kernel
def cholesky_solve(A, n, x):
    """Solve in place with the factor of `cholesky`."""
    for i in range(n):
        v = x[i]
        for k in range(i):
            v -= A[i, k] * x[k]
        x[i] = v / A[i, i]
    for i in range(n - 1, -1, -1):
        v = x[i]
        for k in range(i + 1, n):
            v -= A[k, i] * x[k]
        x[i] = v / A[i, i]


@compile_kernel
def rotation_about(axis, angle, R):
    """Write the rotation matrix about a unit axis to R."""
    c, s = np.cos(angle), np.sin(angle)
    for i in range(3):
        for j in range(3):
            R[i, j] = (1.0 - c) * axis[i] * axis[j]
        R[i, i] += c
    add_skew(R, s, axis)


@compile_kernel
def rotation_of_quaternion(e, R):
    """Write the rotation matrix of the quaternion e = (w, x, y, z), of any length, to R."""
    w, x, y, z = e[0], e[1], e[2], e[3]
    f = 2.0 / (w * w + x * x + y * y + z * z)
    R[0, 0] = 1.0 - f * (y * y + z * z)
    R[1, 1] = 1.0 - f * (x * x + z * z)
    R[2, 2] = 1.0 - f * (x * x + y * y)
    R[0, 1] = f * (x * y - w * z)
    R[1, 0] = f * (x * y + w * z)
    R[0, 2] = f * (x * z + w * y)
    R[2, 0] = f * (x * z - w * y)
    R[1, 2] = f * (y * z - w * x)
    R[2, 1] = f * (y * z + w * x)


@compile_kernel
def hinge_point(bodies, kind, node, n, q, qd, w, v3, arm, Phi, R, vel, acc):
    """Motion of a parent's interface node, in the parent's frame.

    Writes the position `arm`, the partial velocities `Phi (6, n)`, the rotation `R` of the node (Cayley map of
    ``psi q``, exactly orthogonal), its elastic velocity `vel (6,)` and the acceleration `acc (6,)` that remains
    when the parent's A and q'' are zero; w is the parent's angular velocity.
    """
    x = v3[0]
    xd = v3[1]
    second = v3[2:4]  # -q' Kg q' of translation and rotation
    for a in range(3):
        x[a] = 0.0
        xd[a] = 0.0
        second[0, a] = 0.0
        second[1, a] = 0.0
        arm[a] = bodies.at[kind, node, a]
        vel[a] = 0.0
        for i in range(n):
            kf = 0.0
            kt = 0.0
            kfd = 0.0
            ktd = 0.0
            for j in range(n):
                kf += bodies.Kg_F[kind, node, a, i, j] * q[j]
                kt += bodies.Kg_T[kind, node, a, i, j] * q[j]
                kfd += bodies.Kg_F[kind, node, a, i, j] * qd[j]
                ktd += bodies.Kg_T[kind, node, a, i, j] * qd[j]
            Phi[a, i] = bodies.phi[kind, node, a, i] - kf
            Phi[3 + a, i] = bodies.psi[kind, node, a, i] - kt
            arm[a] += (bodies.phi[kind, node, a, i] - 0.5 * kf) * q[i]
            x[a] += (bodies.psi[kind, node, a, i] - 0.5 * kt) * q[i]
            vel[a] += Phi[a, i] * qd[i]
            xd[a] += Phi[3 + a, i] * qd[i]
            second[0, a] -= kfd * qd[i]
            second[1, a] -= ktd * qd[i]
    # Cayley: R = 1 + s (x~ + x~x~/2), w_el = s (1 + x~/2) x', s = 4 / (4 + x.x)
    xx = x[0] * x[0] + x[1] * x[1] + x[2] * x[2]
    s = 4.0 / (4.0 + xx)
    xxd = x[0] * xd[0] + x[1] * xd[1] + x[2] * xd[2]
    for i in range(n):
        c = cross(x, Phi[3:, i])
        for a in range(3):
            Phi[3 + a, i] = s * (Phi[3 + a, i] + 0.5 * c[a])
    c = cross(x, xd)
    d = cross(x, second[1])
    for a in range(3):
        vel[3 + a] = s * (xd[a] + 0.5 * c[a])
    for a in range(3):
        for b in range(3):
            R[a, b] = 0.5 * s * x[a] * x[b]
        R[a, a] += 1.0 - 0.5 * s * xx
    add_skew(R, s, x)
    wr = cross(w, arm)
    wwr = cross(w, wr)
    wu = cross(w, vel)
    we = cross(w, vel[3:])
    for a in range(3):
        acc[a] = wwr[a] + 2.0 * wu[a] + second[0, a]
        acc[3 + a] = -0.5 * s * xxd * vel[3 + a] + s * (second[1, a] + 0.5 * d[a]) + we[a]


@compile_kernel
def body_matrices(bodies, k, n, V, q, qd, L, v3, m3, Mrr, Mrf, Mff, br, bf):
    """One body's own mass matrix and bias, FORMULATION section 4."""
    w = V[3:]
    S = Mrf
    s = v3[4]
    Sqd = v3[5]
    second = v3[6:8]  # q' Kg_A q' and eps_cab q' Kg_W_ba q'
    Jw = v3[8]
    Yw = v3[9]
    E = m3[0]
    Y = m3[1]
    for a in range(3):
        s[a] = bodies.s0[k, a]
        Sqd[a] = 0.0
        second[0, a] = 0.0
        second[1, a] = 0.0
        for i in range(n):
            kq = 0.0
            kqd = 0.0
            kc = 0.0
            for j in range(n):
                kq += bodies.Kg_A[k, a, i, j] * q[j]
                kqd += bodies.Kg_A[k, a, i, j] * qd[j]
                kc += bodies.Kg_c[k, a, i, j] * qd[j]
            S[a, i] = bodies.S[k, a, i] + kq
            s[a] += (bodies.S[k, a, i] + 0.5 * kq) * q[i]
            Sqd[a] += S[a, i] * qd[i]
            second[0, a] += kqd * qd[i]
            second[1, a] += kc * qd[i]
        for b in range(3):
            E[a, b] = 0.0
            Y[a, b] = 0.0
            for i in range(n):
                v = 0.0
                for j in range(n):
                    v += bodies.PW[k, a, b, i, j] * q[j]
                L[a, b, i] = bodies.H[k, a, b, i] + v
                E[a, b] += (bodies.H[k, a, b, i] + 0.5 * v) * q[i]
                Y[a, b] += L[a, b, i] * qd[i]
    trace = 0.0
    for a in range(3):
        for b in range(a + 1):
            e = bodies.E0[k, a, b] + E[a, b] + E[b, a]
            E[a, b] = e
            E[b, a] = e
        trace += E[a, a]
    m = bodies.m[k]
    for a in range(3):
        for b in range(3):
            Mrr[a, b] = 0.0
            Mrr[3 + a, 3 + b] = -E[a, b]
        Mrr[a, a] = m
        Mrr[3 + a, 3 + a] += trace
    # M_rr = [[m, -s~], [s~, J]]
    for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        Mrr[a, 3 + b] = s[c]
        Mrr[b, 3 + a] = -s[c]
        Mrr[a, 3 + a] = 0.0
        Mrr[3 + b, a] = s[c]
        Mrr[3 + a, b] = -s[c]
        Mrr[3 + a, a] = 0.0
    for i in range(n):  # C_c = eps_cab L_ba
        Mrf[3, i] = L[2, 1, i] - L[1, 2, i]
        Mrf[4, i] = L[0, 2, i] - L[2, 0, i]
        Mrf[5, i] = L[1, 0, i] - L[0, 1, i]
    ws = cross(w, s)
    wws = cross(w, ws)
    wSqd = cross(w, Sqd)
    for a in range(3):
        Jw[a] = trace * w[a]
        Yw[a] = (Y[0, 0] + Y[1, 1] + Y[2, 2]) * w[a]
        for b in range(3):
            Jw[a] -= E[a, b] * w[b]
            Yw[a] -= Y[a, b] * w[b]
    wJw = cross(w, Jw)
    for a in range(3):
        br[a] = wws[a] + 2.0 * wSqd[a] + second[0, a]
        br[3 + a] = wJw[a] + 2.0 * Yw[a] + second[1, a]
    ww = w[0] * w[0] + w[1] * w[1] + w[2] * w[2]
    for i in range(n):
        f = bodies.K[k, i] * q[i] + bodies.D[k, i] * qd[i]
        for a in range(3):
            f -= ww * L[a, a, i]
            for b in range(3):
                f += w[a] * w[b] * L[a, b, i]
            g = 0.0
            for j in range(n):  # 2 w~_ab P_ab q' = -2 w_c eps_cab P_ab q' = 2 w_c G_c q'
                g += bodies.G[k, a, i, j] * qd[j]
            f += 2.0 * w[a] * g
        bf[i] = f
        for j in range(n):
            Mff[i, j] = 0.0
        Mff[i, i] = 1.0


@compile_kernel
def outward(tree, bodies, y, motion, W):
    """First forward pass: hinge geometry, velocities, biases and own matrices of every body, root to tips."""
    nx = coordinates(tree)
    node_R = W.m3[2]
    turn = W.m3[3]
    vel = W.v6[0]
    acc = W.v6[1]
    vP = W.v6[2]
    for i in range(len(tree.parent)):
        p = tree.parent[i]
        joint = tree.joint[i]
        x = tree.x[i]
        u = nx + tree.u[i]
        for a in range(6):
            vP[a] = 0.0
            acc[a] = 0.0
            W.bias[i, a] = 0.0
            for b in range(6):
                W.Hinge[i, a, b] = 0.0
        if p >= 0:
            pj = tree.joint[p]
            px = tree.x[p] + (1 if pj == REVOLUTE else 7 if pj == FREE else 0)
            pu = nx + tree.u[p] + (1 if pj == REVOLUTE else 6 if pj == FREE else 0)
            pn = tree.n[p]
            w = W.V[p, 3:]
            hinge_point(bodies, tree.kind[p], tree.node[i], pn, y[px : px + pn], y[pu : pu + pn], w,
                        W.v3, W.arm[i], W.Phi[i], node_R, vel, acc)  # fmt: skip
            wr = cross(w, W.arm[i])
            for a in range(3):
                vP[a] = W.V[p, a] + wr[a] + vel[a]
                vP[3 + a] = w[a] + vel[3 + a]
        else:
            for a in range(3):
                W.arm[i, a] = 0.0
                for b in range(3):
                    node_R[a, b] = 1.0 if a == b else 0.0
        if joint == FREE:
            rotation_of_quaternion(y[x + 3 : x + 7], W.R[i])
            v = y[u : u + 3]
            w = y[u + 3 : u + 6]
            wv = cross(w, v)
            for a in range(6):
                W.V[i, a] = y[u + a]
                W.Hinge[i, a, a] = 1.0
            for a in range(3):
                W.bias[i, a] = wv[a]
            x += 7
            u += 6
        else:
            angle = 0.0
            rate = 0.0
            if joint == REVOLUTE:
                angle = y[x]
                rate = y[u]
                x += 1
                u += 1
            elif joint == PRESCRIBED:
                angle = motion[i, 0]
                rate = motion[i, 1]
            rotation_about(tree.axis[i], angle, turn)
            for a in range(3):
                for b in range(3):
                    v = 0.0
                    for c in range(3):
                        for d in range(3):
                            v += node_R[a, c] * tree.fixed[i, c, d] * turn[d, b]
                    W.R[i, a, b] = v
            for a in range(3):  # X = R^T takes the node's motion to the child's axes
                W.V[i, a] = 0.0
                W.V[i, 3 + a] = 0.0
                for b in range(3):
                    W.V[i, a] += W.R[i, b, a] * vP[b]
                    W.V[i, 3 + a] += W.R[i, b, a] * vP[3 + b]
                    W.bias[i, a] += W.R[i, b, a] * acc[b]
                    W.bias[i, 3 + a] += W.R[i, b, a] * acc[3 + b]
            we = cross(W.V[i, 3:], tree.axis[i])
            for a in range(3):
                W.bias[i, 3 + a] += we[a] * rate
                W.V[i, 3 + a] += tree.axis[i, a] * rate
                if joint == REVOLUTE:
                    W.Hinge[i, 3 + a, 0] = tree.axis[i, a]
                elif joint == PRESCRIBED:
                    W.bias[i, 3 + a] += tree.axis[i, a] * motion[i, 2]
        n = tree.n[i]
        body_matrices(bodies, tree.kind[i], n, W.V[i], y[x : x + n], y[u : u + n], W.L, W.v3, W.m3,
                      W.Mrr[i], W.Mrf[i], W.Mff[i], W.br[i], W.bf[i])  # fmt: skip


@compile_kernel
def condense(W, i, n, nu, tau):
    """Eliminate the modes, then the hinge, of body i; False when a pivot is not positive."""
    if not cholesky(W.Mff[i], n):
        return False
    for c in range(6):
        for k in range(n):
            W.G[i, k, c] = W.Mrf[i, c, k]
        cholesky_solve(W.Mff[i], n, W.G[i, :, c])
    for k in range(n):
        W.z[i, k] = W.bf[i, k]
    cholesky_solve(W.Mff[i], n, W.z[i])
    for a in range(6):
        v = W.br[i, a]
        for k in range(n):
            v -= W.Mrf[i, a, k] * W.z[i, k]
        W.pA[i, a] = v
        for b in range(a + 1):
            v = W.Mrr[i, a, b]
            for k in range(n):
                v -= W.Mrf[i, a, k] * W.G[i, k, b]
            W.IA[i, a, b] = v
            W.IA[i, b, a] = v
    for c in range(nu):
        for a in range(6):
            v = 0.0
            for b in range(6):
                v += W.IA[i, a, b] * W.Hinge[i, b, c]
            W.U[i, a, c] = v
    for c in range(nu):
        for d in range(nu):
            v = 0.0
            for a in range(6):
                v += W.Hinge[i, a, c] * W.U[i, a, d]
            W.Delta[i, c, d] = v
    return cholesky(W.Delta[i], nu)


@compile_kernel
def hand_to_parent(tree, W, i, nu, tau):
    """Add body i, its hinge condensed, to its parent: FORMULATION section 5."""
    p = tree.parent[i]
    n = tree.n[p]
    Ia = W.m6[0]
    UD = W.m6[1]  # U Delta^-1
    IP = W.m6[2]  # in the parent's axes, at the hinge point
    half = W.m6[3]
    B = W.m6[4]  # T_k = [[1, -arm~], [0, 1]]
    pa = W.v6[3]
    rest = W.v6[4]
    pP = W.v6[5]
    col = W.v6[6]
    for a in range(6):
        pP[a] = 0.0
        for b in range(6):
            IP[a, b] = 0.0
            half[a, b] = 0.0
            B[a, b] = 0.0
        B[a, a] = 1.0
    for a in range(6):
        for c in range(nu):
            UD[a, c] = W.U[i, a, c]
        cholesky_solve(W.Delta[i], nu, UD[a])
    for c in range(nu):
        rest[c] = tau[c]
        for a in range(6):
            rest[c] -= W.Hinge[i, a, c] * W.pA[i, a]
    for a in range(6):
        for b in range(6):
            v = W.IA[i, a, b]
            for c in range(nu):
                v -= UD[a, c] * W.U[i, b, c]
            Ia[a, b] = v
    for a in range(6):
        v = W.pA[i, a]
        for b in range(6):
            v += Ia[a, b] * W.bias[i, b]
        for c in range(nu):
            v += UD[a, c] * rest[c]
        pa[a] = v
    R = W.R[i]
    for h in range(2):
        for a in range(3):
            for b in range(3):
                pP[3 * h + a] += R[a, b] * pa[3 * h + b]
                for c in range(6):
                    half[3 * h + a, c] += R[a, b] * Ia[3 * h + b, c]
    for h in range(2):
        for a in range(3):
            for b in range(3):
                for c in range(6):
                    IP[c, 3 * h + a] += half[c, 3 * h + b] * R[a, b]
    add_skew(B[:3, 3:], -1.0, W.arm[i])
    for a in range(6):
        for b in range(6):
            v = 0.0
            for c in range(6):
                v += IP[a, c] * B[c, b]
            half[a, b] = v
    for a in range(6):
        for b in range(6):
            v = 0.0
            for c in range(6):
                v += B[c, a] * half[c, b]
            W.Mrr[p, a, b] += v
        v = 0.0
        for c in range(6):
            v += B[c, a] * pP[c]
        W.br[p, a] += v
    for k in range(n):
        f = 0.0
        for a in range(6):
            f += W.Phi[i, a, k] * pP[a]
        W.bf[p, k] += f
        for a in range(6):
            v = 0.0
            for c in range(6):
                v += half[c, a] * W.Phi[i, c, k]
            W.Mrf[p, a, k] += v
        for a in range(6):
            col[a] = 0.0
            for c in range(6):
                col[a] += IP[a, c] * W.Phi[i, c, k]
        for l in range(n):  # noqa: E741
            v = 0.0
            for a in range(6):
                v += W.Phi[i, a, l] * col[a]
            W.Mff[p, l, k] += v


@compile_kernel
def accelerate(tree, W, i, nu, tau, udot):
    """Second forward pass of body i: hinge acceleration, A, q''; `udot` receives the body's speeds."""
    p = tree.parent[i]
    aP = W.v6[3]
    rest = W.v6[4]
    R = W.R[i]
    if p >= 0:
        wr = cross(W.A[p, 3:], W.arm[i])
        for a in range(6):
            v = W.A[p, a] + (wr[a] if a < 3 else 0.0)
            for k in range(tree.n[p]):
                v += W.Phi[i, a, k] * W.qdd[p, k]
            aP[a] = v
    else:
        for a in range(3):
            aP[a] = -tree.gravity[a]
            aP[3 + a] = 0.0
    for a in range(3):
        v = W.bias[i, a]
        w = W.bias[i, 3 + a]
        for b in range(3):
            v += R[b, a] * aP[b]
            w += R[b, a] * aP[3 + b]
        W.A[i, a] = v
        W.A[i, 3 + a] = w
    for c in range(nu):
        rest[c] = tau[c]
        for a in range(6):
            rest[c] -= W.Hinge[i, a, c] * W.pA[i, a] + W.U[i, a, c] * W.A[i, a]
    cholesky_solve(W.Delta[i], nu, rest)
    for c in range(nu):
        udot[c] = rest[c]
        for a in range(6):
            W.A[i, a] += W.Hinge[i, a, c] * rest[c]
    for k in range(tree.n[i]):
        v = -W.z[i, k]
        for a in range(6):
            v -= W.G[i, k, a] * W.A[i, a]
        W.qdd[i, k] = v
        udot[nu + k] = v


@compile_kernel
def accelerations(tree, bodies, y, motion, W, udot, torque, status):
    """Write all accelerations to `udot` and the torques of prescribed hinges to `torque (nb,)`."""
    nb = len(tree.parent)
    status[0] = -1
    tau = np.zeros(6)
    outward(tree, bodies, y, motion, W)
    for i in range(nb - 1, -1, -1):
        nu = 1 if tree.joint[i] == REVOLUTE else 6 if tree.joint[i] == FREE else 0
        if not condense(W, i, tree.n[i], nu, tau):
            status[0] = i
            return
        if tree.parent[i] >= 0:
            hand_to_parent(tree, W, i, nu, tau)
    for i in range(nb):
        nu = 1 if tree.joint[i] == REVOLUTE else 6 if tree.joint[i] == FREE else 0
        accelerate(tree, W, i, nu, tau, udot[tree.u[i] :])
        torque[i] = 0.0
        if tree.joint[i] == PRESCRIBED:
            for a in range(6):
                f = W.pA[i, a]
                for b in range(6):
                    f += W.IA[i, a, b] * W.A[i, b]
                torque[i] += f * tree.axis[i, a - 3] if a >= 3 else 0.0


@compile_kernel
def derivative(tree, bodies, y, motion, W, torque, status, ydot):
    """Write the time derivative of the state ``y = [coordinates | speeds]`` to `ydot`."""
    nx = coordinates(tree)
    accelerations(tree, bodies, y, motion, W, ydot[nx:], torque, status)
    for i in range(len(tree.joint)):
        x = tree.x[i]
        u = nx + tree.u[i]
        if tree.joint[i] == REVOLUTE:
            ydot[x] = y[u]
            x += 1
            u += 1
        elif tree.joint[i] == FREE:
            for a in range(3):
                ydot[x + a] = 0.0
                for b in range(3):
                    ydot[x + a] += W.R[i, a, b] * y[u + b]
            e = y[x + 3 : x + 7]
            w = y[u + 3 : u + 6]
            ydot[x + 3] = 0.5 * (-e[1] * w[0] - e[2] * w[1] - e[3] * w[2])
            ydot[x + 4] = 0.5 * (e[0] * w[0] + e[2] * w[2] - e[3] * w[1])
            ydot[x + 5] = 0.5 * (e[0] * w[1] + e[3] * w[0] - e[1] * w[2])
            ydot[x + 6] = 0.5 * (e[0] * w[2] + e[1] * w[1] - e[2] * w[0])
            x += 7
            u += 6
        for k in range(tree.n[i]):
            ydot[x + k] = y[u + k]
