"""Rows of closed loops and motion constraints of the kernel: theory 5.4.

Constraints ``Phi(x, t) = 0`` hold between ends: interfaces of bodies with their elastic motion, or frames of the
ground. Each row has one line of action ``(f, ta, tb)``: its rate is ``f.(vb - va) + ta.wa + tb.wb`` less the rate of
its prescribed value, and its multiplier pushes the ends with just these forces and torques (multipliers.py).

Arguments as in articulated_body.py; `cons` Constraints, `work` Work.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.by_address import by_address
from modalprep.jit import compile_inline, compile_kernel
from modalprep.multibody.kernels.algebra.matrices import times
from modalprep.multibody.kernels.algebra.tuples import (
    ZERO3,
    axpy3,
    cross,
    dot3,
    get3,
    get9,
    get_angular,
    put3,
    put9,
    put_angular,
)
from modalprep.multibody.kernels.interfaces import add_wrench, carried, node_acceleration, node_state
from modalprep.multibody.kernels.time_tables import Tables, table

# kinds of rows: e.(rb - ra), ea.eb, |rb - ra|, a sum of joint coordinates, each less its value; of e.(wb - wa) and of
# sliding, e.(vb - va), only the rate counts
POINT, ANGLE, DISTANCE, COUPLER, ABOUT, SLIP = range(6)
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


@by_address
class Constraints(NamedTuple):
    """Packed constraints."""

    tables: Tables
    ends: np.ndarray  # (ne,) END
    rows: np.ndarray  # (m,) ROW
    terms: np.ndarray  # (nt,) TERM


@by_address
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


@compile_inline
def any_rows(cons):
    """Whether there are constraints; `cons` may be None."""
    if cons is None:
        return False
    return len(cons.rows) > 0


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
