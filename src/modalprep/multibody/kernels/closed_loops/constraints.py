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
from modalprep.multibody.kernels.algebra.lanes import four, get_lanes, get_lanes3, put_lanes3
from modalprep.multibody.kernels.algebra.matrices import UNIT9, product, times
from modalprep.multibody.kernels.algebra.tuples import (
    ZERO3,
    add3,
    at,
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
from modalprep.multibody.kernels.interfaces import free_position, seen_spin
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
    ("position", np.float64, 3), ("velocity", np.float64, 3), ("spin", np.float64, 3), ("acceleration", np.float64, 6),
    ("rotation", np.float64, 9),  # of its link's axes, turned with the node
    ("arm", np.float64, 3),  # from the link's origin, in its axes, as the acceleration left when A and q'' are zero
    ("bias", np.float64, 6),
])  # fmt: skip
# Rows of one kind between the same ends, at most four, each in a lane of its own (lanes.py); couplers by themselves.
GROUP = np.dtype([
    ("kind", np.int64), ("a", np.int64), ("b", np.int64), ("count", np.int64), ("rows", np.int64, 4),
    ("lane", np.int64),  # of the first row
    ("bundle", np.int64),  # -1: nothing moves the rows
    ("at_a", np.int64), ("at_b", np.int64),  # entries at the links of its ends; -1: the ground, or none
    ("in_a", np.float64, 12), ("in_b", np.float64, 12),  # directions in the axes of the links of its ends
])  # fmt: skip
# Groups that act on nearly the same links, in one vector; rows by lanes.
BUNDLE = np.dtype([("count", np.int64), ("rows", np.int64, 4)])
# One bundle at one link that its multipliers act on.
ENTRY = np.dtype([
    ("bundle", np.int64), ("link", np.int64),
    ("u", np.int64), ("up", np.int64),  # speed of its joint of one axis, else -1; entry of the parent; -1: the ground
    ("adds", np.int64),  # whether another one or an end was there before
    ("factor", np.float64),  # of couplers at their joints, else 0
])  # fmt: skip
# What an evaluation writes of them.
GROUP_DATA = np.dtype([
    ("line", np.float64, 36),  # inertial axes: force, torque on a, torque on b
    ("measured", np.float64, 12),  # terms of Phi, Phi', Phi'' by the motion of the ends
])  # fmt: skip
BUNDLE_DATA = np.dtype([("free", np.float64, 4), ("multiplier", np.float64, 4)])  # see `Work`
ENTRY_DATA = np.dtype([
    ("force", np.float64, 24),  # articulated force of unit multipliers, link's axes, at its origin
    ("drive", np.float64, 4),  # its force along a joint of one axis
])  # fmt: skip
RESPONSES = np.dtype([("S", np.float64, 16)])


@by_address
class Constraints(NamedTuple):
    """Packed constraints."""

    tables: Tables
    ends: np.ndarray  # (ne,) END
    rows: np.ndarray  # (m,) ROW
    terms: np.ndarray  # (nt,) TERM


@by_address
class Paths(NamedTuple):
    """Rows by fours, and which links they act on: on those of their ends, and on all between these and the ground.

    Rows that nothing can move (packing/bundles.py) act on none.
    """

    groups: np.ndarray  # (ng,) GROUP
    bundles: np.ndarray  # (nb,) BUNDLE
    lane: np.ndarray  # (m,) int, 4 group + lane of each row
    row: np.ndarray  # (4 nb,) int, row at each place of the bundles, -1: none
    first: np.ndarray  # (nl + 1,) int, first entry of each link
    entries: np.ndarray  # (np,) ENTRY, by links, then by bundles
    moving: int  # groups that something moves, which are the first
    slides: int  # rows of friction


