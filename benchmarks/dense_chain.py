"""The dense way to the same accelerations, as quick as it is usually written: composite bodies, then LAPACK.

The mass matrix of a tree with revolute hinges by the composite-body algorithm, one row per coordinate carried
from its link to the root, O(N depth) after O(n); the bias by one inverse dynamics; Cholesky solution by LAPACK.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.linalg.lapack import dposv

from modalprep.compiler.jit import compile_kernel
from modalprep.multibody.kernels.algebra.inertia_blocks import blocks, parts, rotated, shifted
from modalprep.multibody.kernels.algebra.matrices import times
from modalprep.multibody.kernels.algebra.rows import mode6
from modalprep.multibody.kernels.algebra.tuples import (
    add3,
    add6,
    add9,
    cross,
    get3,
    get6,
    get9,
    put6,
    put9,
)
from modalprep.multibody.kernels.articulated_body import outward
from modalprep.multibody.kernels.modal import (
    add_modal_forces,
    add_to_modes,
)
from modalprep.multibody.kernels.newton_euler import required_forces


@compile_kernel
def mass_and_bias(model, data, y, motion, udot, M, bias):
    """Fill the lower triangle of ``M (nu, nu)`` and ``bias (nu,)``; `udot` is zero."""
    outward(model, data, y, motion)
    _compose(model, data)
    M[:] = 0.0
    for i in range(len(model.links)):
        u, own = model.links[i].u, data.links[i]
        M[u, u] = own.J[5]
        _carry(model, data, i, (own.H[2], own.H[5], own.H[8], own.J[2], own.J[4], own.J[5]), M[u])
        _modal_rows(data.modal, model, data, i, M)
    outward(model, data, y, motion)
    required_forces(model, data, udot, bias)


@compile_kernel
def _modal_rows(modal, model, data, i, M):
    """Write the rows of M of link i's modes."""
    if modal is None:
        return
    u, own, s = model.links[i].u, model.links[i].uq, model.links[i].slot
    for a in range(model.links[i].modes):
        M[own + a, u] = modal.M_rf[s, 5, a]
        for b in range(a + 1):
            M[own + a, own + b] = modal.M_ff[s, b, a]
        _carry(model, data, i, mode6(modal.M_rf[s], a), M[own + a])


@compile_kernel
def _compose(model, data):
    """Add the inertia of all that a link carries to its own, and to its modal rows."""
    for i in range(len(model.links) - 1, 0, -1):
        own, parent = data.links[i], data.links[model.links[i].parent]
        arm = get3(own.arm)
        B = rotated(get9(own.rotation), blocks(get6(own.M), get9(own.H), get6(own.J)))
        M, H, J = parts(B)
        add_to_modes(data.modal, model, i, M, H, J, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0), arm)
        M, H, J = parts(shifted(B, arm))
        put6(parent.M, add6(get6(parent.M), M))
        put9(parent.H, add9(get9(parent.H), H))
        put6(parent.J, add6(get6(parent.J), J))


@compile_kernel
def _carry(model, data, i, force, row):
    """Write a row of M left of its link: the force that its unit acceleration asks of every ancestor."""
    f, t = (force[0], force[1], force[2]), (force[3], force[4], force[5])
    while model.links[i].parent < len(model.links):
        p, turn = model.links[i].parent, get9(data.links[i].rotation)
        f, t = times(turn, f), times(turn, t)
        add_modal_forces(data.modal, model, i, f, t, row)
        t = add3(t, cross(get3(data.links[i].arm), f))
        row[model.links[p].u] = t[2]
        i = p


def dense(given: tuple) -> tuple[Callable[[int], None], Callable[[int], None]]:
    """Return a call of the whole dense evaluation, and one of LAPACK's part alone; both checked against order n."""
    model, data, y, motion, _, udot = given
    nu = len(udot)
    M, kept, bias, zero = np.zeros((nu, nu)), np.zeros((nu, nu)), np.zeros(nu), np.zeros(nu)

    def whole(count: int) -> np.ndarray:
        for _ in range(count):
            mass_and_bias(model, data, y, motion, zero, M, bias)
            _, x, _ = dposv(M.T, -bias, overwrite_a=1)
        return x

    def solve(count: int) -> None:
        for _ in range(count):
            dposv(kept.T, bias)

    mass_and_bias(model, data, y, motion, zero, M, bias)
    kept[:] = M
    full = np.tril(kept) + np.tril(kept, -1).T
    residual = np.abs(full @ udot + bias).max() / (np.abs(full) @ np.abs(udot) + np.abs(bias)).max()
    if not residual < 1e-12:  # round-off of sums over the chain
        raise RuntimeError(f"dense and order-n accelerations differ: residual {residual:.1e}")
    return whole, solve
