"""What closed loops add to the products with the derivatives of the equations of motion: theory 5.9.

With the accelerations w of a stage's gradient, which keep the conditions, and their multipliers m, the loops add
``-l . G w - m . Phi''`` to ``w' ID``: the power of their forces, of multipliers l, at the velocities that w gives the
ends, and the accelerations of the conditions. The ends bring what these change by to their links, which the inward
sweep adds (kernels/tangents/pulled_back.py).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.compiler.by_address import by_address
from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.multibody.evaluation.evaluate import load
from modalprep.multibody.evaluation.evaluator import Evaluator
from modalprep.multibody.kernels.algebra.matrices import times
from modalprep.multibody.kernels.algebra.tuples import (
    ZERO3,
    add3,
    copy,
    cross,
    get3,
    get9,
    get_angular,
    put3,
    put_angular,
)
from modalprep.multibody.kernels.articulated_body import spread
from modalprep.multibody.kernels.closed_loops.compliance import row_acceleration
from modalprep.multibody.kernels.closed_loops.constraints import COUPLER, constraint_residual
from modalprep.multibody.kernels.closed_loops.ends import end_accelerations
from modalprep.multibody.kernels.interfaces import carried, node_acceleration
from modalprep.multibody.kernels.newton_euler import required_forces
from modalprep.sensitivity.conditions_back import acceleration_back, add_line, rate_back
from modalprep.sensitivity.force_back import bring_to_link, end_rows, place_end


@by_address
class LoopEnds(NamedTuple):
    """The ends of closures, and what is found of their m conditions at the stages of some steps."""

    rows: np.ndarray  # (ends,) END of force_back.py, in the order of `Constraints.ends`
    forces: np.ndarray  # (m,) multipliers of the stage
    pulls: np.ndarray  # (m,) those of the solution on the way back
    stage_forces: np.ndarray  # (12 k, m) the same of all stages
    stage_pulls: np.ndarray  # (12 k, m)
    places: np.ndarray  # (k, m) gradients by the conditions where a step ends
    rates: np.ndarray  # (k, m) by their rates
    ends: np.ndarray  # (k, nx + nu + 1) states there
    still: np.ndarray  # (nx + nu,) zeros
    none: np.ndarray  # (m,) zeros
    change: np.ndarray  # (2, nu) work
    moved: np.ndarray  # (nu,)


def loop_ends(evaluator: Evaluator, slot: int, steps: int, stages: int) -> LoopEnds | None:
    """Return the ends of the closures of a system, with work of the sweeps from `slot` on; None of a tree.

    Parameters
    ----------
    steps, stages : int
        For so many steps at once, of so many stages each.
    """
    if evaluator.loops is None:
        return None
    arrays, nu = evaluator.loops.arrays, evaluator.nu
    m = len(arrays.rows)
    rows = end_rows(evaluator.packed, [(int(end["link"]), int(end["interface"])) for end in arrays.ends], slot)
    for end, row in zip(arrays.ends, rows, strict=False):
        if end["link"] < 0:
            row["position"], row["rotation"] = end["position"], end["rotation"]
            row["acceleration"][:3] = -evaluator.packed.model.gravity
    return LoopEnds(
        rows=rows,
        forces=np.zeros(m),
        pulls=np.zeros(m),
        stage_forces=np.zeros((stages * steps, m)),
        stage_pulls=np.zeros((stages * steps, m)),
        places=np.zeros((steps, m)),
        rates=np.zeros((steps, m)),
        ends=np.zeros((steps, evaluator.nx + nu + 1)),
        still=np.zeros(evaluator.nx + nu),
        none=np.zeros(m),
        change=np.zeros((2, nu)),
        moved=np.zeros(nu),
    )


@compile_inline
def loops_back(loops, eq, work, pulled):
    """Add what the loops do between the sweeps of `pulled_back`; `loops` may be None."""
    if loops is not None:
        _go_back(loops, eq, work, pulled)


@compile_inline
def keep_forces(loops, eq):
    """Keep the multipliers of an evaluation, before a solution."""
    if loops is not None:
        copy(eq.work.multiplier, loops.forces)


@compile_inline
def keep_stage(loops, eq, row):
    """Keep those of a solution too, and both for the gradients by parameters."""
    if loops is not None:
        copy(eq.work.multiplier, loops.pulls)
        copy(loops.forces, loops.stage_forces[row])
        copy(loops.pulls, loops.stage_pulls[row])


@compile_kernel
def _go_back(loops, eq, work, pulled):
    place_ends(loops, eq, work, pulled)
    rows = eq.cons.rows
    for i in range(len(rows)):
        force, pull = loops.forces[i], loops.pulls[i]
        if rows[i].kind != COUPLER and (force != 0.0 or pull != 0.0):
            a, b = loops.rows[rows[i].a], loops.rows[rows[i].b]
            add_line(rows[i], a, b, a.wrench, b.wrench, force)
            rate_back(rows[i], a, b, a.twist, b.twist, force)
            acceleration_back(rows[i], a, b, pull)
    add_ends(loops, eq, work, pulled)


@compile_kernel
def conditions_back(loops, eq, work, pulled, places, rates):
    """Add what conditions times `places` and their rates times `rates`, both (m,), do, with a minus."""
    place_ends(loops, eq, work, pulled)
    rows = eq.cons.rows
    for i in range(len(rows)):
        if rows[i].kind != COUPLER and (places[i] != 0.0 or rates[i] != 0.0):
            a, b = loops.rows[rows[i].a], loops.rows[rows[i].b]
            add_line(rows[i], a, b, a.by_pose, b.by_pose, places[i])
            add_line(rows[i], a, b, a.by_rate, b.by_rate, rates[i])
            rate_back(rows[i], a, b, a.velocity_of, b.velocity_of, rates[i])
    add_ends(loops, eq, work, pulled)


@compile_kernel
def place_ends(loops, eq, work, pulled):
    """Write the motion of all ends."""
    for k in range(len(loops.rows)):
        end = loops.rows[k]
        if end.link >= 0:
            place_end(work.modes, eq.model, eq.data, work, pulled, end)
            v, w = node_acceleration(eq.model, eq.data, end.link, end.node, 1.0)
            put3(end.acceleration, v)
            put_angular(end.acceleration, w)
            put3(end.velocity_of, get3(end.velocity))
            put_angular(end.velocity_of, get3(end.omega))
        end.wrench[:] = end.by_pose[:] = 0.0
        end.by_rate[:] = end.by_acceleration[:] = 0.0


@compile_kernel
def add_ends(loops, eq, work, pulled):
    """Bring what stands at all ends to their links."""
    for k in range(len(loops.rows)):
        if loops.rows[k].link >= 0:
            _add(work.modes, eq.model, eq.data, work, pulled, loops.rows[k])


@compile_kernel
def _add(modes, model, data, work, pulled, end):
    """Bring what stands at an end to its link and to the modes of its body, with a minus.

    Forces keep their directions, while those of the sweep turn with the link, and so do the components of velocities
    and accelerations: the differences are torques, and what the spin adds to the rates of these components.
    """
    f, t = get3(end.wrench), get_angular(end.wrench)
    rate, brake = get3(end.by_rate), get_angular(end.by_rate)
    push, turn = get3(end.by_acceleration), get_angular(end.by_acceleration)
    v, w = get3(end.velocity), get3(end.omega)
    turned = add3(cross(v, rate), cross(w, brake))
    turned = add3(turned, add3(cross(get3(end.twist), f), cross(get_angular(end.twist), t)))
    turned = add3(turned, add3(cross(get3(end.acceleration), push), cross(get_angular(end.acceleration), turn)))
    turned = add3(turned, get_angular(end.by_pose))
    swung = cross(v, push)
    brake = add3(brake, add3(add3(swung, swung), cross(w, turn)))
    put3(end.placed, get3(end.by_pose))
    put_angular(end.placed, turned)
    put3(end.moving, rate)
    put_angular(end.moving, brake)
    for c in range(6):
        end.placed[c], end.moving[c], end.wrench[c] = -end.placed[c], -end.moving[c], -end.wrench[c]
        end.momentum[c] = -end.by_acceleration[c]
    bring_to_link(modes, model, data, work, pulled, end)


@compile_kernel
def add_couplers(cons, by_x, by_u, places, rates):
    """Subtract what conditions of joint coordinates do, as `conditions_back` does the others."""
    for k in range(len(cons.terms)):
        term = cons.terms[k]
        if term.x >= 0:
            by_x[term.u] -= term.factor * places[term.row]
            by_u[term.u] -= term.factor * rates[term.row]


@compile_kernel
def closed_product(eq, loops, steps, rows, count, force):
    """Return what the gradients of some steps make of the equations of a system, at given accelerations.

    Parameters
    ----------
    rows, count : int
        Stages and steps.
    force : (nu,)
        Work.
    """
    total = 0.0
    for r in range(rows):
        load(eq, steps.time[r], steps.states[r])
        required_forces(eq.model, eq.data, steps.accelerations[r], force)
        for u in range(len(force)):
            total += steps.push[r, u] * (force[u] - eq.tau[u])
        total -= _conditions(eq, steps, r, loops.stage_forces[r], loops.stage_pulls[r])
    for k in range(count):
        t = steps.t[k] + steps.h[k]
        load(eq, t, loops.ends[k])
        constraint_residual(eq.cons, eq.model, eq.data, loops.ends[k], eq.motion, t, eq.work, True)
        for i in range(len(eq.cons.rows)):
            if loops.places[k, i] != 0.0 or loops.rates[k, i] != 0.0:
                total -= loops.places[k, i] * eq.work.phi[i] + loops.rates[k, i] * eq.work.rate[i]
    return total


@compile_kernel
def _conditions(eq, steps, r, forces, pulls):
    """Return the power of the loops' forces at the gradient of a stage, and accelerations of conditions times `pulls`.

    After `required_forces`.
    """
    cons, model, data, work = eq.cons, eq.model, eq.data, eq.work
    constraint_residual(cons, model, data, steps.states[r], eq.motion, steps.time[r], work, True)
    end_accelerations(cons, model, data, work)
    for k in range(len(cons.ends)):
        own, link = work.ends[k], cons.ends[k].link
        if link < 0:
            put3(own.acceleration, carried(data, get3(own.position), ZERO3))
            continue
        base = get9(data.links[link].orientation)
        put3(own.acceleration, add3(get3(own.acceleration), times(base, get3(own.bias))))
        put_angular(own.acceleration, add3(get_angular(own.acceleration), times(base, get_angular(own.bias))))
    total = 0.0
    for i in range(len(cons.rows)):
        if pulls[i] != 0.0:
            total += pulls[i] * (row_acceleration(cons, work, i, steps.accelerations[r]) + work.bias[i])
    spread(model, data, steps.push[r])
    end_accelerations(cons, model, data, work)
    for i in range(len(cons.rows)):
        if forces[i] != 0.0:
            total += forces[i] * row_acceleration(cons, work, i, steps.push[r])
    return total
