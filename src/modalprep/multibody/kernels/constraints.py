"""Closed loops and motion constraints of the kernel: theory 5.

Constraints ``Phi(x, t) = 0`` hold between ends: interfaces of bodies with their elastic motion, or frames of the
ground. Each row has one line of action ``(f, ta, tb)``: its rate is ``f.(vb - va) + ta.wa + tb.wb`` less the rate of
its prescribed value, and its multiplier pushes the ends with just these forces and torques. Propagating them through
the recursion gives ``Y = M^-1 G^T`` and ``G M^-1 G^T`` in O(n m), their factor costs O(m^3).

One operation does it all, `impose`: change accelerations, speeds or coordinates by the least amount, in the metric of
the last `inward`, that moves the rows by a wanted amount. The metric is M, or the effective mass of an implicit step.

Springs, dampers and bushings of an implicit step are rows that give way, ``multiplier = -(c1 D + c2 K) (G u' - aim)``:
they add the compliance ``1 / (c1 D + c2 K)`` to their element of ``G M^-1 G^T``, which is Woodbury's formula.

Order of calls: `outward`, `world`, `constraint_residual`; after `inward` and `forward` `constraint_accelerations`; of
an implicit step `aim` before `inward`, `implicit_accelerations` after `forward`.
Arguments as in kernel.py; `cons` Constraints, `work` Work. External wrenches of the evaluation are overwritten.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.jit import compile_inline, compile_kernel
from modalprep.multibody.kernels.articulated_body import (
    add_wrench,
    carried,
    clear_wrenches,
    forward_bias,
    inward,
    inward_bias,
    kinematic,
    node_acceleration,
    node_state,
    outward,
    spread,
    world,
)
from modalprep.multibody.kernels.data import FREE, JOINT, MODES, NX, OMEGA, PA, SLOT, SPHERICAL, UQ, X
from modalprep.multibody.kernels.spatial import ZERO3, axpy3, copy, cross, dot3, get3, get9, put3, put9, times
from modalprep.multibody.kernels.time_tables import Tables, table

# kinds of rows: e.(rb - ra), ea.eb, |rb - ra|, a sum of joint coordinates, each less its value; of e.(wb - wa) and of
# sliding, e.(vb - va), only the rate counts
POINT, ANGLE, DISTANCE, COUPLER, ABOUT, SLIP = range(6)
# columns of Constraints.rows and .constants
KIND, END_A, END_B, TABLE = range(4)
IN_A, IN_B, VALUE, UNIT, FLOOR, CONSTANTS = 0, 3, 6, 7, 8, 9
FRICTION, SLIDING = IN_B, IN_B + 1  # of SLIP rows: coefficient, speed from which it slides
# columns of Work.ends and .lines
PLACE, TURN, SPEED, SPIN, ENDS = 0, 3, 12, 15, 18
FORCE, TORQUE_A, TORQUE_B, LINES = 0, 3, 6, 9
RANK_TOLERANCE = 1e-11  # squared sine between a row and those before it, in the metric: an angle of 3e-6 rad
MOST_RUBS, RUBBED = 200, 1e-13  # sweeps between friction and normal forces, change of the friction at their end


class Constraints(NamedTuple):
    """Packed constraints; link -1 is the ground, table -1 no function of time."""

    tables: Tables
    ends: np.ndarray  # (ne, 2) int: link, interface
    ground: np.ndarray  # (ne, 12): position and rotation of an end on the ground
    rows: np.ndarray  # (m, 4) int: kind, first and second end, table of the value
    constants: np.ndarray  # (m, 9): directions in the ends' axes, value, 1 / unit, mobility that counts as none
    terms: np.ndarray  # (nt, 4) int: row, link, coordinate (-1: prescribed), speed
    factors: np.ndarray  # (nt,)
    yielding: np.ndarray  # (m, 2): stiffness and damping of the rows that give way; of constraints infinity, 0


class Work(NamedTuple):
    """Scratch and outcome of one evaluation."""

    ends: np.ndarray  # (ne, 18) position, rotation, velocity, spin of the ends, inertial axes
    moved: np.ndarray  # (ne, 6) their accelerations
    lines: np.ndarray  # (m, 9) lines of action, inertial axes
    phi: np.ndarray  # (m,) Phi
    rate: np.ndarray  # (m,) Phi'
    bias: np.ndarray  # (m,) Phi'' without accelerations of the ends
    push: np.ndarray  # (m,) rate at which the multiplier does work: of the prescribed value, or of sliding
    wanted: np.ndarray  # (m,) what `impose` takes away from the rows
    goal: np.ndarray  # (m,) G u' that rows aim at
    compliance: np.ndarray  # (m,) of the rows that give way in an implicit step, else 0
    multiplier: np.ndarray  # (m,) that of the last `impose`
    S: np.ndarray  # (m, m) G M^-1 G^T
    factor: np.ndarray  # (m, m) its pivoted factor, rows and columns scaled
    scale: np.ndarray  # (m,)
    order: np.ndarray  # (m,) int, rows by pivot; those beyond the rank are redundant
    rank: np.ndarray  # (1,) int
    Y: np.ndarray  # (m, nu) M^-1 G^T
    tau: np.ndarray  # (nu,)
    step: np.ndarray  # (nu,)
    kept: np.ndarray  # (nl, 12) biases and accelerations of the links before the multipliers act
    change: np.ndarray  # (nx + nu,)


@compile_kernel
def constraint_residual(cons, tree, flex, W, F, y, motion, t, work):
    """Write ``phi``, ``rate``, ``bias`` and the lines of action, after `outward` and `world`; `cons` may be None."""
    if cons is None:
        return
    for k in range(len(cons.ends)):
        if cons.ends[k, 0] >= 0:
            p, turn, v, w = node_state(tree, flex, W, F, cons.ends[k, 0], cons.ends[k, 1])
        else:
            p, turn, v, w = get3(cons.ground, k, 0), get9(cons.ground, k, 3), ZERO3, ZERO3
        n = W[len(W) - 1, OMEGA + 2]  # accelerations of the ends are not those that a turning ground sees
        v, w = (v[0] - n * p[1], v[1] + n * p[0], v[2]), (w[0], w[1], w[2] + n)
        put3(work.ends, k, PLACE, p)
        put9(work.ends, k, TURN, turn)
        put3(work.ends, k, SPEED, v)
        put3(work.ends, k, SPIN, w)
    for i in range(len(cons.rows)):
        value, rate, acceleration = cons.constants[i, VALUE], 0.0, 0.0
        if cons.rows[i, TABLE] >= 0:
            shift, rate, acceleration = table(cons.tables, cons.rows[i, TABLE], t)
            value += shift
        work.phi[i], work.rate[i], work.bias[i], work.push[i] = -value, -rate, -acceleration, rate
        if cons.rows[i, KIND] != COUPLER:
            _line(cons, work, i)
    _couplers(cons, y, tree.ints[0, NX], motion, work)


@compile_inline
def _line(cons, work, i):
    """Line of action of row i, and its terms of Phi, Phi', Phi''."""
    kind, a, b = cons.rows[i, KIND], cons.rows[i, END_A], cons.rows[i, END_B]
    ra, rb = get3(work.ends, a, PLACE), get3(work.ends, b, PLACE)
    va, vb = get3(work.ends, a, SPEED), get3(work.ends, b, SPEED)
    wa, wb = get3(work.ends, a, SPIN), get3(work.ends, b, SPIN)
    r, v = axpy3(rb, -1.0, ra), axpy3(vb, -1.0, va)
    f, ta, tb = ZERO3, ZERO3, ZERO3
    if kind == DISTANCE:
        phi = np.sqrt(dot3(r, r))
        g = 1.0 / phi if phi > 0.0 else 0.0
        f = (g * r[0], g * r[1], g * r[2])
        across = axpy3(v, -dot3(f, v), f)
        bias = g * dot3(across, across)
    else:
        e = times(get9(work.ends, a, TURN), get3(cons.constants, i, IN_A))
        turned = cross(wa, e)
        if kind == POINT:
            f, ta = e, cross(e, r)
            phi, bias = dot3(e, r), 2.0 * dot3(turned, v) + dot3(cross(wa, turned), r)
        elif kind == SLIP:
            f, ta = e, cross(e, r)
            phi, bias = 0.0, 0.0
            work.push[i] = dot3(f, v) + dot3(ta, wa)
        elif kind == ABOUT:
            ta, tb = (-e[0], -e[1], -e[2]), e
            phi, bias = 0.0, dot3(turned, axpy3(wb, -1.0, wa))
        else:
            h = times(get9(work.ends, b, TURN), get3(cons.constants, i, IN_B))
            tb = cross(h, e)
            ta = (-tb[0], -tb[1], -tb[2])
            phi = dot3(e, h)
            bias = dot3(cross(wa, turned), h) + 2.0 * dot3(turned, cross(wb, h))
            bias += dot3(e, cross(wb, cross(wb, h)))
    put3(work.lines, i, FORCE, f)
    put3(work.lines, i, TORQUE_A, ta)
    put3(work.lines, i, TORQUE_B, tb)
    work.phi[i] += phi
    work.rate[i] += dot3(f, v) + dot3(ta, wa) + dot3(tb, wb)
    work.bias[i] += bias


