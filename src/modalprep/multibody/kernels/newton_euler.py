"""Inverse dynamics of the tree: the forces that given accelerations need, in O(n), without a mass matrix."""

from __future__ import annotations

from modalprep.jit import compile_kernel
from modalprep.multibody.kernels.data import (
    ARM,
    BIAS,
    FREE,
    H_,
    IA,
    J_,
    JOINT,
    MODES,
    PA,
    PARENT,
    PHI,
    PRISMATIC,
    REVOLUTE,
    SLOT,
    SPHERICAL,
    UQ,
    WRENCH,
    A,
    R,
    U,
)
from modalprep.multibody.kernels.modal import elastic_acceleration
from modalprep.multibody.kernels.spatial import (
    ZERO3,
    add3,
    add6,
    axpy6,
    cross,
    dot3,
    get3,
    get6,
    get8,
    get9,
    inertia_times,
    put3,
    put6,
    sub6,
    times,
    transposed_times,
)


@compile_kernel
def required_forces(tree, flex, W, F, udot, out):
    """Write ``M udot - f`` of all bodies and loads but hinge forces to ``out (nu,)``.

    After `kernel.outward` and the loads, in place of `kernel.inward`: hinge forces equal to `out` give the
    accelerations ``udot (nu,)``, where the modal rows of `out` vanish.
    """
    for i in range(len(tree.ints)):
        f = _outward(tree, flex, W, F, i, udot)
        if flex is not None:
            s = tree.ints[i, SLOT]
            if s >= 0:
                f = _modal(tree, W, F, i, f, out)
        put6(W, i, PA, sub6(f, get6(W, i, WRENCH)))
    for i in range(len(tree.ints) - 1, -1, -1):
        _inward(tree, flex, W, F, i, out)


@compile_kernel
def _outward(tree, flex, W, F, i, udot):
    """Write the acceleration of link i to W, q'' to F; returns its own inertia force without q''."""
    p, joint, u, turn = tree.ints[i, PARENT], tree.ints[i, JOINT], tree.ints[i, U], get9(W, i, R)
    angular = get3(W, p, A + 3)
    linear = add3(get3(W, p, A), cross(angular, get3(W, i, ARM)))
    if flex is not None:
        if tree.ints[i, PHI] >= 0:
            v, t = elastic_acceleration(F, tree.ints[i, PHI], tree.ints[p, MODES], tree.ints[p, SLOT])
            linear, angular = add3(linear, v), add3(angular, t)
    v, t = ZERO3, ZERO3
    if joint == REVOLUTE:
        t = (0.0, 0.0, udot[u])
    elif joint == PRISMATIC:
        v = (0.0, 0.0, udot[u])
    elif joint == SPHERICAL:
        t = (udot[u], udot[u + 1], udot[u + 2])
    elif joint == FREE:
        v, t = (udot[u], udot[u + 1], udot[u + 2]), (udot[u + 3], udot[u + 4], udot[u + 5])
    put3(W, i, A, add3(add3(transposed_times(turn, linear), get3(W, i, BIAS)), v))
    put3(W, i, A + 3, add3(add3(transposed_times(turn, angular), get3(W, i, BIAS + 3)), t))
    if flex is not None:
        s = tree.ints[i, SLOT]
        if s >= 0:
            for k in range(F.qdd.shape[1]):
                for c in range(8):
                    F.qdd[s, k, c] = udot[tree.ints[i, UQ] + 8 * k + c] if 8 * k + c < tree.ints[i, MODES] else 0.0
    f = inertia_times(get6(W, i, IA), get9(W, i, H_), get6(W, i, J_), get6(W, i, A))
    return add6(f, get6(W, i, PA))


@compile_kernel
def _modal(tree, W, F, i, f, out):
    """Write the modal rows of link i to `out`; returns its inertia force with q''."""
    s, n, at, u = tree.ints[i, SLOT], tree.ints[i, MODES], get6(W, i, A), tree.ints[i, UQ]
    for a in range(n):
        row = get8(F.Z, s, a, 0)
        own = dot3((row[0], row[1], row[2]), (at[0], at[1], at[2]))
        own += dot3((row[3], row[4], row[5]), (at[3], at[4], at[5]))
        out[u + a] = own + row[6] - F.load[s, a]
    for a in range(n):
        row, qdd = get8(F.Z, s, a, 0), F.qdd[s, a >> 3, a & 7]
        f = axpy6(f, qdd, (row[0], row[1], row[2], row[3], row[4], row[5]))
        out[u + a] += F.Z[s, a, 1 + (a >> 3), a & 7] * qdd
        for b in range(a + 1, n):  # the upper half of M_ff
            out[u + a] += F.Z[s, a, 1 + (b >> 3), b & 7] * F.qdd[s, b >> 3, b & 7]
            out[u + b] += F.Z[s, a, 1 + (b >> 3), b & 7] * qdd
    return f


@compile_kernel
def _inward(tree, flex, W, F, i, out):
    """Write the hinge rows of link i, and hand its wrench to its parent."""
    p, joint, u, f = tree.ints[i, PARENT], tree.ints[i, JOINT], tree.ints[i, U], get6(W, i, PA)
    if joint == REVOLUTE:
        out[u] = f[5]
    elif joint == PRISMATIC:
        out[u] = f[2]
    elif joint == SPHERICAL:
        out[u], out[u + 1], out[u + 2] = f[3], f[4], f[5]
    elif joint == FREE:
        out[u], out[u + 1], out[u + 2], out[u + 3], out[u + 4], out[u + 5] = f
    if p < 0:
        return
    turn = get9(W, i, R)
    force, torque = times(turn, (f[0], f[1], f[2])), times(turn, (f[3], f[4], f[5]))
    if flex is not None:
        slot = tree.ints[i, PHI]
        if slot >= 0:
            for a in range(tree.ints[p, MODES]):
                v = dot3(force, (F.Phi[slot, a, 0], F.Phi[slot, a, 1], F.Phi[slot, a, 2]))
                v += dot3(torque, (F.Phi[slot, a, 3], F.Phi[slot, a, 4], F.Phi[slot, a, 5]))
                out[tree.ints[p, UQ] + a] += v
    torque = add3(torque, cross(get3(W, i, ARM), force))
    put6(W, p, PA, add6(get6(W, p, PA), (force[0], force[1], force[2], torque[0], torque[1], torque[2])))
