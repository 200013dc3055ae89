"""The accelerations that many generalised forces make: columns of the inverse mass matrix, four at a time, O(n) each.

`prepare` finds once per state what all columns need: the speeds of a joint are eliminated one by one, each as that of a
joint of one axis, so that all kinds are alike; modes are eliminated by `inward` already, and the inverse of their
matrix takes the place of its factors, whose substitutions wait for each other mode after mode. Wrenches and
accelerations are spatial vectors of four columns, axes of the link.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from modalprep.compiler.by_address import by_address
from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.compiler.lanes import (
    WIDTH,
    add_lanes,
    four,
    get_lanes,
    get_lanes6,
    lanes,
    larger,
    numbers,
    put_lanes,
    put_lanes6,
)
from modalprep.multibody.kernels.algebra.matrices import (
    inertia_times,
    less_outer,
    less_product,
    times,
    transposed_times,
)
from modalprep.multibody.kernels.algebra.rows import mode6, zero6
from modalprep.multibody.kernels.algebra.tuples import (
    add3,
    add6,
    axpy6,
    cross,
    dot6,
    get3,
    get6,
    get9,
    put6,
    take6,
    unsigned,
)
from modalprep.multibody.kernels.data import Model
from modalprep.multibody.kernels.joints import joint_direction
from modalprep.multibody.kernels.modal_interfaces import on_shape

AXIS = 13  # of a speed: its direction S, I S / (S' I S) and 1 / (S' I S)


@by_address
class ModeResponses(NamedTuple):
    """Of flexible bodies: `prepare` writes all but the last."""

    inverse: np.ndarray  # (nf, N, N) of the modal mass matrix with all that the modes carry
    coupled: np.ndarray  # (nf, N, 8) that inverse times the modes' coupling with the link, six numbers
    held: np.ndarray  # (nf, N, 4) accelerations of the modes while their link is held


@by_address
class Responses(NamedTuple):
    """Scratch of `prepare` and `respond`."""

    axes: np.ndarray  # (nu, AXIS)
    links: np.ndarray  # (nl + 1, 24) wrenches, then accelerations
    block: np.ndarray  # (nu, 4) generalised forces, then accelerations
    modes: ModeResponses | None


def new_responses(model: Model, speeds: int) -> Responses:
    """Return new scratch for a number of speeds.

    Examples
    --------
    >>> from modalprep import Joint, System
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.packing.tree import pack
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> new_responses(pack(System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,))).model, 3).links.shape
    (2, 24)
    """
    links = np.zeros((len(model.links) + 1, 6 * WIDTH))
    return Responses(np.zeros((speeds, AXIS)), links, np.zeros((speeds, WIDTH)), _new_modes(model))


def _new_modes(model: Model) -> ModeResponses | None:
    if model.modal is None:
        return None
    count, N = int(model.links["slot"].max()) + 1, model.modal.K.shape[1]
    return ModeResponses(np.zeros((count, N, N)), np.zeros((count, N, 2 * WIDTH)), np.zeros((count, N, WIDTH)))


@compile_kernel
def prepare(model, data, work):
    """Write what `respond` takes, after `inward`, which it needs no more."""
    for i in range(len(model.links)):
        _eliminate_axes(model.links[i], data.links[i], work.axes)
        _invert_modes(data.modal, model, i, work.modes)


@compile_kernel
def respond(model, data, factor, forces, out, row, column, scale, sizes, work):
    """Write the accelerations that generalised forces ``factor * forces (nu, k)`` alone make, after `prepare`.

    Parameters
    ----------
    out : array
        Nothing but ``out[row : row + nu, column : column + k]`` is written.
    scale : (nu,)
        Size of each coordinate.
    sizes : (k,) or (0,)
        The largest of each column, in the scales.
    work : Responses
    """
    for b in range(0, forces.shape[1], WIDTH):
        count = min(WIDTH, forces.shape[1] - b)
        _take(forces, b, count, factor, work.block)
        _sweep(model, data, work)
        _put(work.block, count, out, unsigned(row), unsigned(column + b), scale, sizes[b:])


@compile_kernel
def mean_response(model, data, force, signs, scale, work):
    """Return the largest root mean square, in the scales, of what forces (nu,) times signs (nu, 4) accelerate.

    After `prepare`.
    """
    block = work.block
    for u in range(len(block)):
        put_lanes(block[u], 0, force[u] * get_lanes(signs[u], 0))
    _sweep(model, data, work)
    most = 0.0
    for u in range(len(block)):
        found = (1.0 / scale[u]) * get_lanes(block[u], 0)
        most = max(most, add_lanes(found * found))
    return math.sqrt(most / WIDTH)


@compile_kernel
def _sweep(model, data, work):
    """Write the accelerations of the forces of the block in their place."""
    for i in range(len(work.links)):
        put_lanes6(work.links[i], zero6())
    for i in range(len(model.links) - 1, -1, -1):
        _bring_inward(model, data, i, work)
    for i in range(len(model.links)):
        _accelerate(model, data, i, work)


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
        if c < min(count, len(sizes)):
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
def _invert_modes(modal, model, i, modes):
    """Write the inverse of the modal matrix of link i, from its factors, and what it makes of the coupling."""
    if modal is not None:
        s, n = model.links[i].slot, model.links[i].modes
        if n > 0:
            _invert(modal, s, n, modes.inverse[s], modes.held[s])
            _couple(modal, s, n, modes.coupled[s], modes.held[s])


@compile_inline
def _invert(modal, s, n, inverse, x):
    """Write an inverse, four columns at a time."""
    for b in range(0, n, WIDTH):
        for a in range(n):
            put_lanes(x[a], 0, four(0.0))
        for k in range(min(WIDTH, n - b)):
            x[b + k, k] = 1.0
        for a in range(b, n):
            f = modal.inverse[s, a] * get_lanes(x[a], 0)
            for c in range(a + 1, n):
                put_lanes(x[c], 0, get_lanes(x[c], 0) - f * modal.M_ff[s, a, c])
        _substitute(modal, s, n, x)
        for a in range(n):
            put_lanes(inverse[a], b, get_lanes(x[a], 0))


@compile_inline
def _couple(modal, s, n, coupled, x):
    """Write the inverse times the coupling."""
    M = modal.M_rf[s]
    for a in range(n):
        put_lanes(x[a], 0, lanes(M[0, a], M[1, a], M[2, a], M[3, a]))
    _substitute(modal, s, n, x)
    for a in range(n):
        put_lanes(coupled[a], 0, get_lanes(x[a], 0))
        put_lanes(x[a], 0, lanes(M[4, a], M[5, a], 0.0, 0.0))
    _substitute(modal, s, n, x)
    for a in range(n):
        put_lanes(coupled[a], WIDTH, get_lanes(x[a], 0))


@compile_inline
def _substitute(modal, s, n, x):
    """Substitute back."""
    for a in range(n - 1, -1, -1):
        found = modal.inverse[s, a] * get_lanes(x[a], 0)
        put_lanes(x[a], 0, found)
        for c in range(a):
            put_lanes(x[c], 0, get_lanes(x[c], 0) - modal.M_ff[s, c, a] * found)


@compile_inline
def _bring_inward(model, data, i, work):
    """Take modes and joint of link i out of the forces on it, and add what is left to its parent."""
    link, forces, axes, links = model.links[i], work.block, work.axes, work.links
    W = _through_modes(work.modes, model, i, forces, get_lanes6(links[i]))
    first, count = unsigned(link.u), unsigned(link.uq - link.u)
    for k in range(count):
        u = first + (count - 1 - k)
        axis = axes[u]
        own = get_lanes(forces[u], 0) + dot6(take6(axis, 0), W)
        put_lanes(forces[u], 0, own)
        W = axpy6(W, -1.0 * own, take6(axis, 6))
    if link.parent < len(model.links):
        turn = get9(data.links[i].rotation)
        f, t = times(turn, W[:3]), times(turn, W[3:])
        _add_to_modes(data.modal, model, i, forces, f, t)
        t = add3(t, cross(get3(data.links[i].arm), f))
        parent = links[unsigned(link.parent)]
        put_lanes6(parent, add6(get_lanes6(parent), (f[0], f[1], f[2], t[0], t[1], t[2])))


@compile_inline
def _accelerate(model, data, i, work):
    """Write the accelerations of link i, its joint and its modes."""
    link, forces, axes, links = model.links[i], work.block, work.axes, work.links
    A = get_lanes6(links[unsigned(link.parent)])
    v, t = add3(A[:3], cross(A[3:], get3(data.links[i].arm))), A[3:]
    A = _of_parent_modes(data.modal, model, i, forces, (v[0], v[1], v[2], t[0], t[1], t[2]))
    turn = get9(data.links[i].rotation)
    v, t = transposed_times(turn, A[:3]), transposed_times(turn, A[3:])
    A = (v[0], v[1], v[2], t[0], t[1], t[2])
    for u in range(unsigned(link.u), unsigned(link.uq)):
        axis = axes[u]
        found = axis[12] * get_lanes(forces[u], 0) - dot6(take6(axis, 6), A)
        put_lanes(forces[u], 0, found)
        A = axpy6(A, found, take6(axis, 0))
    put_lanes6(links[i], A)
    _accelerate_modes(work.modes, model, i, forces, A)


@compile_inline
def _through_modes(modes, model, i, forces, W):
    """Eliminate the modal forces of link i; return the wrench on it with what they leave."""
    if modes is not None:
        s, u = unsigned(model.links[i].slot), unsigned(model.links[i].uq)
        n = unsigned(model.links[i].modes)
        for a in range(n):
            W = axpy6(W, -1.0 * get_lanes(forces[u + a], 0), take6(modes.coupled[s, a], 0))
        for a in range(0, n, WIDTH):
            _hold(modes.inverse[s], forces, u, n, a, modes.held[s])
    return W


@compile_inline
def _hold(inverse, forces, u, n, a, held):
    """Write the accelerations of four modes from a on under the modal forces alone."""
    v, w, x, y = four(0.0), four(0.0), four(0.0), four(0.0)
    for c in range(n):
        f, row = get_lanes(forces[u + c], 0), inverse[c]
        v += row[a] * f
        w += row[a + 1] * f
        x += row[a + 2] * f
        y += row[a + 3] * f
    put_lanes(held[a], 0, v)
    put_lanes(held[a + 1], 0, w)
    put_lanes(held[a + 2], 0, x)
    put_lanes(held[a + 3], 0, y)


@compile_inline
def _add_to_modes(modal, model, i, forces, force, torque):
    """Add the wrench of link i, parent link's axes, to the parent's modal forces."""
    if modal is not None:
        slot, p = model.links[i].phi, model.links[i].parent
        if slot >= 0:
            u, phi = unsigned(model.links[p].uq), unsigned(slot)
            for a in range(unsigned(model.links[p].modes)):
                put_lanes(forces[u + a], 0, get_lanes(forces[u + a], 0) + on_shape(modal, phi, a, force, torque))


@compile_inline
def _of_parent_modes(modal, model, i, forces, A):
    """Return the acceleration of link i's place on its parent with that by the parent's modes."""
    if modal is not None:
        slot, p = model.links[i].phi, model.links[i].parent
        if slot >= 0:
            u, phi = unsigned(model.links[p].uq), unsigned(slot)
            for a in range(unsigned(model.links[p].modes)):
                A = axpy6(A, get_lanes(forces[u + a], 0), mode6(modal.Phi[phi], a))
    return A


@compile_inline
def _accelerate_modes(modes, model, i, forces, A):
    """Write q'' of link i."""
    if modes is not None:
        s, u = unsigned(model.links[i].slot), unsigned(model.links[i].uq)
        n = unsigned(model.links[i].modes)
        for a in range(n):
            put_lanes(forces[u + a], 0, get_lanes(modes.held[s, a], 0) - dot6(take6(modes.coupled[s, a], 0), A))