@compile_inline
def _couplers(cons, y, nx, motion, work):
    for k in range(len(cons.terms)):
        i, c, x = cons.terms[k, 0], cons.factors[k], cons.terms[k, 2]
        if x >= 0:
            work.phi[i] += c * y[x]
            work.rate[i] += c * y[nx + cons.terms[k, 3]]
        else:
            link = cons.terms[k, 1]
            work.phi[i] += c * motion[link, 0]
            work.rate[i] += c * motion[link, 1]
            work.bias[i] += c * motion[link, 2]


@compile_kernel
def push_row(cons, tree, flex, W, F, work, i, size, tau):
    """Let the multiplier `size` of row i act: wrenches into W and F, hinge forces added to ``tau (nu,)``."""
    if cons.rows[i, KIND] == COUPLER:
        for k in range(len(cons.terms)):
            if cons.terms[k, 0] == i and cons.terms[k, 2] >= 0:
                tau[cons.terms[k, 3]] += size * cons.factors[k]
        return
    f, ta, tb = get3(work.lines, i, FORCE), get3(work.lines, i, TORQUE_A), get3(work.lines, i, TORQUE_B)
    for end, sign, t in ((cons.rows[i, END_A], -size, ta), (cons.rows[i, END_B], size, tb)):
        if cons.ends[end, 0] >= 0:
            force = (sign * f[0], sign * f[1], sign * f[2])
            torque = (size * t[0], size * t[1], size * t[2])
            add_wrench(tree, flex, W, F, cons.ends[end, 0], cons.ends[end, 1], force, torque)


