"""Rows of closed loops and motion constraints of the kernel: theory 5.4.

Constraints ``Phi(x, t) = 0`` hold between ends: interfaces of bodies with their elastic motion, or frames of the
ground. Each row has one line of action ``(f, ta, tb)``: its rate is ``f.(vb - va) + ta.wa + tb.wb`` less the rate of
its prescribed value, and its multiplier pushes the ends with just these forces and torques (responses.py).

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
    add3,
    axpy3,
    cross,
    dot3,
    get3,
    get9,
    get_angular,
    put3,
    put6,
    put9,
    put_angular,
)
from modalprep.multibody.kernels.interfaces import free_position, seen_from_ground
from modalprep.multibody.kernels.modal_interfaces import interface_motion, shape_acceleration
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
    ("arm", np.float64, 3),  # from the link's origin, in its axes, as the acceleration left when A and q'' are zero
    ("bias", np.float64, 6),
])  # fmt: skip
LINE = np.dtype([("force", np.float64, 3), ("torque_a", np.float64, 3), ("torque_b", np.float64, 3)])
# One row at one link that its multiplier acts on: the entry of the parent (-1: the ground), a coupler's factor there.
ENTRY = np.dtype([("row", np.int64), ("up", np.int64), ("factor", np.float64)])


@by_address
class Constraints(NamedTuple):
    """Packed constraints."""

    tables: Tables
    ends: np.ndarray  # (ne,) END
    rows: np.ndarray  # (m,) ROW
    terms: np.ndarray  # (nt,) TERM


@by_address
class Paths(NamedTuple):
    """Which rows act on which links: on those of their ends, and on all between these and the ground."""

    first: np.ndarray  # (nl + 1,) int, first entry of each link
    entries: np.ndarray  # (np,) ENTRY, by links, then by rows
    ends: np.ndarray  # (m, 2) int, entries of the rows at their ends; -1 on the ground, and of couplers


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
    wanted: np.ndarray  # (m,) what `solve` takes away from the rows
    goal: np.ndarray  # (m,) G u' that rows aim at
    compliance: np.ndarray  # (m,) of the compliant rows in an implicit step, else 0
    multiplier: np.ndarray  # (m,) that of the last `solve`
    free: np.ndarray  # (m,) G u' + Phi'' without G u', less the row's own bias: without multipliers
    S: np.ndarray  # (m, m) G M^-1 G^T
    factor: np.ndarray  # (m, m) its pivoted factor, upper half
    inverse: np.ndarray  # (m,) 1 / pivot
    solution: np.ndarray  # (m,) scratch
    order: np.ndarray  # (m,) int, rows by pivot; those beyond the rank are redundant
    rank: np.ndarray  # (1,) int
    held: np.ndarray  # (1,) int, the rank in the last closed state, m without one
    sine: np.ndarray  # (2,) the least sine of an independent row, now and in the last closed state
    tau: np.ndarray  # (nu,) zero between calls
    step: np.ndarray  # (nu,) response to the multipliers
    paths: Paths  # constant
    force: np.ndarray  # (np, 6) articulated force of a unit multiplier, link's axes, at its origin
    drive: np.ndarray  # (np,) its force along a joint of one axis
    modal: np.ndarray  # (np, N) its modal forces, eliminated
    shape: np.ndarray  # (ne, N, 6) partial velocities of the ends, link's axes


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
            p, turn, v, w = _end_state(cons, model, data, work, k)
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


@compile_inline
def _end_state(cons, model, data, work, k):
    """Return the motion of an end as `node_state` does, and write what its acceleration follows from."""
    link, node = cons.ends[k].link, cons.ends[k].interface
    r, turn, v, w, linear, angular = interface_motion(
        data.modal, model, data, link, node, free_position(model, link, node), work.shape[k]
    )
    put3(work.ends[k].arm, r)
    put6(work.ends[k].bias, (linear[0], linear[1], linear[2], angular[0], angular[1], angular[2]))
    return seen_from_ground(model, data, link, r, turn, v, w)


@compile_kernel
def observe_ends(cons, model, data, work):
    """Accelerations of the ends after `spread`, when those of the links and q'' are all there is."""
    for k in range(len(cons.ends)):
        v, w, link = ZERO3, ZERO3, cons.ends[k].link
        if link >= 0:
            v, w = get3(data.links[link].acceleration), get_angular(data.links[link].acceleration)
            moved, turned = shape_acceleration(data.modal, model, link, work.shape[k])
            base, v = get9(data.links[link].orientation), add3(v, cross(w, get3(work.ends[k].arm)))
            v, w = times(base, add3(v, moved)), times(base, add3(w, turned))
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
