"""Closed loops and motion constraints of the kernel: theory 5.

Constraints ``Phi(x, t) = 0`` hold between ends: interfaces of bodies with their elastic motion, or frames of the
ground. Each row has one line of action ``(f, ta, tb)``: its rate is ``f.(vb - va) + ta.wa + tb.wb`` less the rate of
its prescribed value, and its multiplier pushes the ends with just these forces and torques. Propagating them through
the recursion gives ``Y = M^-1 G^T`` and ``G M^-1 G^T`` in O(n m), their factor costs O(m^3).

One operation does it all, `impose`: change accelerations, speeds or coordinates by the least amount, in the metric of
the last `inward`, that moves the rows by a wanted amount. The metric is M, or the effective mass of an implicit step.

Order of calls: `outward`, `world`, `constraint_residual`; after `inward` and `forward` `constraint_accelerations`.
Arguments as in articulated_body.py; `cons` Constraints, `work` Work. External wrenches are overwritten.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.jit import compile_inline, compile_kernel
from modalprep.multibody.kernels.articulated_body import (
    clear_wrenches,
    forward_bias,
    inward_bias,
)
from modalprep.multibody.kernels.interfaces import add_wrench, carried, node_acceleration, node_state
from modalprep.multibody.kernels.modal import write_accelerations
from modalprep.multibody.kernels.spatial import (
    ZERO3,
    add6,
    axpy3,
    cross,
    dot3,
    get3,
    get6,
    get9,
    get_angular,
    put3,
    put6,
    put9,
    put_angular,
    times,
)
from modalprep.multibody.kernels.time_tables import Tables, table

# kinds of rows: e.(rb - ra), ea.eb, |rb - ra|, a sum of joint coordinates, each less its value; of e.(wb - wa) and of
# sliding, e.(vb - va), only the rate counts
POINT, ANGLE, DISTANCE, COUPLER, ABOUT, SLIP = range(6)
RANK_TOLERANCE = 1e-11  # squared sine between a row and those before it, in the metric: an angle of 3e-6 rad
STRAY = 10.0  # rows that depend on each other in closed loops are at angles up to so many times the gap of open ones
REGULAR, SINGULAR = 0.3, 0.2  # sines of independent rows: a step goes past a singular position, not into it
MOST_FRICTION_STEPS = 200  # iterations of friction and normal forces
FRICTION_SETTLED = 1e-13  # change of the friction at their end


# One condition: kind, its ends, its function of time (-1: none), directions in the axes of the ends.
ROW = np.dtype([
    ("kind", np.int64),
    ("a", np.int64),
    ("b", np.int64),
    ("table", np.int64),
    ("in_a", np.float64, 3),
    ("in_b", np.float64, 3),
    ("friction", np.float64),  # of SLIP rows: coefficient
    ("sliding", np.float64),  # of SLIP rows: speed from which it slides, m/s
    ("stiffness", np.float64),  # of compliant constraints; of others infinite
    ("damping", np.float64),
])  # fmt: skip
END = np.dtype([  # an interface of a link's body; on the ground (link -1) its position and rotation
    ("link", np.int64), ("interface", np.int64), ("position", np.float64, 3), ("rotation", np.float64, 9),
])  # fmt: skip
TERM = np.dtype([  # a coordinate (-1: prescribed) in the sum of a coupler's row
    ("row", np.int64), ("link", np.int64), ("x", np.int64), ("u", np.int64), ("factor", np.float64),
])  # fmt: skip
# What an evaluation writes, inertial axes: the motion of an end, and the line of action of a row.
END_DATA = np.dtype([
    ("position", np.float64, 3), ("rotation", np.float64, 9), ("velocity", np.float64, 3), ("spin", np.float64, 3),
    ("acceleration", np.float64, 6),
])  # fmt: skip
LINE = np.dtype([("force", np.float64, 3), ("torque_a", np.float64, 3), ("torque_b", np.float64, 3)])
KEPT = np.dtype([("force", np.float64, 6), ("acceleration", np.float64, 6)])


class Constraints(NamedTuple):
    """Packed constraints."""

    tables: Tables
    ends: np.ndarray  # (ne,) END
    rows: np.ndarray  # (m,) ROW
    terms: np.ndarray  # (nt,) TERM


class Work(NamedTuple):
    """What changes in the constraints of a run, scratch and outcome of one evaluation."""

    value: np.ndarray  # (m,) what the row's function is added to: lengths as at the start
    unit: np.ndarray  # (m,) 1 / size of what the row measures; 0: it is not active
    floor: np.ndarray  # (m,) mobility that counts as none; infinite: it is not active
    ends: np.ndarray  # (ne,) END_DATA
    lines: np.ndarray  # (m,) LINE
    phi: np.ndarray  # (m,) Phi
    rate: np.ndarray  # (m,) Phi'
    bias: np.ndarray  # (m,) Phi'' without accelerations of the ends
    push: np.ndarray  # (m,) rate at which the multiplier does work: of the prescribed value, or of sliding
    wanted: np.ndarray  # (m,) what `impose` takes away from the rows
    goal: np.ndarray  # (m,) G u' that rows aim at
    compliance: np.ndarray  # (m,) of the compliant rows in an implicit step, else 0
    multiplier: np.ndarray  # (m,) that of the last `impose`
    S: np.ndarray  # (m, m) G M^-1 G^T
    factor: np.ndarray  # (m, m) its pivoted factor, rows and columns scaled
    scale: np.ndarray  # (m,)
    order: np.ndarray  # (m,) int, rows by pivot; those beyond the rank are redundant
    rank: np.ndarray  # (1,) int
    held: np.ndarray  # (1,) int, the rank in the last closed state, m without one
    sine: np.ndarray  # (2,) the least sine of an independent row, now and in the last closed state
    Y: np.ndarray  # (m, nu) M^-1 G^T
    tau: np.ndarray  # (nu,)
    step: np.ndarray  # (nu,)
    kept: np.ndarray  # (nl,) KEPT, of the links before the multipliers act


@compile_kernel
def constraint_residual(cons, model, data, y, motion, t, work):
    """Write ``phi``, ``rate``, ``bias`` and the lines of action, after `outward` and `world`; `cons` may be None."""
    if cons is None:
        return
    for k in range(len(cons.ends)):
        if cons.ends[k].link >= 0:
            p, turn, v, w = node_state(model, data, cons.ends[k].link, cons.ends[k].interface)
        else:
            p, turn, v, w = get3(cons.ends[k].position), get9(cons.ends[k].rotation), ZERO3, ZERO3
        n = data.links[-1].omega[2]  # accelerations of the ends are not those that a turning ground sees
        v, w = (v[0] - n * p[1], v[1] + n * p[0], v[2]), (w[0], w[1], w[2] + n)
        put3(work.ends[k].position, p)
        put9(work.ends[k].rotation, turn)
        put3(work.ends[k].velocity, v)
        put3(work.ends[k].spin, w)
    for i in range(len(cons.rows)):
        value, rate, acceleration = work.value[i], 0.0, 0.0
        if cons.rows[i].table >= 0:
            shift, rate, acceleration = table(cons.tables, cons.rows[i].table, t)
            value += shift
        work.phi[i], work.rate[i], work.bias[i], work.push[i] = -value, -rate, -acceleration, rate
        if cons.rows[i].kind != COUPLER:
            _line(cons, work, i)
    _couplers(cons, y, model.nx, motion, work)


@compile_inline
def _line(cons, work, i):
    """Line of action of row i, and its terms of Phi, Phi', Phi''."""
    kind, a, b = cons.rows[i].kind, cons.rows[i].a, cons.rows[i].b
    ra, rb = get3(work.ends[a].position), get3(work.ends[b].position)
    va, vb = get3(work.ends[a].velocity), get3(work.ends[b].velocity)
    wa, wb = get3(work.ends[a].spin), get3(work.ends[b].spin)
    r, v = axpy3(rb, -1.0, ra), axpy3(vb, -1.0, va)
    f, ta, tb = ZERO3, ZERO3, ZERO3
    if kind == DISTANCE:
        phi = np.sqrt(dot3(r, r))
        g = 1.0 / phi if phi > 0.0 else 0.0
        f = (g * r[0], g * r[1], g * r[2])
        across = axpy3(v, -dot3(f, v), f)
        bias = g * dot3(across, across)
    else:
        e = times(get9(work.ends[a].rotation), get3(cons.rows[i].in_a))
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
            h = times(get9(work.ends[b].rotation), get3(cons.rows[i].in_b))
            tb = cross(h, e)
            ta = (-tb[0], -tb[1], -tb[2])
            phi = dot3(e, h)
            bias = dot3(cross(wa, turned), h) + 2.0 * dot3(turned, cross(wb, h))
            bias += dot3(e, cross(wb, cross(wb, h)))
    put3(work.lines[i].force, f)
    put3(work.lines[i].torque_a, ta)
    put3(work.lines[i].torque_b, tb)
    work.phi[i] += phi
    work.rate[i] += dot3(f, v) + dot3(ta, wa) + dot3(tb, wb)
    work.bias[i] += bias