@compile_kernel
def _observe(cons, tree, flex, W, F, work, own):
    """Accelerations of the ends, own = 1 after `forward`, 0 after `forward_bias`."""
    for k in range(len(cons.ends)):
        v, w = ZERO3, ZERO3
        if cons.ends[k, 0] >= 0:
            v, w = node_acceleration(tree, flex, W, F, cons.ends[k, 0], cons.ends[k, 1], own)
        elif own > 0.0:
            v = carried(W, get3(cons.ground, k, 0), ZERO3)  # the ground seen in free fall
        put3(work.moved, k, 0, v)
        put3(work.moved, k, 3, w)


@compile_kernel
def _along(cons, work, i, udot):
    """G u' of row i, by the accelerations of its ends or hinges."""
    if cons.rows[i, KIND] == COUPLER:
        found = 0.0
        for k in range(len(cons.terms)):
            if cons.terms[k, 0] == i and cons.terms[k, 2] >= 0:
                found += cons.factors[k] * udot[cons.terms[k, 3]]
        return found
    a, b = cons.rows[i, END_A], cons.rows[i, END_B]
    v = axpy3(get3(work.moved, b, 0), -1.0, get3(work.moved, a, 0))
    found = dot3(get3(work.lines, i, FORCE), v) + dot3(get3(work.lines, i, TORQUE_A), get3(work.moved, a, 3))
    return found + dot3(get3(work.lines, i, TORQUE_B), get3(work.moved, b, 3))


