"""Rows between rigid bodies push in the axes of their links; constraints.py is the second implementation."""

import numpy as np
import pytest
from compare import assert_close
from multibody.closed_trees import Evaluation, closed_tree
from size import seeds

import modalprep as mp
from modalprep.compiler.jit import compile_kernel
from modalprep.multibody.evaluation.evaluate import build_equations, evaluate
from modalprep.multibody.evaluation.evaluator import Evaluator
from modalprep.multibody.kernels.articulated_body import outward_in_world
from modalprep.multibody.kernels.closed_loops.multipliers import constraint_accelerations
from modalprep.multibody.kernels.closed_loops.planar_tree import inward_of_closed
from modalprep.multibody.kernels.closed_loops.pushing import push_links
from modalprep.multibody.kernels.closed_loops.responses import write_responses
from modalprep.multibody.kernels.closed_loops.rigid import moving_residual
from modalprep.multibody.model.constraints import Closure

ROUND_OFF = 1e-12  # of sums of some ten products, by the largest
SOLVED = 1e-8  # multipliers carry it by the condition of rows at random, up to 1e4


def tree(seed):
    """A tree of rigid bodies with closures at random, those that a point slides along with friction."""
    system, y, motion = closed_tree(3 * seed)
    loops = [
        c.with_(friction_coefficient=0.2) if getattr(c, "type", "") in ("point_on_line", "point_on_plane") else c
        for c in system.closures
    ]
    return system.with_(closures=tuple(loops)), y, motion


@compile_kernel
def accelerations(cons, model, data, y, motion, t, work, tau, udot):
    """The order of calls of `evaluate.respond`."""
    outward_in_world(model, data, y, motion)
    moving_residual(cons, model, data, y, motion, t, work)
    status = inward_of_closed(cons, model, data, work, tau, None, 0.0, 0.0)
    constraint_accelerations(cons, model, data, work, 0.0, 0.0, tau, udot)
    return status


def in_links(run):
    """Evaluate as `evaluate` does, with what joints carry; returns the accelerations."""
    work, given = run.loops.work, (run.loops.arrays, run.packed.model, run.data, run.y, run.motion, run.t)
    assert accelerations(*given, work, run.tau, run.udot) == -1
    assert work.flat[0] == 1
    write_responses(work)
    return run.udot


@pytest.mark.parametrize("seed", seeds(22))
def test_rows_in_the_axes_of_links_equal_those_in_inertial_axes(seed):
    """Every type of closure and joint, rows whose values change with time, friction, any violation."""
    one, other = Evaluation(*tree(seed)), Evaluation(*tree(seed))
    udot, expected = in_links(one), other.solve()
    for name in ("phi", "rate", "bias", "push", "free", "S"):
        moved = np.isin(np.arange(len(one.loops.arrays.rows)), one.loops.work.paths.row)  # others are not measured
        found, known = getattr(one.loops.work, name)[moved], getattr(other.loops.work, name)[moved]
        assert_close(found, known, ROUND_OFF, scale=max(1.0, np.abs(known).max(initial=0.0)), name=name)
    assert one.loops.work.rank[0] == other.loops.work.rank[0]
    assert_close(udot, expected, SOLVED, scale=np.abs(expected).max())


@pytest.mark.parametrize("seed", seeds(22))
def test_what_joints_carry_is_the_same(seed):
    """The lines of action, which the evaluation leaves out, are measured where forces are recorded."""
    one, other = Evaluation(*tree(seed)), Evaluation(*tree(seed))
    in_links(one), other.solve()
    for run in (one, other):
        given = run.loops.arrays, run.packed.model, run.data
        push_links(*given, run.y, run.motion, run.t, run.loops.work, run.tau)
    lines = [run.loops.work.groups["line"][: run.loops.work.paths.moving] for run in (one, other)]
    assert_close(*lines, ROUND_OFF, scale=max(1.0, np.abs(lines[1]).max(initial=0.0)))
    found, expected = one.data.links["force"], other.data.links["force"]
    assert_close(found, expected, SOLVED, scale=np.abs(expected).max())


def test_in_an_orbit_rows_are_measured_in_inertial_axes():
    """There the ground turns, which the rows in the axes of links leave out."""
    ends = {"root": np.zeros(3), "tip": np.array([1.0, 0, 0])}
    rod = mp.rigid_body("rod", mass=1.0, centre=ends["tip"] / 2, inertia=np.eye(3), interfaces=ends)
    ball = mp.Joint(name="ball", type="spherical", parent="ground", child="rod")
    pin = Closure(name="pin", type="point_on_plane", a="ground", b="rod.tip", position=ends["tip"])
    system = mp.System(bodies={"rod": rod}, joints=(ball,), closures=(pin,))
    for orbit, flat in ((None, 1), (mp.multibody.Orbit(rate=1e-3), 0)):
        evaluator = Evaluator(system.with_(orbit=orbit))
        equations = build_equations(evaluator.packed, evaluator.loading)
        evaluate(equations, 0.0, np.append(evaluator.start, 0.0), np.zeros(len(evaluator.start) + 1))
        assert equations.work.flat[0] == flat