@by_address
class Work(NamedTuple):
    """What changes in the constraints of a run, scratch and outcome of one evaluation."""

    value: np.ndarray  # (m,) what the row's function is added to: lengths as at the start
    unit: np.ndarray  # (m,) 1 / size of what the row measures; 0: it is not active
    floor: np.ndarray  # (m,) mobility that counts as none; infinite: it is not active
    ends: np.ndarray  # (ne,) END_DATA
    phi: np.ndarray  # (m,) Phi
    rate: np.ndarray  # (m,) Phi'
    bias: np.ndarray  # (m,) Phi'' without accelerations of the ends
    push: np.ndarray  # (m,) rate at which the multiplier does work: of the prescribed value, or of sliding
    wanted: np.ndarray  # (m,) what `solve` takes away from the rows
    goal: np.ndarray  # (m,) G u' that rows aim at
    compliance: np.ndarray  # (m,) of the compliant rows in an implicit step, else 0
    multiplier: np.ndarray  # (m,) that of the last `solve`
    free: np.ndarray  # (m,) G u' + Phi'' without G u', less the row's own bias: without multipliers (`write_responses`)
    S: np.ndarray  # (m, m) G M^-1 G^T (`write_responses`)
    rest: np.ndarray  # (4 nb, 4 nb) S by places in the bundles, lower half; what the factor leaves of it
    factor: np.ndarray  # (4 nb, 4 nb) columns of its pivoted factor, one after the other
    own: np.ndarray  # (4 nb,) diagonal of S
    left: np.ndarray  # (4 nb,) what is left of the mobility of each row
    inverse: np.ndarray  # (4 nb,) 1 / pivot
    solution: np.ndarray  # (4 nb,) scratch
    places: np.ndarray  # (4 nb,) int, of the rows by pivot
    order: np.ndarray  # (m,) int, rows by pivot; those beyond the rank are redundant
    rank: np.ndarray  # (1,) int
    held: np.ndarray  # (1,) int, the rank in the last closed state, m without one
    sine: np.ndarray  # (2,) the least sine of an independent row, now and in the last closed state
    tau: np.ndarray  # (nu,) zero between calls
    step: np.ndarray  # (nu,) response to the multipliers
    paths: Paths  # constant
    groups: np.ndarray  # (ng,) GROUP_DATA
    bundles: np.ndarray  # (nb,) BUNDLE_DATA
    entries: np.ndarray  # (np,) ENTRY_DATA
    modal: np.ndarray  # (np, 4 N) modal forces of the entries, eliminated
    between: np.ndarray  # (nb, nb) RESPONSES, S by bundles, its lower half
    speeds: np.ndarray  # (24,) scratch: what a joint of several axes yields
    shape: np.ndarray  # (ne, N, 6) partial velocities of the ends, link's axes


@compile_inline
def any_rows(cons):
    """Whether there are constraints; `cons` may be None."""
    if cons is None:
        return False
    return len(cons.rows) > 0


@compile_kernel
def constraint_residual(cons, model, data, y, motion, t, work, moving):
    """Write ``phi``, ``rate``, ``bias`` and the lines of action, after `outward` and `world`; `cons` may be None.

    With `moving`, only of the rows that something moves; the others have no multipliers.
    """
    if cons is None:
        return
    count = work.paths.moving if moving else len(work.groups)
    n = data.links[len(model.links)].omega[2]  # a turning ground sees other accelerations of the ends
    for k in range(len(cons.ends)):
        end, own = cons.ends[at(k)], work.ends[at(k)]
        if end.link < 0 and n == 0.0:
            continue
        if end.link >= 0:
            p, turn, v, w = _end_state(end, model, data, own, work.shape[at(k)])
        else:
            p, turn, v, w = get3(end.position), UNIT9, ZERO3, ZERO3
        v, w = (v[0] - n * p[1], v[1] + n * p[0], v[2]), (w[0], w[1], w[2] + n)
        put3(own.position, p)
        put9(own.rotation, turn)
        put3(own.velocity, v)
        put3(own.spin, w)
    for k in range(count):
        group, own = work.paths.groups[at(k)], work.groups[at(k)]
        if group.kind != COUPLER:
            _lines(group, work.ends[at(group.a)], work.ends[at(group.b)], own)
        _less_values(cons, work, group, own, t)
    _couplers(cons, y, model.nx, motion, work)


