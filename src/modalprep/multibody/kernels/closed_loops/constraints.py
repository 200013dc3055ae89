"""Scalar constraint equations (rows) of closed loops and prescribed motions: theory 5.4.

Each row ``Phi(x, t) = 0`` acts between two ends: interfaces of bodies with their elastic motion, or frames fixed to the
ground. Its Jacobian follows from one line of action ``(f, ta, tb)``: ``Phi'`` is ``f.(vb - va) + ta.wa + tb.wb`` less
the rate of its prescribed value, and a multiplier of one exerts these forces and torques on the ends (responses.py).

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
    axpy3,
    cross,
    dot3,
    get3,
    get9,
    put3,
    put9,
    unsigned,
)
from modalprep.multibody.kernels.closed_loops.ends import end_state
from modalprep.multibody.kernels.interfaces import ground_rate
from modalprep.multibody.kernels.time_tables import Tables, table

# Kinds of rows: Phi is e.(rb - ra), ea.eb, |rb - ra| or a sum of joint coordinates, each less its prescribed value.
# ABOUT, e.(wb - wa), and SLIP, e.(vb - va), constrain rates alone: their Phi is zero.
POINT, ANGLE, DISTANCE, COUPLER, ABOUT, SLIP = range(6)
ROW = np.dtype(
    [
        ("kind", np.int64),
        ("a", np.int64),
        ("b", np.int64),  # its ends
        ("table", np.int64),  # function of time of its prescribed value, -1: constant
        ("in_a", np.float64, 3),
        ("in_b", np.float64, 3),  # directions in the axes of the ends
        ("friction", np.float64),  # of SLIP rows: coefficient
        ("sliding", np.float64),  # of SLIP rows: speed from which friction is that of sliding, m/s
        ("stiffness", np.float64),  # of compliant constraints; infinite for rigid ones
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
    [  # a joint coordinate in the sum of a coupler's row
        ("row", np.int64),
        ("link", np.int64),
        ("x", np.int64),
        ("u", np.int64),  # coordinate and speed; -1: prescribed
        ("factor", np.float64),
    ]
)
END_DATA = np.dtype(
    [  # motion of an end, inertial axes
        ("position", np.float64, 3),
        ("velocity", np.float64, 3),
        ("spin", np.float64, 3),
        ("acceleration", np.float64, 6),
        ("rotation", np.float64, 9),  # of its link's axes, with the elastic rotation of the node
        ("arm", np.float64, 3),  # from the link's origin, link's axes
        ("bias", np.float64, 6),  # acceleration with that of the link and q'' zero, link's axes
    ]
)
# Rows of one kind between the same ends, at most four: one vector lane each (lanes.py). Each coupler is its own group.
GROUP = np.dtype(
    [
        ("kind", np.int64),
        ("a", np.int64),
        ("b", np.int64),
        ("count", np.int64),
        ("rows", np.int64, 4),
        ("lane", np.int64),  # of the first row
        ("bundle", np.int64),  # -1: no joint can move the rows
        ("entry_a", np.int64),
        ("entry_b", np.int64),  # of the links of its ends; -1: the ground, or none
        ("accumulates_a", np.int64),
        ("accumulates_b", np.int64),  # whether another end has already written to that entry
        ("time_dependent", np.int64),  # whether rows have functions of time
        ("link_a", np.int64),
        ("link_b", np.int64),  # of its ends, -1: the ground
        ("in_a", np.float64, 12),
        ("in_b", np.float64, 12),  # directions in the axes of the links of its ends, by lanes
    ]
)
# Groups that act on nearly the same links and share one vector; rows by lanes.
BUNDLE = np.dtype([("count", np.int64), ("rows", np.int64, 4)])
# A bundle at one of the links on which its multipliers act.
ENTRY = np.dtype(
    [
        ("bundle", np.int64),
        ("link", np.int64),
        ("begin", np.int64),
        ("end", np.int64),  # entries of its link
        ("count", np.int64),  # rows of its bundle
        ("u", np.int64),  # speed of its joint of one axis, else -1
        ("parent", np.int64),  # entry of its bundle at the parent link; -1: the ground
        ("accumulates", np.int64),  # whether an end or another link has already written to the parent's entry
        ("factor", np.float64),  # of couplers at their joints, else 0
    ]
)
GROUP_DATA = np.dtype(
    [
        ("line", np.float64, 36),  # lines of action, inertial axes: force, torque on a, torque on b
        ("terms", np.float64, 12),  # what the motion of the ends contributes to Phi, Phi', Phi''
    ]
)
BUNDLE_DATA = np.dtype(
    [  # of its rows, see `Work`
        ("free", np.float64, 4),
        ("bias", np.float64, 4),
        ("weight", np.float64, 4),  # unit^2
        ("least_mobility", np.float64, 4),
        ("reference_mobility", np.float64, 4),
        ("compliance", np.float64, 4),
        ("S", np.float64, 16),
    ]
)
ENTRY_DATA = np.dtype(
    [
        ("force", np.float64, 24),  # articulated bias force of unit multipliers, link's axes, at its origin
        ("joint_force", np.float64, 4),  # its component along a joint of one axis
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
    """Rows in vectors of four, and the links on which they act: all between their ends and the ground.

    Rows that no joint can move (packing/row_paths.py) act on none.
    """

    groups: np.ndarray  # (ng,) GROUP
    bundles: np.ndarray  # (nb,) BUNDLE
    lane: np.ndarray  # (m,) int, 4 group + lane of each row
    row: np.ndarray  # (4 nb,) int, row in each lane of the bundles, -1: none
    entries: np.ndarray  # (np,) ENTRY, by links from the last to the first, then by bundles
    movable: int  # number of groups that joints can move, which come first
    slides: int  # number of rows of friction
    driven: int  # number of those, and of rows with functions of time
    planar: bool  # whether the system moves in one plane and its movable rows constrain points in it (planar.py)


@by_address
class Work(NamedTuple):
    """State of the constraints in a run, and scratch and outcome of one evaluation.

    The mobility of a row is its diagonal element of ``S = G M^-1 G^T``. Arrays (4 nb,) are by lanes of the bundles.
    """

    value: np.ndarray  # (m,) constant part of the prescribed value: lengths as at the start
    unit: np.ndarray  # (m,) 1 / size of what the row constrains; 0: inactive (`update_weights`)
    least_mobility: np.ndarray  # (m,) below it a row cannot move; infinite: inactive (`update_weights`)
    reference_mobility: np.ndarray  # (m,) in other positions of the joints (`update_weights`)
    ends: np.ndarray  # (ne,) END_DATA
    phi: np.ndarray  # (m,) Phi
    rate: np.ndarray  # (m,) Phi'
    bias: np.ndarray  # (m,) Phi'' with the accelerations of the ends zero
    driven_rate: np.ndarray  # (m,) of the prescribed value, or of sliding: times the multiplier it is a power
    residual: np.ndarray  # (m,) right-hand side of `solve`
    target: np.ndarray  # (m,) what G u' should be in an implicit step
    compliance: np.ndarray  # (m,) of compliant rows in an implicit step, else 0 (`update_weights`)
    multiplier: np.ndarray  # (m,) of the last `solve`
    free: np.ndarray  # (m,) G u' without multipliers, with the row's bias by inner motion (`gather_responses`)
    S: np.ndarray  # (m, m) G M^-1 G^T (`gather_responses`)
    factor: np.ndarray  # (4 nb, 4 nb) columns of its pivoted factor L, one after the other
    columns: np.ndarray  # (4 nb, 4 nb) those of L D
    diagonal: np.ndarray  # (4 nb,) of S, with compliance
    remaining: np.ndarray  # (4 nb,) diagonal of the Schur complement after the pivots so far
    inverse: np.ndarray  # (4 nb,) 1 / pivot
    rhs: np.ndarray  # (4 nb,) right-hand side, overwritten by the forward substitution
    reduced: np.ndarray  # (4 nb,) solution of its forward substitution, by pivots
    solution: np.ndarray  # (4 nb,) multipliers
    pivots: np.ndarray  # (4 nb,) int, lanes of the rows in the order of the pivots
    order: np.ndarray  # (m,) int, rows in the order of the pivots; those beyond the rank are redundant
    rank: np.ndarray  # (1,) int
    closed_rank: np.ndarray  # (1,) int, the rank in the last closed state, m without one
    in_plane: np.ndarray  # (1,) int, 1 after `planar_residual`
    sine: np.ndarray  # (1,) the least sine between an independent row and those before it
    closed_sine: np.ndarray  # (1,) the same in the last closed state
    least_sine: np.ndarray  # (1,) the same in the step so far
    tau: np.ndarray  # (nu,) zeros
    step: np.ndarray  # (nu,) response to the multipliers
    paths: Paths  # constant
    groups: np.ndarray  # (ng,) GROUP_DATA
    bundles: np.ndarray  # (nb,) BUNDLE_DATA
    entries: np.ndarray  # (np,) ENTRY_DATA
    modal: np.ndarray  # (np, 4 N) modal forces of the entries, eliminated
    between: np.ndarray  # (nb, nb) RESPONSES, blocks of S below its diagonal
    speeds: np.ndarray  # (24,) scratch: response of a joint of several axes
    shape: np.ndarray  # (ne, N, 6) partial velocities of the ends, link's axes


@compile_inline
def has_rows(cons):
    """Return whether there are constraints; `cons` may be None."""
    if cons is None:
        return False
    return len(cons.rows) > 0


@compile_kernel
def constraint_residual(cons, model, data, y, motion, t, work, movable):
    """Write ``phi``, ``rate``, ``bias`` and the lines of action, after `outward` and `world`; `cons` may be None.

    With `movable`, only of the rows that joints can move; the others have no multipliers.
    """
    if cons is None:
        return
    work.in_plane[0] = 0
    _end_motions(cons, model, data, work)
    for k in range(len(work.bundles)):
        put_lanes(work.bundles[unsigned(k)].bias, 0, four(0.0))
    for k in range(work.paths.movable if movable else len(work.groups)):
        group, own = work.paths.groups[unsigned(k)], work.groups[unsigned(k)]
        if group.kind != COUPLER:
            bias = _lines_of_action(group, work.ends[unsigned(group.a)], work.ends[unsigned(group.b)], own)
            if group.bundle >= 0:
                total = work.bundles[unsigned(group.bundle)].bias
                put_lanes(total, 0, get_lanes(total, 0) + bias)
        subtract_prescribed(cons, work, group, own, t)
    _add_couplers(cons, y, model.nx, motion, work)


@compile_inline
def _end_motions(cons, model, data, work):
    """Write the motion of all ends; those on a ground at rest stay where they are."""
    n = ground_rate(data)
    for k in range(len(cons.ends)):
        end, own = cons.ends[unsigned(k)], work.ends[unsigned(k)]
        if end.link < 0 and n == 0.0:
            continue
        if end.link >= 0:
            p, turn, v, w = end_state(end, model, data, own, work.shape[unsigned(k)])
        else:
            p = get3(end.position)
            turn = UNIT9
            v = (-n * p[1], n * p[0], 0.0)
            w = (0.0, 0.0, n)
        put3(own.position, p)
        put9(own.rotation, turn)
        put3(own.velocity, v)
        put3(own.spin, w)


@compile_inline
def subtract_prescribed(cons, work, group, own, t):
    """Write Phi, Phi' and the bias of the rows of a group: the terms of its ends less the prescribed values."""
    if group.time_dependent:
        _subtract_functions(cons, work, group, own, t)
    else:
        _subtract_constants(work, group, own)