@compile_inline
def _couplers(cons, y, nx, motion, work):
    for k in range(len(cons.terms)):
        i, c, x = cons.terms[k].row, cons.terms[k].factor, cons.terms[k].x
        if x >= 0:
            work.phi[i] += c * y[x]
            work.rate[i] += c * y[nx + cons.terms[k].u]
        else:
            link = cons.terms[k].link
            work.phi[i] += c * motion[link, 0]
            work.rate[i] += c * motion[link, 1]
            work.bias[i] += c * motion[link, 2]


@compile_kernel
def push_row(cons, model, data, work, i, size, tau):
    """Let the multiplier `size` of row i act: wrenches into W and data, hinge forces added to ``tau (nu,)``."""
    if cons.rows[i].kind == COUPLER:
        for k in range(len(cons.terms)):
            if cons.terms[k].row == i and cons.terms[k].x >= 0:
                tau[cons.terms[k].u] += size * cons.terms[k].factor
        return
    f, ta, tb = get3(work.lines[i].force), get3(work.lines[i].torque_a), get3(work.lines[i].torque_b)
    for end, sign, t in ((cons.rows[i].a, -size, ta), (cons.rows[i].b, size, tb)):
        if cons.ends[end].link >= 0:
            force = (sign * f[0], sign * f[1], sign * f[2])
            torque = (size * t[0], size * t[1], size * t[2])
            add_wrench(model, data, cons.ends[end].link, cons.ends[end].interface, force, torque)