@compile_kernel
def respond(cons, tree, flex, W, F, work):
    """Write ``Y`` and ``S``: responses to unit multipliers with the inertias of the last `inward`."""
    for j in range(len(cons.rows)):
        clear_wrenches(tree, flex, W, F)
        work.tau[:] = 0.0
        push_row(cons, tree, flex, W, F, work, j, 1.0, work.tau)
        inward_bias(tree, flex, W, F, work.tau)
        forward_bias(tree, flex, W, F, work.tau, work.Y[j])
        _observe(cons, tree, flex, W, F, work, 0.0)
        for i in range(j + 1):
            work.S[i, j] = work.S[j, i] = _along(cons, work, i, work.Y[j])
    work.tau[:] = 0.0


@compile_kernel
def factorize(cons, work):
    """Pivoted Cholesky factor of S scaled to a unit diagonal; rows beyond ``rank`` depend on those before them."""
    m = len(work.scale)
    for i in range(m):
        moves = work.S[i, i] > cons.constants[i, FLOOR]
        work.scale[i] = 1.0 / np.sqrt(work.S[i, i]) if moves else 0.0
        work.order[i] = i
    for i in range(m):
        for j in range(m):
            work.factor[i, j] = work.S[i, j] * work.scale[i] * work.scale[j]
    work.rank[0] = m
    for k in range(m):
        best = k
        for i in range(k + 1, m):
            if work.factor[i, i] > work.factor[best, best] * (1.0 + 1e-9):  # ties: the order given
                best = i
        if not work.factor[best, best] > RANK_TOLERANCE:
            work.rank[0] = k
            return
        if best != k:
            _swap(work, k, best)
        pivot = np.sqrt(work.factor[k, k])
        work.factor[k, k] = pivot
        for i in range(k + 1, m):
            work.factor[i, k] /= pivot
        for i in range(k + 1, m):
            for j in range(k + 1, i + 1):
                work.factor[i, j] -= work.factor[i, k] * work.factor[j, k]
                work.factor[j, i] = work.factor[i, j]


@compile_kernel
def _swap(work, k, i):
    work.order[k], work.order[i] = work.order[i], work.order[k]
    for c in range(len(work.order)):
        work.factor[k, c], work.factor[i, c] = work.factor[i, c], work.factor[k, c]
    for c in range(len(work.order)):
        work.factor[c, k], work.factor[c, i] = work.factor[c, i], work.factor[c, k]


@compile_kernel
def solve(work):
    """Solve ``S multiplier = -wanted``; redundant rows get none."""
    L, m, rank = work.factor, len(work.order), work.rank[0]
    for k in range(m):
        work.multiplier[k] = 0.0
    for k in range(rank):
        i = work.order[k]
        b = -work.wanted[i] * work.scale[i]
        for c in range(k):
            b -= L[k, c] * work.multiplier[work.order[c]]
        work.multiplier[i] = b / L[k, k]
    for k in range(rank - 1, -1, -1):
        b = work.multiplier[work.order[k]]
        for c in range(k + 1, rank):
            b -= L[c, k] * work.multiplier[work.order[c]]
        work.multiplier[work.order[k]] = b / L[k, k]
    for i in range(m):
        work.multiplier[i] *= work.scale[i]


@compile_kernel
def impose(cons, tree, flex, W, F, work, change):
    """Add to ``change (nu,)`` the least change, in the metric of the last `inward`, that takes `wanted` off the rows.

    After `constraint_residual` and `inward`. With ``wanted = G u' - gamma`` it turns unconstrained accelerations into
    constrained ones, with ``phi`` it gives a Newton step onto the constraints, with ``rate`` it projects speeds.
    """
    respond(cons, tree, flex, W, F, work)
    factorize(cons, work)
    solve(work)
    for j in range(len(work.order)):
        for k in range(len(work.tau)):
            change[k] += work.multiplier[j] * work.Y[j, k]


