"""Rows of closed loops and motion constraints of the kernel: theory 5.4.

Constraints ``Phi(x, t) = 0`` hold between ends: interfaces of bodies with their elastic motion, or frames of the
ground. Each row has one line of action ``(f, ta, tb)``: its rate is ``f.(vb - va) + ta.wa + tb.wb`` less the rate of
its prescribed value, and its multiplier pushes the ends with just these forces and torques (responses.py).

Arguments as in articulated_body.py; `cons` Constraints, `work` Work.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.compiler.by_address import by_address
from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.compiler.lanes import four, get_lanes, get_lanes3, put_lanes, put_lanes3
from modalprep.multibody.kernels.algebra.matrices import UNIT9, times
from modalprep.multibody.kernels.algebra.tuples import (
    add3,
    at,
    axpy3,
    cross,
    dot3,
    get3,
    get9,
    put3,
    put9,
)
from modalprep.multibody.kernels.closed_loops.ends import end_state
from modalprep.multibody.kernels.interfaces import ground_rate
from modalprep.multibody.kernels.time_tables import Tables, table

# kinds of rows: e.(rb - ra), ea.eb, |rb - ra|, a sum of joint coordinates, each less its value; of e.(wb - wa) and of
# sliding, e.(vb - va), only the rate counts
POINT, ANGLE, DISTANCE, COUPLER, ABOUT, SLIP = range(6)
# One condition: kind, its ends, its function of time (-1: none), directions in the axes of the ends.
ROW = np.dtype(
    [
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
    ]
)
END = np.dtype(
    [  # an interface of a link's body; on the ground (link -1) its position and rotation
        ("link", np.int64),
        ("interface", np.int64),
        ("position", np.float64, 3),
        ("rotation", np.float64, 9),
    ]
)
TERM = np.dtype(
    [  # a coordinate (-1: prescribed) in the sum of a coupler's row
        ("row", np.int64),
        ("link", np.int64),
        ("x", np.int64),
        ("u", np.int64),
        ("factor", np.float64),
    ]
)
# What an evaluation writes, inertial axes: the motion of an end, and the line of action of a row.
END_DATA = np.dtype(
    [
        ("position", np.float64, 3),
        ("velocity", np.float64, 3),
        ("spin", np.float64, 3),
        ("acceleration", np.float64, 6),
        ("rotation", np.float64, 9),  # of its link's axes, turned with the node
        ("arm", np.float64, 3),  # from the link's origin, in its axes, as the acceleration left when A and q'' are zero
        ("bias", np.float64, 6),
    ]
)
# Rows of one kind between the same ends, at most four, each in a lane of its own (lanes.py); couplers by themselves.
GROUP = np.dtype(
    [
        ("kind", np.int64),
        ("a", np.int64),
        ("b", np.int64),
        ("count", np.int64),
        ("rows", np.int64, 4),
        ("lane", np.int64),  # of the first row
        ("bundle", np.int64),  # -1: nothing moves the rows
        ("at_a", np.int64),
        ("at_b", np.int64),  # entries at the links of its ends; -1: the ground, or none
        ("adds_a", np.int64),
        ("adds_b", np.int64),  # whether another end was there before
        ("timed", np.int64),  # whether rows have functions of time
        ("first", np.int64),  # whether it is the first in its bundle
        ("grounded", np.int64),  # whether end a is on the ground
        ("turning", np.int64),  # whether its rows push end b by torques
        ("link_a", np.int64),
        ("link_b", np.int64),  # of its ends
        ("in_a", np.float64, 12),
        ("in_b", np.float64, 12),  # directions in the axes of the links of its ends
    ]
)
# Groups that act on nearly the same links, in one vector; rows by lanes.
BUNDLE = np.dtype([("count", np.int64), ("rows", np.int64, 4)])
# One bundle at one link that its multipliers act on.
ENTRY = np.dtype(
    [
        ("bundle", np.int64),
        ("link", np.int64),
        ("begin", np.int64),
        ("end", np.int64),  # entries of its link
        ("count", np.int64),  # rows of its bundle
        ("u", np.int64),
        ("up", np.int64),  # speed of its joint of one axis, else -1; entry of the parent; -1: the ground
        ("adds", np.int64),  # whether another one or an end was there before
        ("factor", np.float64),  # of couplers at their joints, else 0
    ]
)
# What an evaluation writes of them.
GROUP_DATA = np.dtype(
    [
        ("line", np.float64, 36),  # inertial axes: force, torque on a, torque on b
        ("measured", np.float64, 12),  # terms of Phi, Phi', Phi'' by the motion of the ends
    ]
)
BUNDLE_DATA = np.dtype(
    [  # of its rows, see `Work`
        ("free", np.float64, 4),
        ("bias", np.float64, 4),
        ("weight", np.float64, 4),  # unit^2
        ("floor", np.float64, 4),
        ("usual", np.float64, 4),
        ("compliance", np.float64, 4),
        ("S", np.float64, 16),
    ]
)
ENTRY_DATA = np.dtype(
    [
        ("force", np.float64, 24),  # articulated force of unit multipliers, link's axes, at its origin
        ("drive", np.float64, 4),  # its force along a joint of one axis
    ]
)
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
    entries: np.ndarray  # (np,) ENTRY, by links from the last to the first, then by bundles
    moving: int  # groups that something moves, which are the first
    slides: int  # rows of friction
    works: int  # those, and rows that have functions of time
    rigid: bool  # whether the ends of all rows that something moves are on rigid bodies or the ground (rigid.py)
    planar: bool  # and all rows that something moves are those of planar loops (planar.py)
    in_plane: bool  # and all links of the system move in their plane (planar_tree.py)


@by_address
class Work(NamedTuple):
    """What changes in the constraints of a run, scratch and outcome of one evaluation."""

    value: np.ndarray  # (m,) what the row's function is added to: lengths as at the start
    unit: np.ndarray  # (m,) 1 / size of what the row measures; 0: it is not active (`weigh`)
    floor: np.ndarray  # (m,) mobility that counts as none; infinite: it is not active (`weigh`)
    usual: np.ndarray  # (m,) mobility in other positions of the joints (`weigh`)
    ends: np.ndarray  # (ne,) END_DATA
    phi: np.ndarray  # (m,) Phi
    rate: np.ndarray  # (m,) Phi'
    bias: np.ndarray  # (m,) Phi'' without accelerations of the ends
    push: np.ndarray  # (m,) rate at which the multiplier does work: of the prescribed value, or of sliding
    wanted: np.ndarray  # (m,) what `solve` takes away from the rows
    goal: np.ndarray  # (m,) G u' that rows aim at
    compliance: np.ndarray  # (m,) of the compliant rows in an implicit step, else 0 (`weigh`)
    multiplier: np.ndarray  # (m,) that of the last `solve`
    free: np.ndarray  # (m,) G u' + Phi'' without G u', less the row's own bias: without multipliers (`write_responses`)
    S: np.ndarray  # (m, m) G M^-1 G^T (`write_responses`)
    factor: np.ndarray  # (4 nb, 4 nb) columns of its pivoted factor L, one after the other
    columns: np.ndarray  # (4 nb, 4 nb) those of L D
    own: np.ndarray  # (4 nb,) diagonal of S, with compliance, by places in the bundles
    rest: np.ndarray  # (4 nb,) what the factor leaves of it
    inverse: np.ndarray  # (4 nb,) 1 / pivot
    given: np.ndarray  # (4 nb,) right-hand side of `solve_given`, by places
    halfway: np.ndarray  # (4 nb,) its scratch
    solution: np.ndarray  # (4 nb,) multipliers by places
    places: np.ndarray  # (4 nb,) int, of the rows by pivot
    order: np.ndarray  # (m,) int, as many as the rank are the independent rows by pivot; all others are redundant
    rank: np.ndarray  # (1,) int
    held: np.ndarray  # (1,) int, the rank in the last closed state, m without one
    flat: np.ndarray  # (1,) int, 1 after a residual that holds only what moves the rows (rigid.py)
    sine: np.ndarray  # (3,) the least sine of an independent row: now, in the last closed state, in a step so far
    tau: np.ndarray  # (nu,) zeros
    step: np.ndarray  # (nu,) response to the multipliers
    paths: Paths  # constant
    groups: np.ndarray  # (ng,) GROUP_DATA
    bundles: np.ndarray  # (nb,) BUNDLE_DATA
    entries: np.ndarray  # (np,) ENTRY_DATA
    modal: np.ndarray  # (np, 4 N) modal forces of the entries, eliminated
    between: np.ndarray  # (nb, nb) RESPONSES, S by bundles, below its diagonal
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
    work.flat[0], count = 0, work.paths.moving if moving else len(work.groups)
    n = ground_rate(data)
    for k in range(len(cons.ends)):
        end, own = cons.ends[at(k)], work.ends[at(k)]
        if end.link < 0 and n == 0.0:
            continue
        if end.link >= 0:
            p, turn, v, w = end_state(end, model, data, own, work.shape[at(k)])
        else:
            p = get3(end.position)
            turn = UNIT9
            v = (-n * p[1], n * p[0], 0.0)
            w = (0.0, 0.0, n)
        put3(own.position, p)
        put9(own.rotation, turn)
        put3(own.velocity, v)
        put3(own.spin, w)
    for k in range(len(work.bundles)):
        put_lanes(work.bundles[at(k)].bias, 0, four(0.0))
    for k in range(count):
        group, own = work.paths.groups[at(k)], work.groups[at(k)]
        if group.kind == POINT and group.grounded and n == 0.0:
            _lines_to_ground(group, work.ends[at(group.a)], work.ends[at(group.b)], own)
        elif group.kind != COUPLER:
            bias = _lines(group, work.ends[at(group.a)], work.ends[at(group.b)], own)
            if group.bundle >= 0:
                total = work.bundles[at(group.bundle)].bias
                put_lanes(total, 0, get_lanes(total, 0) + bias)
        less_values(cons, work, group, own, t)
    couplers(cons, y, model.nx, motion, work)


@compile_inline
def less_values(cons, work, group, own, t):
    """Write what the rows of a group measure, less what they shall be; nothing is measured of couplers yet."""
    if group.timed:
        _less_timed_values(cons, work, group, own, t)
    else:
        _less_constants(work, group, own)


@compile_inline
def _less_constants(work, group, own):
    """Write what the rows of a group measure, less constant values."""
    for c in range(group.count):
        i = at(group.rows[at(c)])
        lane = at(group.lane + c)
        work.phi[i] = own.measured[lane] - work.value[i]
        work.rate[i] = own.measured[at(4) + lane]
        work.bias[i] = own.measured[at(8) + lane]
        if group.kind == SLIP:
            work.push[i] = work.rate[i]


@compile_kernel
def _less_timed_values(cons, work, group, own, t):
    """Do as `_less_constants` where some of the values are functions of time."""
    for c in range(group.count):
        i = group.rows[c]
        lane = group.lane + c
        value = work.value[i]
        rate = 0.0
        acceleration = 0.0
        if cons.rows[i].table >= 0:
            shift, rate, acceleration = table(cons.tables, cons.rows[i].table, t)
            value += shift
        work.phi[i] = own.measured[lane] - value
        work.push[i] = rate
        work.rate[i] = own.measured[4 + lane] - rate
        work.bias[i] = own.measured[8 + lane] - acceleration
        if group.bundle >= 0:
            work.bundles[group.bundle].bias[lane] -= acceleration


@compile_inline
def _lines_to_ground(group, a, b, own):
    """Do as `_lines` for points of a body along axes of a ground at rest, where Phi'' is zero."""
    e = get_lanes3(group.in_a, 0)
    r = axpy3(get3(b.position), -1.0, get3(a.position))
    none = four(0.0)
    put_lanes3(own.line, 0, e)
    put_lanes3(own.line, 12, cross(e, r))
    put_lanes3(own.line, 24, (none, none, none))
    put_lanes3(own.measured, 0, (dot3(e, r), dot3(e, get3(b.velocity)), none))


@compile_inline
def _lines(group, a, b, own):
    """Write lines of action of the rows of a group between two ends, and their terms of Phi, Phi'; returns Phi''."""
    kind = group.kind
    r = axpy3(get3(b.position), -1.0, get3(a.position))
    v = axpy3(get3(b.velocity), -1.0, get3(a.velocity))
    wa = get3(a.spin)
    wb = get3(b.spin)
    none = four(0.0)
    f = (none, none, none)
    ta = (none, none, none)
    tb = (none, none, none)
    phi = none
    rate = none
    bias = none
    if kind == DISTANCE:
        length = np.sqrt(dot3(r, r))
        own_lane = get_lanes(group.in_a, 0)
        g = 1.0 / length if length > 0.0 else 0.0
        line = (g * r[0], g * r[1], g * r[2])
        across = axpy3(v, -dot3(line, v), line)
        f = (line[0] * own_lane, line[1] * own_lane, line[2] * own_lane)
        phi = length * own_lane
        rate = dot3(line, v) * own_lane
        bias = (g * dot3(across, across)) * own_lane
    else:
        e = times(get9(a.rotation), get_lanes3(group.in_a, 0))
        if kind == POINT or kind == SLIP:
            seen = axpy3(v, -1.0, cross(wa, r))  # from end a, which turns
            f = e
            ta = cross(e, r)
            rate = dot3(e, seen)
            if kind == POINT:
                phi = dot3(e, r)
                bias = dot3(e, cross(add3(seen, v), wa))
        elif kind == ABOUT:
            ta = (-1.0 * e[0], -1.0 * e[1], -1.0 * e[2])
            tb = e
            rate = dot3(e, axpy3(wb, -1.0, wa))
            bias = dot3(e, cross(wb, wa))
        else:
            h = times(get9(b.rotation), get_lanes3(group.in_b, 0))
            tb = cross(h, e)
            ta = (-1.0 * tb[0], -1.0 * tb[1], -1.0 * tb[2])
            phi = dot3(e, h)
            d = axpy3(wb, -1.0, wa)
            rate = dot3(tb, d)
            bias = dot3(cross(d, h), cross(e, d)) + dot3(tb, cross(wb, wa))
    put_lanes3(own.line, 0, f)
    put_lanes3(own.line, 12, ta)
    put_lanes3(own.line, 24, tb)
    put_lanes3(own.measured, 0, (phi, rate, bias))
    return bias


@compile_inline
def couplers(cons, y, nx, motion, work):
    """Add what sums of joint coordinates measure to what their rows are less of."""
    for k in range(len(cons.terms)):
        i, c, x = cons.terms[k].row, cons.terms[k].factor, cons.terms[k].x
        if x >= 0:
            work.phi[i] += c * y[x]
            work.rate[i] += c * y[nx + cons.terms[k].u]
        else:
            link = cons.terms[k].link
            lane = work.paths.lane[i]
            work.phi[i] += c * motion[link, 0]
            work.rate[i] += c * motion[link, 1]
            work.bias[i] += c * motion[link, 2]
            if work.paths.groups[lane >> 2].bundle >= 0:
                work.bundles[work.paths.groups[lane >> 2].bundle].bias[lane & 3] += c * motion[link, 2]


@compile_inline
def line(work, i, c):
    """Three numbers from c on of the line of action of row i."""
    k = work.paths.lane[i] >> 2
    lane = work.paths.lane[i] & 3
    own = work.groups[k].line
    return own[4 * c + lane], own[4 * c + 4 + lane], own[4 * c + 8 + lane]