@compile_kernel
def observe_ends(cons, model, data, work, own):
    """Accelerations of the ends, own = 1 after `forward`, 0 after `forward_bias`."""
    for k in range(len(cons.ends)):
        v, w = ZERO3, ZERO3
        if cons.ends[k].link >= 0:
            v, w = node_acceleration(model, data, cons.ends[k].link, cons.ends[k].interface, own)
        elif own > 0.0:
            v = carried(data, get3(cons.ends[k].position), ZERO3)  # the ground seen in free fall
        put3(work.ends[k].acceleration, v)
        put_angular(work.ends[k].acceleration, w)


@compile_kernel
def along(cons, work, i, udot):
    """G u' of row i, by the accelerations of its ends or hinges."""
    if cons.rows[i].kind == COUPLER:
        found = 0.0
        for k in range(len(cons.terms)):
            if cons.terms[k].row == i and cons.terms[k].x >= 0:
                found += cons.terms[k].factor * udot[cons.terms[k].u]
        return found
    a, b = cons.rows[i].a, cons.rows[i].b
    v = axpy3(get3(work.ends[b].acceleration), -1.0, get3(work.ends[a].acceleration))
    found = dot3(get3(work.lines[i].force), v) + dot3(
        get3(work.lines[i].torque_a), get_angular(work.ends[a].acceleration)
    )
    return found + dot3(get3(work.lines[i].torque_b), get_angular(work.ends[b].acceleration))