@compile_kernel
def constraint_accelerations(cons, tree, flex, W, F, work, alpha, beta, udot):
    """Correct the accelerations of `forward` so that ``Phi'' + 2 alpha Phi' + beta^2 Phi = 0``.

    After `constraint_residual`, `inward` and `forward`. alpha = beta = 0 with projection after steps; Baumgarte (1972)
    with both at some 5 to 50 1/s. Leaves the multipliers in `work`, and W and F as a `forward` with them would, so
    that `reactions` and `node_acceleration` hold. `cons` may be None.
    """
    if cons is None:
        return
    _keep(W, work)
    _observe(cons, tree, flex, W, F, work, 1.0)
    for i in range(len(cons.rows)):
        acceleration = _along(cons, work, i, udot) + work.bias[i]
        work.wanted[i] = acceleration + 2.0 * alpha * work.rate[i] + beta * beta * work.phi[i]
        work.compliance[i] = 0.0
    _act(cons, tree, flex, W, F, work, udot)


@compile_kernel
def aim(cons, tree, flex, W, F, work, c1, c2, places, by_rate, by_place):
    """Say what the rows aim at in an implicit step, after `constraint_residual` and before `inward`.

    The step has the matrix ``M + c1 D + c2 K`` and the force ``-D by_rate - K by_place``, both (nu,), of springs and
    bushings too. With `places` constraints aim at ``Phi = 0`` where a further ``c2 u' + by_place`` takes the
    coordinates; else they hold their accelerations, and aim at nothing.
    """
    if cons is None:
        return
    yields = _yields(cons)
    if places or yields:
        spread(tree, flex, W, F, by_place)
        _observe(cons, tree, flex, W, F, work, 0.0)
    for i in range(len(cons.rows)):
        along, stiffness = _along(cons, work, i, by_place), cons.yielding[i, 0]
        if np.isinf(stiffness):
            work.compliance[i], work.goal[i] = 0.0, -(along + work.phi[i]) / c2
        else:
            work.compliance[i] = 1.0 / (c1 * cons.yielding[i, 1] + c2 * stiffness)
            work.goal[i] = -work.compliance[i] * stiffness * along
    if not yields:
        return
    spread(tree, flex, W, F, by_rate)
    _observe(cons, tree, flex, W, F, work, 0.0)
    for i in range(len(cons.rows)):
        work.goal[i] -= work.compliance[i] * cons.yielding[i, 1] * _along(cons, work, i, by_rate)


@compile_inline
def _yields(cons):
    """Whether there are rows that give way."""
    for i in range(len(cons.rows)):
        if cons.yielding[i, 0] < np.inf:
            return True
    return False


@compile_kernel
def implicit_accelerations(cons, tree, flex, W, F, work, places, udot):
    """Let the rows act on the accelerations of `forward` in an implicit step, after `aim`; see there.

    Where `places` is False, constraints hold their accelerations as in `constraint_accelerations`.
    """
    if cons is None:
        return
    _keep(W, work)
    if not places:
        _observe(cons, tree, flex, W, F, work, 1.0)
        for i in range(len(cons.rows)):
            work.wanted[i] = _along(cons, work, i, udot) + work.bias[i]
    if places or _yields(cons):
        spread(tree, flex, W, F, udot)
        _observe(cons, tree, flex, W, F, work, 0.0)
        for i in range(len(cons.rows)):
            if places or work.compliance[i] > 0.0:
                work.wanted[i] = _along(cons, work, i, udot) - work.goal[i]
    _act(cons, tree, flex, W, F, work, udot)


@compile_kernel
def restrain(cons, tree, flex, W, F, work, change):
    """Take off ``change (nu,)`` what the rows resist, with the responses of the last `implicit_accelerations`."""
    if cons is None:
        return
    spread(tree, flex, W, F, change)
    _observe(cons, tree, flex, W, F, work, 0.0)
    for i in range(len(cons.rows)):
        work.wanted[i] = _along(cons, work, i, change)
    solve(work)
    for j in range(len(cons.rows)):
        for k in range(len(change)):
            change[k] += work.multiplier[j] * work.Y[j, k]


