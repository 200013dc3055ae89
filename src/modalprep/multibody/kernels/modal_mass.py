"""The second order of the modal mass, of bodies with T: theory 4.7."""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline
from modalprep.multibody.kernels.algebra.matrices import antisymmetric
from modalprep.multibody.kernels.algebra.tuples import ZERO3, axpy3
from modalprep.multibody.kernels.data import GROWS


@compile_inline
def rest_coordinates(modal, model, i):
    """Write eta(q) of the rest of link i's motion and its rate; of a body with T also ``d eta`` and its rate."""
    s = model.links[i].slot
    for a in range(len(modal.eta)):
        modal.eta[a] = modal.q[s, a]
        modal.etad[a] = modal.qd[s, a]
    if model.links[i].modal_mass == GROWS:
        _add_second_order_of_eta(modal, model, i)


@compile_inline
def _add_second_order_of_eta(modal, model, i):
    """Add ``c q q / 2`` to eta and its rate to eta'; writes ``d eta = 1 + c q`` and ``c q'``."""
    k = model.links[i].kind
    n = model.links[i].modes
    q = modal.q[model.links[i].slot]
    qd = modal.qd[model.links[i].slot]
    for a in range(n):
        for b in range(n):
            modal.d_eta[a, b] = 0.0
            modal.d_etad[a, b] = 0.0
    for j in range(n):
        for a in range(n):
            for b in range(n):
                modal.d_eta[a, b] += q[j] * model.modal.c[k, j, a, b]
                modal.d_etad[a, b] += qd[j] * model.modal.c[k, j, a, b]
    for a in range(n):
        for b in range(n):
            modal.eta[a] += 0.5 * modal.d_eta[a, b] * q[b]
            modal.etad[a] += modal.d_eta[a, b] * qd[b]
        modal.d_eta[a, a] += 1.0


@compile_inline
def apply_slopes(modal, model, i):
    """Turn `P_eta` and `gyro` of a body with T from rows of eta to rows of q.

    Writes ``c q' q'`` and its modal force ``d eta^T M' (c q' q')``; returns its torque.
    """
    k = model.links[i].kind
    n = model.links[i].modes
    qd = modal.qd[model.links[i].slot]
    torque = ZERO3
    for a in range(n):
        bias = 0.0
        for b in range(n):
            bias += modal.d_etad[a, b] * qd[b]
        modal.eta_bias[a] = bias
        modal.eta_force[a] = 0.0
        torque = axpy3(torque, bias, antisymmetric(modal.P_eta[:, a]))
    for a in range(n):
        force = 0.0
        for b in range(n):
            force += modal.integrals.M_rest[k, a, b] * modal.eta_bias[b]
        for b in range(n):
            modal.eta_force[b] += modal.d_eta[a, b] * force
    for c in range(9):
        _times_slopes(modal, modal.P_eta[c], n)
    for c in range(3):
        _times_slopes(modal, modal.gyro[c], n)
    return torque


@compile_inline
def _times_slopes(modal, x, n):
    """Replace a row x by ``x d eta``."""
    for a in range(n):
        modal.row[a] = x[a]
        x[a] = 0.0
    for b in range(n):
        for a in range(n):
            x[a] += modal.row[b] * modal.d_eta[b, a]


@compile_inline
def add_second_order(modal, k, s, n):
    """Add ``d eta^T M' d eta - M'`` of a body with T to the upper half of its M_ff."""
    M_rest = modal.integrals.M_rest[k]
    M_ff = modal.M_ff[s]
    for a in range(n):
        for b in range(n):
            modal.M_d_eta[a, b] = 0.0
        for c in range(n):
            for b in range(n):
                modal.M_d_eta[a, b] += M_rest[a, c] * modal.d_eta[c, b]
    for a in range(n):
        for b in range(a, n):
            M_ff[a, b] -= M_rest[a, b]
    for c in range(n):
        for a in range(n):
            for b in range(a, n):
                M_ff[a, b] += modal.d_eta[c, a] * modal.M_d_eta[c, b]