@compile_inline
def _less_values(cons, work, group, own, t):
    """Write what the rows of a group measure, less their values; nothing is measured of couplers yet."""
    for c in range(group.count):
        i, lane = at(group.rows[at(c)]), group.lane + c
        value, rate, acceleration = work.value[i], 0.0, 0.0
        if cons.rows[i].table >= 0:
            shift, rate, acceleration = table(cons.tables, cons.rows[i].table, t)
            value += shift
        work.phi[i], work.push[i] = own.measured[at(lane)] - value, rate
        work.rate[i], work.bias[i] = own.measured[at(4 + lane)] - rate, own.measured[at(8 + lane)] - acceleration
        if group.kind == SLIP:
            work.push[i] = work.rate[i]


@compile_inline
def _lines(group, a, b, own):
    """Lines of action of the rows of a group between two ends, and their terms of Phi, Phi', Phi''."""
    kind, r = group.kind, axpy3(get3(b.position), -1.0, get3(a.position))
    v, wa, wb = axpy3(get3(b.velocity), -1.0, get3(a.velocity)), get3(a.spin), get3(b.spin)
    none = four(0.0)
    f, ta, tb, phi, bias = (none, none, none), (none, none, none), (none, none, none), none, none
    if kind == DISTANCE:
        length = np.sqrt(dot3(r, r))
        g = 1.0 / length if length > 0.0 else 0.0
        line = (g * r[0], g * r[1], g * r[2])
        across = axpy3(v, -dot3(line, v), line)
        own_lane = get_lanes(group.in_a, 0)
        f = (line[0] * own_lane, line[1] * own_lane, line[2] * own_lane)
        phi, bias = four(length), four(g * dot3(across, across))
    else:
        e = times(get9(a.rotation), get_lanes3(group.in_a, 0))
        if kind == POINT:
            f, ta, phi = e, cross(e, r), dot3(e, r)
            bias = dot3(e, cross(wa, axpy3(cross(wa, r), -2.0, v)))
        elif kind == SLIP:
            f, ta = e, cross(e, r)
        elif kind == ABOUT:
            ta, tb = (-1.0 * e[0], -1.0 * e[1], -1.0 * e[2]), e
            bias = dot3(e, cross(wb, wa))
        else:
            h = times(get9(b.rotation), get_lanes3(group.in_b, 0))
            tb = cross(h, e)
            ta, phi, d = (-1.0 * tb[0], -1.0 * tb[1], -1.0 * tb[2]), dot3(e, h), axpy3(wb, -1.0, wa)
            bias = dot3(cross(d, h), cross(e, d)) + dot3(tb, cross(wb, wa))
    put_lanes3(own.line, 0, f)
    put_lanes3(own.line, 12, ta)
    put_lanes3(own.line, 24, tb)
    put_lanes3(own.measured, 0, (phi, dot3(f, v) + dot3(ta, wa) + dot3(tb, wb), bias))


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
def _end_state(end, model, data, found, shape):
    """Return the motion of an end as `node_state` does, and write to `found` what its acceleration follows from."""
    link, node = at(end.link), end.interface
    place = free_position(model, link, node)
    r, turn, v, w, linear, angular = interface_motion(data.modal, model, data, link, node, place, shape)
    put3(found.arm, r)
    put6(found.bias, (linear[0], linear[1], linear[2], angular[0], angular[1], angular[2]))
    own, spin = data.links[link], seen_spin(data, link)
    base = get9(own.orientation)
    position, velocity = times(base, r), times(base, add3(cross(spin, r), v))
    turn = _turned(data.modal, base, turn)
    return add3(get3(own.position), position), turn, add3(get3(own.velocity), velocity), times(base, add3(spin, w))


@compile_inline
def _turned(modal, base, turn):
    """Return a link's orientation with the rotation of a node, which is none without modes."""
    return base if modal is None else product(base, turn)


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
    found = dot3(line(work, i, 0), v) + dot3(line(work, i, 3), get_angular(work.ends[a].acceleration))
    return found + dot3(line(work, i, 6), get_angular(work.ends[b].acceleration))


@compile_inline
def line(work, i, c):
    """Three numbers from c on of the line of action of row i."""
    k, lane = work.paths.lane[i] >> 2, work.paths.lane[i] & 3
    own = work.groups[k].line
    return own[4 * c + lane], own[4 * c + 4 + lane], own[4 * c + 8 + lane]