@compile_inline
def _keep(W, work):
    """Keep biases and accelerations of the links, for `_superpose`."""
    for i in range(len(work.kept)):
        for c in range(12):
            work.kept[i, c] = W[i, PA + c]


@compile_kernel
def _act(cons, tree, flex, W, F, work, udot):
    """Take `wanted` off the rows by multipliers, those with compliance by as much as they resist."""
    respond(cons, tree, flex, W, F, work)
    for i in range(len(cons.rows)):
        work.S[i, i] += work.compliance[i]
    factorize(cons, work)
    solve(work)
    _rub(cons, work)
    _superpose(cons, tree, flex, W, F, work, udot)


@compile_kernel
def _rub(cons, work):
    """Let rows of sliding resist by friction, until it agrees with the normal forces that it changes itself.

    Where it never does (a jam) the multipliers are not finite.
    """
    slides = False
    for i in range(len(cons.rows)):
        if cons.rows[i, KIND] == SLIP:
            slides, work.goal[i] = True, 0.0
    if not slides:
        return
    change, size = np.inf, 0.0
    for _ in range(MOST_RUBS):
        change, size = 0.0, 0.0
        for i in range(len(cons.rows)):
            if cons.rows[i, KIND] == SLIP:
                f = _friction(cons, work, i)
                d = f - work.goal[i]
                work.goal[i] = f
                change, size = max(change, abs(d)), max(size, abs(f))
                for j in range(len(cons.rows)):
                    work.wanted[j] += work.S[j, i] * d
        if change <= RUBBED * size:
            break
        solve(work)
    for i in range(len(cons.rows)):
        if cons.rows[i, KIND] == SLIP:
            work.multiplier[i] = work.goal[i] if change <= RUBBED * size else np.nan


@compile_kernel
def _friction(cons, work, i):
    """Coulomb friction ``-mu N tanh(v / sliding) v_i / v`` along row i, N of the other rows of its closure."""
    normal, slip = 0.0, 0.0
    for j in range(len(cons.rows)):
        if cons.rows[j, END_A] == cons.rows[i, END_A]:
            if cons.rows[j, KIND] == SLIP:
                slip += work.rate[j] * work.rate[j]
            else:
                normal += work.multiplier[j] * work.multiplier[j]
    if slip == 0.0:
        return 0.0
    slip = np.sqrt(slip)
    resistance = cons.constants[i, FRICTION] * np.sqrt(normal) * np.tanh(slip / cons.constants[i, SLIDING])
    return -resistance * work.rate[i] / slip


@compile_kernel
def _superpose(cons, tree, flex, W, F, work, udot):
    """Add the response to all multipliers to ``udot``, and the state before it to that in W and F."""
    clear_wrenches(tree, flex, W, F)
    for i in range(len(cons.rows)):
        push_row(cons, tree, flex, W, F, work, i, work.multiplier[i], work.tau)
    inward_bias(tree, flex, W, F, work.tau)
    forward_bias(tree, flex, W, F, work.tau, work.step)
    work.tau[:] = 0.0
    for k in range(len(work.step)):
        udot[k] += work.step[k]
    for i in range(len(work.kept)):
        for c in range(12):
            W[i, PA + c] += work.kept[i, c]
        if flex is not None:
            s, u = tree.ints[i, SLOT], tree.ints[i, UQ]
            if s >= 0:
                for a in range(tree.ints[i, MODES]):
                    F.qdd[s, a >> 3, a & 7] = udot[u + a]


@compile_kernel
def constraint_power(work):
    """Power (W) of the prescribed values: what constraints that depend on time put into the system; 0 of None."""
    if work is None:
        return 0.0
    found = 0.0
    for i in range(len(work.push)):
        found += work.multiplier[i] * work.push[i]
    return found


