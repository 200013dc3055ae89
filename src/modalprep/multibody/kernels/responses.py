"""The accelerations that many generalised forces make: columns of the inverse mass matrix, four at a time, O(n) each.

Modes are eliminated by `inward` already. The speeds of a joint are eliminated one by one, each as that of a joint of
one axis, so that all kinds are alike. Wrenches and accelerations are spatial vectors of four columns, axes of the link.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.compiler.by_address import by_address
from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.compiler.lanes import WIDTH, four, get_lanes, get_lanes6, larger, numbers, put_lanes, put_lanes6
from modalprep.multibody.kernels.algebra.matrices import (
    inertia_times,
    less_outer,
    less_product,
    times,
    transposed_times,
)
from modalprep.multibody.kernels.algebra.rows import mode6, zero6
from modalprep.multibody.kernels.algebra.tuples import add3, add6, axpy6, cross, dot6, get3, get6, get9, put6, take6
from modalprep.multibody.kernels.joints import joint_direction
from modalprep.multibody.kernels.modal_interfaces import on_shape

AXIS = 13  # of a speed: its direction S, I S / (S' I S) and 1 / (S' I S)


@by_address
class Responses(NamedTuple):
    """Scratch of `respond`."""

    axes: np.ndarray  # (nu, AXIS)
    links: np.ndarray  # (nl + 1, 24) wrenches, then accelerations
    block: np.ndarray  # (nu, 4) generalised forces, then accelerations


def new_responses(links: int, speeds: int) -> Responses:
    """Return new scratch.

    Examples
    --------
    >>> new_responses(2, 5).links.shape
    (3, 24)
    """
    return Responses(np.zeros((speeds, AXIS)), np.zeros((links + 1, 6 * WIDTH)), np.zeros((speeds, WIDTH)))


@compile_kernel
def respond(model, data, factor, forces, out, row, column, scale, sizes, work):
    """Write the accelerations that generalised forces ``factor * forces (nu, k)`` alone make, after `inward`.

    Parameters
    ----------
    out : array
        Nothing but ``out[row : row + nu, column : column + k]`` is written.
    scale : (nu,)
        Size of each coordinate.
    sizes : (k,)
        The largest of each column, in the scales.
    work : Responses
    """
    axes, links, block = work.axes, work.links, work.block
    for i in range(len(model.links)):
        _eliminate_axes(model.links[i], data.links[i], axes)
    for b in range(0, forces.shape[1], WIDTH):
        for i in range(len(links)):
            put_lanes6(links[i], zero6())
        count = min(WIDTH, forces.shape[1] - b)
        _take(forces, b, count, factor, block)
        for i in range(len(model.links) - 1, -1, -1):
            _bring_inward(model, data, i, block, axes, links)
        for i in range(len(model.links)):
            _accelerate(model, data, i, block, axes, links)
        _put(block, count, out, row, column + b, scale, sizes[b:])


@compile_kernel
def add_squares(matrix, factor, out):
    """Add the sums of the squares of ``factor (m,)`` times each row of ``matrix (n, m)`` to ``out (n,)``."""
    for i in range(len(matrix)):
        row = matrix[i]
        total = 0.0
        for j in range(len(factor)):
            share = factor[j] * row[j]
            total += share * share
        out[i] += total


@compile_inline
def _take(forces, b, count, factor, block):
    """Take `count` columns from b on, times a factor, and zeros."""
    for u in range(len(block)):
        if count == WIDTH:
            put_lanes(block[u], 0, factor * get_lanes(forces[u], b))
        else:
            put_lanes(block[u], 0, four(0.0))
            for c in range(count):
                block[u, c] = factor * forces[u, b + c]


@compile_inline
def _put(block, count, out, row, column, scale, sizes):
    """Write `count` columns, and their largest numbers in the scales."""
    most = four(0.0)
    for u in range(len(block)):
        found = get_lanes(block[u], 0)
        share = (1.0 / scale[u]) * found
        most = larger(most, larger(share, -1.0 * share))
        if count == WIDTH:
            put_lanes(out[row + u], column, found)
        else:
            for c in range(count):
                out[row + u, column + c] = block[u, c]
    each = numbers(most)
    for c in range(WIDTH):
        if c < count:
            sizes[c] = each[c]


@compile_inline
def _eliminate_axes(link, own, axes):
    """Write the axes of a link's joint, the last speed eliminated first from its articulated inertia I."""
    M, H, J = get6(own.M), get9(own.H), get6(own.J)
    for s in range(link.uq - link.u - 1, -1, -1):
        v, w = joint_direction(link, s)
        S = v[0], v[1], v[2], w[0], w[1], w[2]
        column = inertia_times(M, H, J, S)
        g = 1.0 / dot6(S, column)
        f, t = column[:3], column[3:]
        axis = axes[link.u + s]
        put6(axis, S)
        put6(axis[6:], (g * f[0], g * f[1], g * f[2], g * t[0], g * t[1], g * t[2]))
        axis[12] = g
        M, H, J = less_outer(M, g, f), less_product(H, g, f, t), less_outer(J, g, t)