@compile_kernel
def respond(cons, model, data, work):
    """Write ``Y`` and ``S``: responses to unit multipliers with the inertias of the last `inward`."""
    for j in range(len(cons.rows)):
        clear_wrenches(model, data)
        work.tau[:] = 0.0
        push_row(cons, model, data, work, j, 1.0, work.tau)
        inward_bias(model, data, work.tau)
        forward_bias(model, data, work.tau, work.Y[j])
        observe_ends(cons, model, data, work, 0.0)
        for i in range(j + 1):
            work.S[i, j] = work.S[j, i] = along(cons, work, i, work.Y[j])
    work.tau[:] = 0.0


@compile_kernel
def factorize(cons, work):
    """Pivoted Cholesky factor of S scaled to a unit diagonal; rows beyond ``rank`` depend on those before them.

    Rows that depend on each other where the loops are closed do not quite at the stages of a step: more rows than in
    the last closed state (`hold_rank`) are independent only where they clearly are, by more than the loops are open.
    """
    m, largest, gap = len(work.scale), 0.0, violation(work, work.phi)
    for i in range(m):
        moves = work.S[i, i] > work.floor[i]
        work.scale[i] = 1.0 / np.sqrt(work.S[i, i]) if moves else 0.0
        work.order[i] = i
        largest = max(largest, _mobility(work, i) if moves and work.compliance[i] == 0.0 else 0.0)
    for i in range(m):
        for j in range(m):
            work.factor[i, j] = work.S[i, j] * work.scale[i] * work.scale[j]
    work.rank[0], work.sine[0] = m, 1.0
    for k in range(m):
        best, most = k, -1.0
        for i in range(k, m):  # a row that hardly moves has no sure direction: the largest mobility first
            left = work.factor[i, i] * _mobility(work, work.order[i])
            if left > most * (1.0 + 1e-9):  # ties: the order given
                best, most = i, left
        risen = k < work.held[0] or most > (STRAY * gap) ** 2 * largest
        if not (work.factor[best, best] > RANK_TOLERANCE and risen):
            work.rank[0] = k
            return
        if best != k:
            _swap(work, k, best)
        pivot = np.sqrt(work.factor[k, k])
        work.factor[k, k] = pivot
        work.sine[0] = min(work.sine[0], pivot)
        for i in range(k + 1, m):
            work.factor[i, k] /= pivot
        for i in range(k + 1, m):
            for j in range(k + 1, i + 1):
                work.factor[i, j] -= work.factor[i, k] * work.factor[j, k]
                work.factor[j, i] = work.factor[i, j]


@compile_kernel
def violation(work, values):
    """Return the largest of ``values (m,)`` but of compliant rows, lengths by the size of the system."""
    worst = 0.0
    for i in range(len(values)):
        size = abs(values[i]) * work.unit[i] if work.compliance[i] == 0.0 else 0.0
        if not size <= worst:  # NaN counts
            worst = size
    return worst


@compile_kernel
def near_singular(work):
    """Return whether the loops came from a regular closed state into a singular position, or near one."""
    lost = work.rank[0] < work.held[0] or (work.rank[0] == work.held[0] and work.sine[0] < SINGULAR)
    return lost and work.sine[1] > REGULAR


@compile_inline
def _mobility(work, i):
    """Return the response of row i to a unit multiplier, lengths by the size of the system."""
    return work.S[i, i] * work.unit[i] * work.unit[i]


@compile_kernel
def free_rank(work):
    """Let `factorize` decide the rank by itself; `work` may be None."""
    if work is not None:
        work.held[0] = len(work.scale)