@compile_kernel
def violation(cons, values):
    """Return the largest of ``values (m,)``, lengths by the size of the system."""
    worst = 0.0
    for i in range(len(values)):
        size = abs(values[i]) * cons.constants[i, UNIT]
        if not size <= worst:  # NaN counts
            worst = size
    return worst


@compile_kernel
def retract(tree, y, step, change):
    """Move the coordinates of y by ``step (nu,)`` as speeds would in unit time; quaternions stay of unit length."""
    nx = tree.ints[0, NX]
    for k in range(len(step)):
        y[nx + k], step[k] = step[k], y[nx + k]
    kinematic(tree, y, change)
    for k in range(len(step)):
        y[nx + k], step[k] = step[k], y[nx + k]
    for k in range(nx):
        y[k] += change[k]
    normalize(tree, y)


@compile_kernel
def normalize(tree, y):
    """Scale all quaternions of y to unit length."""
    for i in range(len(tree.ints)):
        joint, x = tree.ints[i, JOINT], tree.ints[i, X]
        if joint == SPHERICAL or joint == FREE:
            x += 3 if joint == FREE else 0
            size = np.sqrt(y[x] * y[x] + y[x + 1] * y[x + 1] + y[x + 2] * y[x + 2] + y[x + 3] * y[x + 3])
            for k in range(4):
                y[x + k] /= size


@compile_kernel
def project_positions(cons, tree, flex, W, F, y, motion, t, work, hinge, stiff, tolerance, most):
    """Bring the coordinates of y onto ``Phi(x, t) = 0`` by Newton steps, each the least change in its metric.

    Parameters
    ----------
    hinge : (nu,)
        Inertias added to the hinges, see `inward`: large where a coordinate should stay, else 0.
    stiff : float
        The metric's modal rows are ``1 + stiff K``.
    tolerance : float
        Of `violation`.
    most : int
        Newton steps.

    Returns
    -------
    steps : number of Newton steps, -1 when they do not reach the tolerance or the mass matrix is not positive
    """
    last = np.inf
    for k in range(most + 1):
        outward(tree, flex, W, F, y, motion)
        world(tree, W)
        constraint_residual(cons, tree, flex, W, F, y, motion, t, work)
        worst = violation(cons, work.phi)
        if worst <= tolerance:
            return k
        if k == most or not np.isfinite(worst):
            return -1
        work.step[:] = 0.0
        copy(work.phi, work.wanted)
        if not _move(cons, tree, flex, W, F, work, hinge, stiff, work.step):
            return -1
        if worst > last:  # overshot: a shorter step
            for c in range(len(work.step)):
                work.step[c] *= 0.5
        last = worst
        retract(tree, y, work.step, work.change)
    return -1


@compile_kernel
def project_velocities(cons, tree, flex, W, F, y, work, hinge, stiff):
    """Bring the speeds of y onto ``Phi' = 0`` by the least change, after `constraint_residual`; False on failure."""
    copy(work.rate, work.wanted)
    return _move(cons, tree, flex, W, F, work, hinge, stiff, y[tree.ints[0, NX] :])


@compile_kernel
def _move(cons, tree, flex, W, F, work, hinge, stiff, change):
    work.tau[:] = 0.0
    if inward(tree, flex, W, F, work.tau, hinge, 0.0, stiff) >= 0:
        return False
    impose(cons, tree, flex, W, F, work, change)
    return True


@compile_kernel
def settle(cons, tree, flex, W, F, y, motion, t, work, hinge, stiff, tolerance, most):
    """Project coordinates and speeds of y, both to `tolerance`; returns how often it moved something, -1 on failure.

    For an integrator after an accepted step; arguments as `project_positions`. Without loops it does nothing.
    """
    if cons is None:
        return 0
    steps = project_positions(cons, tree, flex, W, F, y, motion, t, work, hinge, stiff, tolerance, most)
    if steps >= 0 and violation(cons, work.rate) > tolerance:
        steps = steps + 1 if project_velocities(cons, tree, flex, W, F, y, work, hinge, stiff) else -1
    return steps
