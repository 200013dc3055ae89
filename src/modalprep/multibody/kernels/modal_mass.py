"""The part of the order-n kernel that concerns T, the second order of the modal mass: theory 4.7."""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline
from modalprep.multibody.kernels.algebra.tuples import axpy3
from modalprep.multibody.kernels.data import GROWS


@compile_inline
def rest_coordinates(modal, model, i):
    """Write eta(q) of the rest of link i's motion and its rate to F; of a body with T also the slopes of eta."""
    k, s, n = model.links[i].kind, model.links[i].slot, model.links[i].modes
    for a in range(modal.eta.shape[1]):
        modal.eta[0, a], modal.eta[1, a] = modal.q[s, a], modal.qd[s, a]
    if model.links[i].modal_mass < GROWS:
        return
    for a in range(n):
        for b in range(n):
            modal.slope[0, a, b], modal.slope[1, a, b] = 0.0, 0.0
    for j in range(n):
        f, g = modal.q[s, j], modal.qd[s, j]
        for a in range(n):
            for b in range(n):
                modal.slope[0, a, b] += f * model.modal.second[k, j, a, b]
                modal.slope[1, a, b] += g * model.modal.second[k, j, a, b]
    for a in range(n):
        for b in range(n):
            modal.eta[0, a] += 0.5 * modal.slope[0, a, b] * modal.q[s, b]
            modal.eta[1, a] += modal.slope[0, a, b] * modal.qd[s, b]
        modal.slope[0, a, a] += 1.0


@compile_inline
def apply_slopes(modal, model, i):
    """Turn the rows of the rest of a body with T from eta to q; returns the torque of the acceleration ``c q' q'``.

    `curved` gets ``c q' q'`` and its modal force ``d eta^T M' (c q' q')``.
    """
    k = model.links[i].kind
    s = model.links[i].slot
    n = model.links[i].modes
    N = modal.q.shape[1]
    torque = (0.0, 0.0, 0.0)
    for a in range(n):
        f = 0.0
        for b in range(n):
            f += modal.slope[1, a, b] * modal.qd[s, b]
        modal.curved[1, a], modal.curved[0, a] = 0.0, f
        e = modal.rest
        turn = (e[7 * N + a] - e[5 * N + a], e[2 * N + a] - e[6 * N + a], e[3 * N + a] - e[N + a])
        torque = axpy3(torque, f, turn)
    for a in range(n):
        force = 0.0
        for b in range(n):
            force += modal.integrals.mass[k, a, b] * modal.curved[0, b]
        for b in range(n):
            modal.curved[1, b] += modal.slope[0, a, b] * force
    _through_slopes(modal, modal.rest, 9, n, N)
    _through_slopes(modal, modal.gyro, 3, n, N)
    return torque


@compile_inline
def _through_slopes(modal, rows, count, n, N):
    """Replace so many rows of eta by those of q, ``rows d eta``."""
    for c in range(count):
        for a in range(n):
            modal.turned[a] = rows[c * N + a]
            rows[c * N + a] = 0.0
        for b in range(n):
            f = modal.turned[b]
            for a in range(n):
                rows[c * N + a] += f * modal.slope[0, b, a]


@compile_inline
def grown_mass(modal, k, s, n):
    """Add ``d eta^T M' d eta - M'`` of a body with T to the upper half of M_ff in modal.Z."""
    for a in range(n):
        for b in range(n):
            modal.slope[2, a, b] = 0.0
        for c in range(n):
            for b in range(n):
                modal.slope[2, a, b] += modal.integrals.mass[k, a, c] * modal.slope[0, c, b]
    for a in range(n):
        for b in range(a, n):
            modal.Z[s, a, 8 + b] -= modal.integrals.mass[k, a, b]
    for c in range(n):
        for a in range(n):
            f = modal.slope[0, c, a]
            for b in range(a, n):
                modal.Z[s, a, 8 + b] += f * modal.slope[2, c, b]