@compile_inline
def _subtract_constants(work, group, own):
    """Do as `subtract_prescribed` where all values are constant."""
    for c in range(group.count):
        i = unsigned(group.rows[unsigned(c)])
        lane = unsigned(group.lane + c)
        work.phi[i] = own.terms[lane] - work.value[i]
        work.rate[i] = own.terms[unsigned(4) + lane]
        work.bias[i] = own.terms[unsigned(8) + lane]
        if group.kind == SLIP:
            work.driven_rate[i] = work.rate[i]


@compile_kernel
def _subtract_functions(cons, work, group, own, t):
    """Do as `subtract_prescribed` where some of the values are functions of time."""
    for c in range(group.count):
        i = group.rows[c]
        lane = group.lane + c
        value = work.value[i]
        rate = 0.0
        acceleration = 0.0
        if cons.rows[i].table >= 0:
            shift, rate, acceleration = table(cons.tables, cons.rows[i].table, t)
            value += shift
        work.phi[i] = own.terms[lane] - value
        work.driven_rate[i] = rate
        work.rate[i] = own.terms[4 + lane] - rate
        work.bias[i] = own.terms[8 + lane] - acceleration
        if group.bundle >= 0:
            work.bundles[group.bundle].bias[lane] -= acceleration


@compile_inline
def _lines_of_action(group, a, b, own):
    """Write lines of action of the rows of a group between two ends, and their terms of Phi, Phi'; returns the bias."""
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
            relative = axpy3(v, -1.0, cross(wa, r))  # in the axes of end a, which turn
            f = e
            ta = cross(e, r)
            rate = dot3(e, relative)
            if kind == POINT:
                phi = dot3(e, r)
                bias = dot3(e, cross(add3(relative, v), wa))
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
    put_lanes3(own.terms, 0, (phi, rate, bias))
    return bias


@compile_inline
def _add_couplers(cons, y, nx, motion, work):
    """Add the sums of joint coordinates to Phi, Phi' and the bias of their rows."""
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
def line_of_action(work, i, c):
    """Return a vector of the line of action of row i: force (c = 0), torque on a (3), torque on b (6)."""
    k = work.paths.lane[i] >> 2
    lane = work.paths.lane[i] & 3
    own = work.groups[k].line
    return own[4 * c + lane], own[4 * c + 4 + lane], own[4 * c + 8 + lane]
