"""Multipliers of constraints: which rows are independent, and what all of them do (theory 5.4).

The pivoted factor of ``G M^-1 G^T`` (responses.py) costs O(m^3) and tells the redundant rows. M is the mass matrix, or
the effective one of an implicit step: that of the last `inward`.

Order of calls: `outward_in_world`, `constraint_residual`, `inward_of_closed` (planar_tree.py),
`constraint_accelerations`. Arguments as in constraints.py.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.compiler.lanes import WIDTH, get_lanes, put_lanes
from modalprep.multibody.kernels.algebra.tuples import at
from modalprep.multibody.kernels.articulated_body import forward
from modalprep.multibody.kernels.closed_loops.constraints import SLIP
from modalprep.multibody.kernels.closed_loops.factor import factorize, factorize_and_solve, solve, take_multipliers
from modalprep.multibody.kernels.closed_loops.planar_tree import forward_in_plane
from modalprep.multibody.kernels.closed_loops.pushing import push
from modalprep.multibody.kernels.closed_loops.responses import write_responses

REGULAR, SINGULAR = 0.3, 0.2  # sines of independent rows: a step goes past a singular position, not into it
DEEP = 0.01  # accelerations have the round-off of coordinates over the third power of the sine
CLEAR = 4.0 * DEEP  # clearly not there: a step from here that ends there can pass it, when it is somewhat shorter
MOST_FRICTION_STEPS = 200  # iterations of friction and normal forces
FRICTION_SETTLED = 1e-13  # change of the friction at their end


@compile_inline
def _below(work, sine):
    """Whether fewer rows are independent than in the last closed state, or as many with one below a sine."""
    return work.rank[0] < work.held[0] or (work.rank[0] == work.held[0] and work.sine[0] < sine)


@compile_kernel
def is_deep(work):
    """Return whether the loops are where round-off decides the accelerations; no of None."""
    if work is None:
        return False
    return _below(work, DEEP)


@compile_kernel
def is_near(work):
    """Return whether the loops have come near a singular position since the last closed state; no of None."""
    if work is None:
        return False
    return _below(work, min(REGULAR, 0.5 * work.sine[1]))


@compile_kernel
def begins_regular(work):
    """Return whether the state of the last `factorize` is clearly not `is_deep`, and hold its rank; no of None."""
    if work is None:
        return False
    hold_rank(work)
    return work.sine[0] > CLEAR


@compile_kernel
def near_singular(work, again):
    """Return whether a step led the loops into a singular position, or near one, that it can pass; no of None.

    `again`: after a step that failed, only a position counts where round-off decides.
    """
    if work is None:
        return False
    if is_deep(work) and work.sine[1] > CLEAR:
        return True
    return not again and _below(work, SINGULAR) and work.sine[1] > REGULAR


@compile_kernel
def begin_step(work, implicit):
    """Forget how near the loops came to a singular position; both may be None."""
    if work is not None:
        work.sine[2] = 1.0
        if implicit is not None:
            implicit.sine[2] = 1.0


@compile_kernel
def came_near(work, implicit):
    """Return whether since `begin_step` the loops came so near a singular position that they may have passed it."""
    if work is None:
        return False
    least = work.sine[2]
    if implicit is not None and len(implicit.value) == len(work.value):  # without springs and bushings
        least = min(least, implicit.sine[2])
    return least < REGULAR


@compile_kernel
def free_rank(work):
    """Let `factorize` decide the rank by itself; `work` may be None."""
    if work is not None:
        work.held[0] = len(work.order)


@compile_kernel
def hold_rank(work):
    """Take the rank of the last `factorize` as that of a closed state; `work` may be None."""
    if work is not None:
        work.held[0], work.sine[1] = work.rank[0], work.sine[0]


@partial(compile_kernel, forceinline=True)
def constraint_accelerations(cons, model, data, work, alpha, beta, tau, udot):
    """Write the accelerations ``udot (nu,)`` for which ``Phi'' + 2 alpha Phi' + beta^2 Phi = 0``.

    After `constraint_residual` and `inward_of_closed`, in place of `forward`, whose arguments `tau` and `udot` are.
    alpha = beta = 0 with projection after steps; Baumgarte (1972) with both at some 5 to 50 1/s. Leaves the multipliers
    in `work`, and the data as a `forward` with them does, so that `node_acceleration` holds, and `reactions` after
    `push_links`. Without constraints (None) it is `forward`.
    """
    if cons is None:
        forward(model, data, tau, udot)
        return
    if alpha != 0.0 or beta != 0.0 or work.paths.slides > 0:
        _act_on_rows(cons, model, data, work, alpha, beta, tau, udot)
        return
    for b in range(len(work.bundles)):
        own = work.bundles[at(b)]
        put_lanes(work.given, WIDTH * b, -1.0 * (get_lanes(own.free, 0) + get_lanes(own.bias, 0)))
    factorize_and_solve(work)
    if work.flat[0] and work.paths.in_plane:
        forward_in_plane(model, data, work, udot)
        return
    push(model, data, work)
    forward(model, data, tau, udot)


@compile_kernel
def _act_on_rows(cons, model, data, work, alpha, beta, tau, udot):
    """Do as `constraint_accelerations` where rows are stabilised or resist by friction."""
    for p in range(len(work.paths.row)):
        i = work.paths.row[p]
        if i >= 0:
            free = work.bundles[p >> 2].free[p & 3]
            work.wanted[i] = free + work.bias[i] + 2.0 * alpha * work.rate[i] + beta * beta * work.phi[i]
    act(cons, model, data, work, tau, udot)


@compile_kernel
def act(cons, model, data, work, tau, udot):
    """Write the accelerations with multipliers that take `wanted` off the rows, after `respond`."""
    factorize(work)
    solve(work)
    if work.paths.slides > 0:
        _apply_friction(cons, work)
        take_multipliers(work)
    push(model, data, work)
    forward(model, data, tau, udot)


@compile_kernel
def _apply_friction(cons, work):
    """Let rows of sliding resist by friction, until it agrees with the normal forces that it changes itself.

    Where it never does (a jam) the multipliers are not finite.
    """
    write_responses(work)
    for i in range(len(cons.rows)):
        if cons.rows[i].kind == SLIP:
            work.goal[i] = 0.0
    change, size = np.inf, 0.0
    for _ in range(MOST_FRICTION_STEPS):
        change, size = 0.0, 0.0
        for i in range(len(cons.rows)):
            if cons.rows[i].kind == SLIP:
                f = _friction(cons, work, i)
                d = f - work.goal[i]
                work.goal[i] = f
                change, size = max(change, abs(d)), max(size, abs(f))
                for j in range(len(cons.rows)):
                    work.wanted[j] += work.S[j, i] * d
        if change <= FRICTION_SETTLED * size:
            break
        solve(work)
    for i in range(len(cons.rows)):
        if cons.rows[i].kind == SLIP:
            work.multiplier[i] = work.goal[i] if change <= FRICTION_SETTLED * size else np.nan


@compile_kernel
def _friction(cons, work, i):
    """Coulomb friction ``-mu N tanh(v / sliding) v_i / v`` along row i, N of the other rows of its closure."""
    normal, slip = 0.0, 0.0
    for j in range(len(cons.rows)):
        if cons.rows[j].a == cons.rows[i].a:
            if cons.rows[j].kind == SLIP:
                slip += work.rate[j] * work.rate[j]
            else:
                normal += work.multiplier[j] * work.multiplier[j]
    if slip == 0.0:
        return 0.0
    slip = np.sqrt(slip)
    resistance = cons.rows[i].friction * np.sqrt(normal) * np.tanh(slip / cons.rows[i].sliding)
    return -resistance * work.rate[i] / slip


@compile_inline
def constraint_power(cons, work, motion):
    """Power (W) of the prescribed values: what constraints that depend on time put into the system; 0 of None.

    A coupler does no work of its own: what it does at prescribed joints, their drives do not.
    """
    found = 0.0
    if cons is None:
        return found
    for k in range(len(cons.terms)):
        if cons.terms[k].x < 0:
            found -= _of_coupler(cons, work, k) * motion[cons.terms[k].link, 1]
    if work.paths.works == 0:
        return found
    for i in range(len(work.push)):
        found += work.multiplier[i] * work.push[i]
    return found


@compile_kernel
def couplers_along(cons, work, link):
    """Return the force or torque of couplers along the prescribed joint of a link; 0 of None."""
    found = 0.0
    if cons is None:
        return found
    for k in range(len(cons.terms)):
        if cons.terms[k].link == link and cons.terms[k].x < 0:
            found += _of_coupler(cons, work, k)
    return found


@compile_inline
def _of_coupler(cons, work, k):
    """Return the force of a coupler along the joint of its term k."""
    return cons.terms[k].factor * work.multiplier[cons.terms[k].row]
