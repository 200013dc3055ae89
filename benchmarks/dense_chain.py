"""The dense way to the same accelerations, as quick as it is usually written: composite bodies, then LAPACK.

The mass matrix of a tree with revolute hinges by the composite-body algorithm, one row per coordinate carried
from its link to the root, O(N depth) after O(n); the bias by one inverse dynamics; Cholesky solution by LAPACK.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.linalg.lapack import dposv

from modalprep.jit import compile_kernel
from modalprep.multibody.kernels.articulated_body import outward
from modalprep.multibody.kernels.data import ARM, H_, IA, J_, MODES, PARENT, PHI, SLOT, UQ, R, U
from modalprep.multibody.kernels.modal import add_to_modes
from modalprep.multibody.kernels.newton_euler import required_forces
from modalprep.multibody.kernels.spatial import (
    add3,
    add6,
    add9,
    cross,
    get3,
    get6,
    get9,
    put6,
    put9,
    rotated_inertia,
    shifted,
    times,
)


@compile_kernel
def mass_and_bias(tree, flex, W, F, y, motion, udot, M, bias):
    """Fill the lower triangle of ``M (nu, nu)`` and ``bias (nu,)``; `udot` is zero."""
    outward(tree, flex, W, F, y, motion)
    _compose(tree, flex, W, F)
    M[:] = 0.0
    for i in range(len(tree.ints)):
        u, own, s = tree.ints[i, U], tree.ints[i, UQ], tree.ints[i, SLOT]
        M[u, u] = W[i, J_ + 5]
        f = (W[i, H_ + 2], W[i, H_ + 5], W[i, H_ + 8], W[i, J_ + 2], W[i, J_ + 4], W[i, J_ + 5])
        _carry(tree, flex, W, F, i, f, M[u])
        if flex is not None:
            for a in range(tree.ints[i, MODES]):
                M[own + a, u] = F.Z[s, a, 0, 5]
                for b in range(a + 1):
                    M[own + a, own + b] = F.Z[s, b, 1 + (a >> 3), a & 7]
                z = F.Z
                f = (z[s, a, 0, 0], z[s, a, 0, 1], z[s, a, 0, 2], z[s, a, 0, 3], z[s, a, 0, 4], z[s, a, 0, 5])
                _carry(tree, flex, W, F, i, f, M[own + a])
    outward(tree, flex, W, F, y, motion)
    required_forces(tree, flex, W, F, udot, bias)


@compile_kernel
def _compose(tree, flex, W, F):
    """Add the inertia of all that a link carries to its own, and to its modal rows."""
    zero = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for i in range(len(tree.ints) - 1, 0, -1):
        p, arm = tree.ints[i, PARENT], get3(W, i, ARM)
        M, H, J = rotated_inertia(get9(W, i, R), get6(W, i, IA), get9(W, i, H_), get6(W, i, J_))
        if flex is not None:
            add_to_modes(F, tree.ints[i, PHI], tree.ints[p, SLOT], tree.ints[p, MODES], M, H, J, zero, arm)
        H, J = shifted(M, H, J, arm)
        put6(W, p, IA, add6(get6(W, p, IA), M))
        put9(W, p, H_, add9(get9(W, p, H_), H))
        put6(W, p, J_, add6(get6(W, p, J_), J))


@compile_kernel
def _carry(tree, flex, W, F, i, force, row):
    """Write a row of M left of its link: the force that its unit acceleration asks of every ancestor."""
    f, t = (force[0], force[1], force[2]), (force[3], force[4], force[5])
    while tree.ints[i, PARENT] >= 0:
        p, slot, turn = tree.ints[i, PARENT], tree.ints[i, PHI], get9(W, i, R)
        f, t = times(turn, f), times(turn, t)
        if flex is not None:
            for a in range(tree.ints[p, MODES]):
                v = f[0] * F.Phi[slot, a, 0] + f[1] * F.Phi[slot, a, 1] + f[2] * F.Phi[slot, a, 2]
                v += t[0] * F.Phi[slot, a, 3] + t[1] * F.Phi[slot, a, 4] + t[2] * F.Phi[slot, a, 5]
                row[tree.ints[p, UQ] + a] = v
        t = add3(t, cross(get3(W, i, ARM), f))
        row[tree.ints[p, U]] = t[2]
        i = p


def dense(given: tuple) -> tuple[Callable[[int], None], Callable[[int], None]]:
    """Return a call of the whole dense evaluation, and one of LAPACK's part alone; both checked against order n."""
    tree, flex, W, F, y, motion, _, udot = given
    nu = len(udot)
    M, kept, bias, zero = np.zeros((nu, nu)), np.zeros((nu, nu)), np.zeros(nu), np.zeros(nu)

    def whole(count: int) -> np.ndarray:
        for _ in range(count):
            mass_and_bias(tree, flex, W, F, y, motion, zero, M, bias)
            _, x, _ = dposv(M.T, -bias, overwrite_a=1)
        return x

    def solve(count: int) -> None:
        for _ in range(count):
            dposv(kept.T, bias)

    mass_and_bias(tree, flex, W, F, y, motion, zero, M, bias)
    kept[:] = M
    full = np.tril(kept) + np.tril(kept, -1).T
    residual = np.abs(full @ udot + bias).max() / (np.abs(full) @ np.abs(udot) + np.abs(bias)).max()
    if not residual < 1e-12:  # round-off of sums over the chain
        raise RuntimeError(f"dense and order-n accelerations differ: residual {residual:.1e}")
    return whole, solve