@compile_kernel
def hold_rank(work):
    """Take the rank of the last `factorize` as that of a closed state; `work` may be None."""
    if work is not None:
        work.held[0], work.sine[1] = work.rank[0], work.sine[0]


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
def impose(cons, model, data, work, change):
    """Add to ``change (nu,)`` the least change, in the metric of the last `inward`, that takes `wanted` off the rows.

    After `constraint_residual` and `inward`. With ``wanted = G u' - gamma`` it turns unconstrained accelerations into
    constrained ones, with ``phi`` it gives a Newton step onto the constraints, with ``rate`` it projects speeds.
    """
    respond(cons, model, data, work)
    factorize(cons, work)
    solve(work)
    for j in range(len(work.order)):
        for k in range(len(work.tau)):
            change[k] += work.multiplier[j] * work.Y[j, k]


@compile_kernel
def constraint_accelerations(cons, model, data, work, alpha, beta, udot):
    """Correct the accelerations of `forward` so that ``Phi'' + 2 alpha Phi' + beta^2 Phi = 0``.

    After `constraint_residual`, `inward` and `forward`. alpha = beta = 0 with projection after steps; Baumgarte (1972)
    with both at some 5 to 50 1/s. Leaves the multipliers in `work`, and the data as a `forward` with them would, so
    that `reactions` and `node_acceleration` hold. `cons` may be None.
    """
    if cons is None:
        return
    if len(cons.rows) == 0:
        return
    keep(data, work)
    observe_ends(cons, model, data, work, 1.0)
    for i in range(len(cons.rows)):
        acceleration = along(cons, work, i, udot) + work.bias[i]
        work.wanted[i] = acceleration + 2.0 * alpha * work.rate[i] + beta * beta * work.phi[i]
        work.compliance[i] = 0.0
    act(cons, model, data, work, udot)


@compile_inline
def keep(data, work):
    """Keep biases and accelerations of the links, for `_superpose`."""
    for i in range(len(work.kept)):
        put6(work.kept[i].force, get6(data.links[i].force))
        put6(work.kept[i].acceleration, get6(data.links[i].acceleration))


@compile_kernel
def act(cons, model, data, work, udot):
    """Take `wanted` off the rows by multipliers, those with compliance by as much as they resist."""
    respond(cons, model, data, work)
    for i in range(len(cons.rows)):
        work.S[i, i] += work.compliance[i]
    factorize(cons, work)
    solve(work)
    _rub(cons, work)
    _superpose(cons, model, data, work, udot)


@compile_kernel
def _rub(cons, work):
    """Let rows of sliding resist by friction, until it agrees with the normal forces that it changes itself.

    Where it never does (a jam) the multipliers are not finite.
    """
    slides = False
    for i in range(len(cons.rows)):
        if cons.rows[i].kind == SLIP:
            slides, work.goal[i] = True, 0.0
    if not slides:
        return
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


@compile_kernel
def _superpose(cons, model, data, work, udot):
    """Add the response to all multipliers to ``udot``, and the state before it to that in the data."""
    clear_wrenches(model, data)
    for i in range(len(cons.rows)):
        push_row(cons, model, data, work, i, work.multiplier[i], work.tau)
    inward_bias(model, data, work.tau)
    forward_bias(model, data, work.tau, work.step)
    work.tau[:] = 0.0
    for k in range(len(work.step)):
        udot[k] += work.step[k]
    for i in range(len(work.kept)):
        own, kept = data.links[i], work.kept[i]
        put6(own.force, add6(get6(own.force), get6(kept.force)))
        put6(own.acceleration, add6(get6(own.acceleration), get6(kept.acceleration)))
        write_accelerations(data.modal, model, i, udot)


@compile_kernel
def constraint_power(work):
    """Power (W) of the prescribed values: what constraints that depend on time put into the system; 0 of None."""
    if work is None:
        return 0.0
    found = 0.0
    for i in range(len(work.push)):
        found += work.multiplier[i] * work.push[i]
    return found