@compile_inline
def _bring_inward(model, data, i, forces, axes, links):
    """Take modes and joint of link i out of the forces on it, and add what is left to its parent."""
    link = model.links[i]
    W = _through_modes(data.modal, model, i, forces, get_lanes6(links[i]))
    for u in range(link.uq - 1, link.u - 1, -1):
        axis = axes[u]
        own = get_lanes(forces[u], 0) + dot6(take6(axis, 0), W)
        put_lanes(forces[u], 0, own)
        W = axpy6(W, -1.0 * own, take6(axis, 6))
    if link.parent < len(model.links):
        turn = get9(data.links[i].rotation)
        f, t = times(turn, W[:3]), times(turn, W[3:])
        _add_to_modes(data.modal, model, i, forces, f, t)
        t = add3(t, cross(get3(data.links[i].arm), f))
        parent = links[link.parent]
        put_lanes6(parent, add6(get_lanes6(parent), (f[0], f[1], f[2], t[0], t[1], t[2])))


@compile_inline
def _accelerate(model, data, i, forces, axes, links):
    """Write the accelerations of link i, its joint and its modes."""
    link = model.links[i]
    A = get_lanes6(links[link.parent])
    v, t = add3(A[:3], cross(A[3:], get3(data.links[i].arm))), A[3:]
    A = _of_parent_modes(data.modal, model, i, forces, (v[0], v[1], v[2], t[0], t[1], t[2]))
    turn = get9(data.links[i].rotation)
    v, t = transposed_times(turn, A[:3]), transposed_times(turn, A[3:])
    A = (v[0], v[1], v[2], t[0], t[1], t[2])
    for u in range(link.u, link.uq):
        axis = axes[u]
        found = axis[12] * get_lanes(forces[u], 0) - dot6(take6(axis, 6), A)
        put_lanes(forces[u], 0, found)
        A = axpy6(A, found, take6(axis, 0))
    put_lanes6(links[i], A)
    _accelerate_modes(data.modal, model, i, forces, A)


@compile_inline
def _through_modes(modal, model, i, forces, W):
    """Eliminate the modal forces of link i; return the wrench on it with what they leave."""
    if modal is not None:
        s, n, u = model.links[i].slot, model.links[i].modes, model.links[i].uq
        for a in range(n):
            f = modal.inverse[s, a] * get_lanes(forces[u + a], 0)
            for c in range(a + 1, n):
                put_lanes(forces[u + c], 0, get_lanes(forces[u + c], 0) - f * modal.M_ff[s, a, c])
            W = axpy6(W, -1.0 * f, mode6(modal.M_rf[s], a))
    return W


@compile_inline
def _add_to_modes(modal, model, i, forces, force, torque):
    """Add the wrench of link i, parent link's axes, to the parent's modal forces."""
    if modal is not None:
        slot, p = model.links[i].phi, model.links[i].parent
        if slot >= 0:
            for u in range(model.links[p].uq, model.links[p].uq + model.links[p].modes):
                a = u - model.links[p].uq
                put_lanes(forces[u], 0, get_lanes(forces[u], 0) + on_shape(modal, slot, a, force, torque))


@compile_inline
def _of_parent_modes(modal, model, i, forces, A):
    """Return the acceleration of link i's place on its parent with that by the parent's modes."""
    if modal is not None:
        slot, p = model.links[i].phi, model.links[i].parent
        if slot >= 0:
            for a in range(model.links[p].modes):
                A = axpy6(A, get_lanes(forces[model.links[p].uq + a], 0), mode6(modal.Phi[slot], a))
    return A


@compile_inline
def _accelerate_modes(modal, model, i, forces, A):
    """Write q'' of link i: back substitution."""
    if modal is not None:
        s, n, u = model.links[i].slot, model.links[i].modes, model.links[i].uq
        for a in range(n):
            put_lanes(forces[u + a], 0, get_lanes(forces[u + a], 0) - dot6(mode6(modal.M_rf[s], a), A))
        for a in range(n - 1, -1, -1):
            found = modal.inverse[s, a] * get_lanes(forces[u + a], 0)
            put_lanes(forces[u + a], 0, found)
            for c in range(a):
                put_lanes(forces[u + c], 0, get_lanes(forces[u + c], 0) - modal.M_ff[s, c, a] * found)
