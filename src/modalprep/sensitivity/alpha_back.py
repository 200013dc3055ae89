"""Steps of generalised-alpha from the last to the first, in compiled code: theory 5.9.

A step is reversed by one solution with ``A' = M + c1 D' + c2 T' K'`` at its end (generalised_alpha.py), of which only
products are known. It is found by GMRES (Saad and Schultz 1986) beside the matrix ``P = M + c1 D_0 + c2 K_0`` of modes
and hinges, which the recursion solves with: ``A' P^-1 y = y + (A' - P) P^-1 y``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.compiler.by_address import by_address
from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.multibody.evaluation.evaluate import GOOD, hinge_slopes, load
from modalprep.multibody.kernels.algebra.tuples import add3, copy, cross, get3, put3, scaled3
from modalprep.multibody.kernels.articulated_body import inward
from modalprep.multibody.kernels.modal_dampers import subtract_damper_forces
from modalprep.multibody.kernels.newton_euler import required_forces
from modalprep.multibody.kernels.tangents.data import Sweep
from modalprep.multibody.kernels.tangents.outward import outward_tangents
from modalprep.multibody.kernels.tangents.pulled_rates import pull_rates
from modalprep.multibody.model.joint_types import FREE, WITH_QUATERNION
from modalprep.sensitivity.force_back import keep_products
from modalprep.sensitivity.solutions import accelerate
from modalprep.sensitivity.stages_back import evaluate_stage, products, pulled_products

NOT_SOLVED = -2  # beside the status of an evaluation
LEFT = 1e-13  # of the right side: below, the solution is one
MOST, RESTARTS = 60, 20  # vectors that are kept, and how often
LEAST = 1e-18  # of a sum: terms below do not count


@by_address
class AlphaSteps(NamedTuple):
    """What steps of generalised-alpha have beside `Steps`."""

    ratio: np.ndarray  # (k,) length over that of the step before, 0 where the method begins
    algorithmic: np.ndarray  # (k, 2, nu) at begin and end
    first: np.ndarray  # (k,) row of the evaluation at the begin, where the method begins


@by_address
class AlphaWork(NamedTuple):
    """Work of a step."""

    method: np.ndarray  # (5,) am, af, beta, gamma, c
    scale: np.ndarray  # (nu,) of the coordinates
    moved: np.ndarray  # (nu,) increments of the step
    x: np.ndarray  # (nu,) gradients by the increments at the end
    u: np.ndarray  # (nu,) by the speeds there
    turned: np.ndarray  # (2, nu)
    basis: np.ndarray  # (m + 1, nu)
    inverse: np.ndarray  # (2, nu) P^-1 of a vector, and the vector
    H: np.ndarray  # (m + 1, m)
    turns: np.ndarray  # (m, 2) Givens rotations
    rest: np.ndarray  # (m + 1,)
    right: np.ndarray  # (nu,)
    found: np.ndarray  # (nu,)
    none: np.ndarray  # (nx + nu,) zeros
    products: np.ndarray  # sums of force elements, kept while a solution is sought
    wrench: np.ndarray  # (nl, 6) of the links, which products change
    by_q: np.ndarray  # (nf, 6 + N, N) of flexible bodies


def new_alpha_work(nx: int, scale: np.ndarray, method: np.ndarray, neighbours: int, work: Sweep) -> AlphaWork:
    """Return the work of a system with coordinates of such sizes, and such work of the derivatives."""
    nu = len(scale)
    m = min(nu, MOST)
    return AlphaWork(
        method=method,
        scale=scale,
        moved=np.empty(nu),
        x=np.empty(nu),
        u=np.empty(nu),
        turned=np.empty((2, nu)),
        basis=np.empty((m + 1, nu)),
        inverse=np.empty((2, nu)),
        H=np.empty((m + 1, m)),
        turns=np.empty((m, 2)),
        rest=np.empty(m + 1),
        right=np.empty(nu),
        found=np.empty(nu),
        none=np.zeros(nx + nu),
        products=np.zeros(neighbours),
        wrench=np.empty((len(work.frames), 6)),
        by_q=np.empty((1, 1, 1) if work.modes is None else work.modes.bodies.by_q.shape),
    )


@compile_kernel
def alpha_back(stages, steps, alpha, count, back, work, bar):
    """Replace the gradient by what is after `count` steps, ``bar (nx + 3 nu,)``, by that before them.

    Returns GOOD, the link whose pivot is not positive, or NOT_SOLVED.
    """
    back.joints[0] = 0.0
    for k in range(count - 1, -1, -1):
        for c in range(steps.after.shape[1]):
            bar[c] += steps.after[k, c]
        status = _factorise(stages, steps, k, back, work)
        if status >= 0:
            return status
        status = _step_back(stages, steps, alpha, k, back, work, bar)
        if status != GOOD:
            return status
    return GOOD


@compile_inline
def _widths(work, h):
    """Return c1 and c2."""
    c = work.method[4]
    return c * work.method[3] * h, c * work.method[2] * h * h


@compile_kernel
def _factorise(stages, steps, k, back, work):
    """Evaluate the end of step k, and factorise the matrix of the method there in the data of the other stage."""
    eq, other = stages.s0, stages.s1
    t, y = steps.time[k], steps.states[k]
    load(eq, t, y)
    required_forces(eq.model, eq.data, steps.accelerations[k], work.x)
    outward_tangents(eq.model, eq.data, back.work)
    for i in range(len(work.wrench)):
        copy(back.work.frames[i].wrench, work.wrench[i])
    _copy_modes(back.work.modes, work.by_q, True)
    load(other, t, y)
    hinge_slopes(other)
    c1, c2 = _widths(work, steps.h[k])
    for i in range(len(eq.model.links)):
        for u in range(eq.model.links[i].u, eq.model.links[i].uq):
            other.hinge[u] = c1 * other.linear[1, u] + c2 * other.linear[0, u]
    return inward(other.model, other.data, other.tau, other.hinge, c1, c2)


@compile_inline
def _copy_modes(modes, kept, away):
    """Put the derivatives of the modal forces away, or back again; `modes` may be None."""
    if modes is not None:
        own = modes.bodies.by_q
        for s in range(len(own)):
            for c in range(own.shape[1]):
                if away:
                    copy(own[s, c], kept[s, c])
                else:
                    copy(kept[s, c], own[s, c])


@compile_kernel
def _products(eq, t, push, back, work):
    """Write the products of `push` with the derivatives by coordinates and speeds at the end of the step."""
    for i in range(len(work.wrench)):
        copy(work.wrench[i], back.work.frames[i].wrench)
    _copy_modes(back.work.modes, work.by_q, False)
    pulled_products(eq, t, push, back)


@compile_kernel
def _step_back(stages, steps, alpha, k, back, work, bar):
    """Go back over step k."""
    eq, push, h = stages.s0, steps.push[k], steps.h[k]
    nx, nu = eq.model.nx, len(push)
    ny = nx + nu
    am = work.method[0]
    af = work.method[1]
    beta = work.method[2]
    gamma = work.method[3]
    c = work.method[4]
    x, u, turned, begin = work.x, work.u, work.turned[0], steps.y[k]
    pull_rates(eq.model, steps.states[k], bar[:nx], work.none[:nu], work.none[:nu], back.own)
    for i in range(nu):
        x[i] = back.own[nx + i]
        u[i] = bar[nx + i]
        a, b = alpha.algorithmic[k, 0, i], alpha.algorithmic[k, 1, i]
        work.moved[i] = h * begin[nx + i] + h * h * ((0.5 - beta) * a + beta * b)
    carry_back(eq.model, work.moved, x, 1, turned)
    for i in range(nu):
        work.right[i] = bar[ny + i] + c * (bar[ny + nu + i] + h * h * beta * turned[i] + h * gamma * u[i])
    if not _solve(stages, steps, k, back, work, push):
        return NOT_SOLVED
    _products(eq, steps.time[k], push, back, work)
    for i in range(nu):
        back.joints[0] += push[i] * eq.tau[i]
        x[i] -= back.by_x[i]
        u[i] -= back.by_u[i]
    carry_back(eq.model, work.moved, x, 1, turned)
    carry_back(eq.model, work.moved, x, 0, work.turned[1])
    pull_rates(eq.model, begin, work.none[:nx], work.turned[1], work.none[:nu], back.own)
    for i in range(nx):
        bar[i] = -back.own[i]
    for i in range(nu):
        known = bar[ny + nu + i] + h * h * beta * turned[i] + h * gamma * u[i]
        a = h * h * (0.5 - beta) * turned[i] + h * (1.0 - gamma) * u[i] - am / (1.0 - am) * known
        bar[nx + i] = u[i] + h * turned[i]
        bar[ny + i] = af / (1.0 - am) * known + (1.0 - alpha.ratio[k]) * a
        bar[ny + nu + i] = alpha.ratio[k] * a
    if alpha.first[k] >= 0:
        return _begin_back(stages, steps, alpha.first[k], back, work, bar)
    return GOOD


@compile_kernel
def _begin_back(stages, steps, row, back, work, bar):
    """Go back through the accelerations at the begin, which are those of the state."""
    eq, push = stages.s1, steps.push[row]
    nx, nu = eq.model.nx, len(push)
    status = evaluate_stage(eq, back.kept, 1, steps.time[row], steps.states[row], back.rates[1])
    if status != GOOD:
        return status
    copy(back.rates[1, nx : nx + nu], steps.accelerations[row])
    accelerate(eq, bar[nx + nu : nx + 2 * nu], push)
    products(eq, 1, steps.time[row], push, back)
    for i in range(nu):
        back.joints[0] += push[i] * eq.tau[i]
        bar[nx + nu + i] = 0.0
    pull_rates(eq.model, steps.states[row], work.none[:nx], back.by_x, back.by_u, back.own)
    for i in range(nx + nu):
        bar[i] += back.own[i]
    return GOOD


@compile_kernel
def carry_back(model, d, x, more, out):
    """Write ``sum (-ad' d)^k x / (k + more)!``: `more` 0, what moves along with increments d, or 1, their tangent."""
    copy(x, out)
    for i in range(len(model.links)):
        link = model.links[i]
        if link.joint in WITH_QUATERNION:
            moves = link.joint == FREE
            s = link.u + 3 if moves else link.u
            spin, turn = get3(d[s:]), get3(x[s:])
            v, f = (get3(d[link.u :]), get3(x[link.u :])) if moves else ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
            total, force = turn, f
            for k in range(1, 100):
                share = 1.0 / (k + more)
                turn = scaled3(share, add3(cross(v, f), cross(spin, turn)))
                f = scaled3(share, cross(spin, f))
                total, force = add3(total, turn), add3(force, f)
                if _size(turn) + _size(f) <= LEAST * (_size(total) + _size(force)):
                    break
            put3(out[s:], total)
            if moves:
                put3(out[link.u :], force)


@compile_inline
def _size(v):
    return abs(v[0]) + abs(v[1]) + abs(v[2])


@compile_kernel
def _apply(stages, steps, k, back, work, v, out):
    """Write ``S A' P^-1 S^-1 v`` with the sizes S of the coordinates; P^-1 of it stays in `inverse`."""
    eq, other = stages.s0, stages.s1
    z, force = work.inverse[0], work.inverse[1]
    c1, c2 = _widths(work, steps.h[k])
    for i in range(len(v)):
        force[i] = v[i] / work.scale[i]
    accelerate(other, force, z)
    _products(eq, steps.time[k], z, back, work)
    carry_back(eq.model, work.moved, back.by_x, 1, work.turned[1])
    subtract_damper_forces(other.data.modal, other.model, 1.0, z, back.by_u)
    for i in range(len(v)):
        more = c1 * (back.by_u[i] - other.linear[1, i] * z[i]) + c2 * (work.turned[1, i] - other.linear[0, i] * z[i])
        out[i] = v[i] + work.scale[i] * more


@compile_kernel
def _solve(stages, steps, k, back, work, out):
    """Solve ``A' out = right``; returns whether it was found."""
    nu = len(out)
    keep_products(back.ends, work.products, True)
    found, right = work.found, work.basis[0]
    found[:] = 0.0
    size = 0.0
    for i in range(nu):
        right[i] = work.scale[i] * work.right[i]
        size += right[i] * right[i]
    size = np.sqrt(size)
    left = size
    for _ in range(RESTARTS):
        if left <= LEFT * size:
            break
        _improve(stages, steps, k, back, work, left, LEFT * size)
        _apply(stages, steps, k, back, work, found, work.basis[1])
        left = 0.0
        for i in range(nu):
            right[i] = work.scale[i] * work.right[i] - work.basis[1, i]
            left += right[i] * right[i]
        left = np.sqrt(left)
        if left <= 100.0 * LEFT * size:
            break
    for i in range(nu):
        work.inverse[1, i] = found[i] / work.scale[i]
    accelerate(stages.s1, work.inverse[1], out)
    keep_products(back.ends, work.products, False)
    return left <= 100.0 * LEFT * size


@compile_kernel
def _improve(stages, steps, k, back, work, size, least):
    """Add to `found` what leaves least of the first vector of the basis, of length `size`: GMRES once."""
    basis, H, rest = work.basis, work.H, work.rest
    nu, m = basis.shape[1], H.shape[1]
    rest[:] = 0.0
    for c in range(nu):
        basis[0, c] /= size
    rest[0] = size
    count = 0
    for j in range(m):
        new = basis[j + 1]
        _apply(stages, steps, k, back, work, basis[j], new)
        for i in range(j + 1):
            H[i, j] = _dot(basis[i], new)
            for c in range(nu):
                new[c] -= H[i, j] * basis[i, c]
        length = np.sqrt(_dot(new, new))
        _turn(H, work.turns, rest, j, length)
        count = j + 1
        if abs(rest[j + 1]) <= least or length == 0.0:
            break
        for c in range(nu):
            new[c] /= length
    for j in range(count - 1, -1, -1):
        total = rest[j]
        for i in range(j + 1, count):
            total -= H[j, i] * rest[i]
        rest[j] = total / H[j, j]
        for c in range(nu):
            work.found[c] += rest[j] * basis[j, c]


@compile_inline
def _dot(a, b):
    total = 0.0
    for c in range(len(a)):
        total += a[c] * b[c]
    return total


@compile_inline
def _turn(H, turns, rest, j, below):
    """Turn column j of H, with one more number below, to a triangle, and what is left with it."""
    for i in range(j):
        x, y = H[i, j], H[i + 1, j]
        H[i, j] = turns[i, 0] * x + turns[i, 1] * y
        H[i + 1, j] = turns[i, 0] * y - turns[i, 1] * x
    length = np.sqrt(H[j, j] * H[j, j] + below * below)
    turns[j, 0] = H[j, j] / length
    turns[j, 1] = below / length
    H[j, j] = length
    rest[j + 1] = -turns[j, 1] * rest[j]
    rest[j] = turns[j, 0] * rest[j]
