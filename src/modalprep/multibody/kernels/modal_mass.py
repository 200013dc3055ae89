"""The part of the order-n kernel that concerns T, the second order of the modal mass: theory 4.7."""

from __future__ import annotations

from modalprep.jit import compile_inline
from modalprep.multibody.kernels.data import HAS_KG, KIND, MODES, SLOT
from modalprep.multibody.kernels.spatial import axpy3, take9

GROWS = 2  # in HAS_KG: the body has T


@compile_inline
def rest_coordinates(tree, flex, F, i):
    """Write eta(q) of the rest of link i's motion and its rate to F; of a body with T also the slopes of eta."""
    k, s, n = tree.ints[i, KIND], tree.ints[i, SLOT], tree.ints[i, MODES]
    for a in range(F.eta.shape[1]):
        F.eta[0, a], F.eta[1, a] = F.q[s, a], F.qd[s, a]
    if tree.ints[i, HAS_KG] < GROWS:
        return
    for a in range(n):
        for b in range(n):
            F.slope[0, a, b], F.slope[1, a, b] = 0.0, 0.0
    for j in range(n):
        f, g = F.q[s, j], F.qd[s, j]
        for a in range(n):
            for b in range(n):
                F.slope[0, a, b] += f * flex.second[k, j, a, b]
                F.slope[1, a, b] += g * flex.second[k, j, a, b]
    for a in range(n):
        for b in range(n):
            F.eta[0, a] += 0.5 * F.slope[0, a, b] * F.q[s, b]
            F.eta[1, a] += F.slope[0, a, b] * F.qd[s, b]
        F.slope[0, a, a] += 1.0


@compile_inline
def apply_slopes(tree, flex, F, i):
    """Turn the rows of the rest of a body with T from eta to q; returns the torque of the acceleration ``c q' q'``.

    F.turned gets ``c q' q'`` (row 10) and its modal force ``d eta^T M' (c q' q')`` (row 9).
    """
    k, s, n = tree.ints[i, KIND], tree.ints[i, SLOT], tree.ints[i, MODES]
    torque = (0.0, 0.0, 0.0)
    for a in range(n):
        e, f = take9(F.rest, 9 * a), 0.0
        for b in range(n):
            f += F.slope[1, a, b] * F.qd[s, b]
        F.turned[9, a], F.turned[10, a] = 0.0, f
        torque = axpy3(torque, f, (e[7] - e[5], e[2] - e[6], e[3] - e[1]))
    for a in range(n):
        force = 0.0
        for b in range(n):
            force += flex.mass[k, a, b] * F.turned[10, b]
        for b in range(n):
            F.turned[9, b] += F.slope[0, a, b] * force
    _through_slopes(F, F.rest, 9, n)
    _through_slopes(F, F.gyro, 3, n)
    return torque


@compile_inline
def _through_slopes(F, rows, width, n):
    """Replace rows ``(n, width)`` of eta by those of q, ``d eta^T rows``."""
    for a in range(n):
        for c in range(width):
            F.turned[c, a], rows[width * a + c] = rows[width * a + c], 0.0
    for b in range(n):
        for a in range(n):
            f = F.slope[0, b, a]
            for c in range(width):
                rows[width * a + c] += f * F.turned[c, b]


@compile_inline
def grown_mass(flex, F, k, s, n):
    """Add ``d eta^T M' d eta - M'`` of a body with T to the upper half of M_ff in F.Z."""
    for a in range(n):
        for b in range(n):
            F.slope[2, a, b] = 0.0
        for c in range(n):
            for b in range(n):
                F.slope[2, a, b] += flex.mass[k, a, c] * F.slope[0, c, b]
    for a in range(n):
        for b in range(a, n):
            F.Z[s, a, 1 + (b >> 3), b & 7] -= flex.mass[k, a, b]
    for c in range(n):
        for a in range(n):
            f = F.slope[0, c, a]
            for b in range(a, n):
                F.Z[s, a, 1 + (b >> 3), b & 7] += f * F.slope[2, c, b]
