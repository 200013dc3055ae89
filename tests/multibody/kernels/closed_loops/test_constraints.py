"""Loops and motion constraints of the kernel against the dense reference implementation, on random trees."""

import numpy as np
import pytest
from compare import assert_close
from multibody.closed_trees import TYPES, Evaluation, closed_tree
from multibody.mechanisms import slider_crank
from multibody.spatial_loops import bricard, rod, spatial_loop
from size import seeds

from modalprep.multibody.evaluation.evaluate import build_equations, close, evaluate
from modalprep.multibody.evaluation.evaluator import Evaluator
from modalprep.multibody.kernels.closed_loops.constraint_forces import multiplier_response
from modalprep.multibody.kernels.closed_loops.factor import violation
from modalprep.multibody.kernels.closed_loops.projection import CLOSED
from modalprep.multibody.reference.constraints import closed_accelerations, dense_constraints, reduced_accelerations
from modalprep.multibody.reference.equations import mass_and_force


@pytest.mark.parametrize("seed", seeds(33))
def test_loops_equal_the_dense_solution_on_random_trees(seed):
    """Every type of closure, rigid and flexible trees, with and without geometric stiffness, any violation."""
    system, y, motion = closed_tree(seed)
    run = Evaluation(system, y, motion)
    found = run.solve()
    rows = dense_constraints(system, run.packed, run.loops, y, motion, run.t)
    work = run.loops.work
    for one, other in ((work.phi, rows.phi), (work.rate, rows.rate)):
        np.testing.assert_allclose(one, other, rtol=1e-11, atol=1e-11 * max(1.0, np.abs(other).max()))
    expected, multiplier = closed_accelerations(system, run.loops, y, motion, run.t)
    M, _ = mass_and_force(system, y, motion)
    S = rows.G @ np.linalg.solve(M, rows.G.T)
    np.testing.assert_allclose(work.S, S, rtol=1e-9, atol=1e-10 * np.abs(S).max())
    scale = np.abs(expected).max()
    if work.rank[0] == len(S):
        condition = np.linalg.cond(S / np.sqrt(np.outer(np.diag(S), np.diag(S))))
        assert np.abs(found - expected).max() <= 1e-10 * scale * max(1.0, 1e-5 * condition)
        np.testing.assert_allclose(work.multiplier, multiplier, rtol=1e-8, atol=1e-8 * np.abs(multiplier).max())
    else:  # more conditions than speeds: what is left satisfies those that were kept
        kept = work.order[: work.rank[0]]
        bias = rows.bias[kept]
        assert np.abs(rows.G[kept] @ found + bias).max() <= 1e-6 * np.abs(bias).max()


def test_every_type_of_closure_was_tried_with_full_rank():
    seen = set()
    for seed in range(33):
        system, y, motion = closed_tree(seed)
        run = Evaluation(system, y, motion)
        run.solve()
        if run.loops.work.rank[0] == len(run.loops.arrays.rows):
            seen |= {getattr(c, "type", "coupler") for c in system.closures}
    assert seen == {*TYPES, "coupler"}


@pytest.mark.parametrize("seed", range(0, 33, 3))
def test_independent_speeds_give_the_same_accelerations(seed):
    system, y, motion = closed_tree(seed)
    run = Evaluation(system, y, motion)
    found = run.solve()
    rows = dense_constraints(system, run.packed, run.loops, y, motion, run.t)
    if run.loops.work.rank[0] < len(rows.G) or np.linalg.cond(rows.G) > 1e6:
        system = system.with_(closures=system.closures[-1:])  # the coupler alone, or one closure
        run = Evaluation(system, y, motion)
        found = run.solve()
    expected = reduced_accelerations(system, run.loops, y, motion, run.t)
    assert np.abs(found - expected).max() <= 1e-8 * np.abs(expected).max()


@pytest.mark.parametrize("seed", seeds(33))
def test_free_motion_and_responses_equal_the_dense_ones(seed):
    """What the pass along the paths of the rows leaves: ``G u'`` without multipliers, and their ``M^-1 G^T``."""
    system, y, motion = closed_tree(seed)
    run = Evaluation(system, y, motion)
    run.solve()
    rows, work = dense_constraints(system, run.packed, run.loops, y, motion, run.t), run.loops.work
    M, f = mass_and_force(system, y, motion)
    # second derivatives of tabulated functions of time are good to 4e-10
    assert_close(work.free + work.bias, rows.G @ np.linalg.solve(M, f) + rows.bias, 1e-9)
    work.multiplier[:] = np.random.default_rng(seed).standard_normal(len(work.multiplier))
    multiplier_response(run.packed.model, run.data, work)
    # two eliminations of mass matrices of condition 1e5 or less
    assert_close(work.step, np.linalg.solve(M, rows.G.T @ work.multiplier), 1e-10)
    assert not np.any(work.tau)


LOOPS = {"bricard": spatial_loop(bricard(1.2), rod, rates=[3.0]), "slider crank": slider_crank()[0]}
SMALL = 1e-7  # a stray of a step


def strayed(name):
    """Equations of a loop, evaluated at a state that has strayed from it in coordinates and speeds."""
    evaluator = Evaluator(LOOPS[name])
    equations = build_equations(evaluator.packed, evaluator.loading)
    y = np.append(evaluator.start, 0.0)
    y[:-1] += SMALL * np.random.default_rng(1).standard_normal(len(y) - 1)
    evaluate(equations, 0.0, y, np.zeros(evaluator.nx + evaluator.nu + 1))
    return equations, y


@pytest.mark.parametrize("name", LOOPS)
def test_projection_with_the_factor_of_the_evaluation(name):
    """It ends where Newton's method with new factors does, which differs by the square of the stray."""
    found = []
    for factored in (True, False):
        equations, y = strayed(name)
        assert close(equations, 0.0, y, 0.0, factored) > 0
        found.append(y)
        evaluate(equations, 0.0, y, np.zeros(len(y)))
        work = equations.work
        assert max(violation(work, work.phi), violation(work, work.rate)) < CLOSED
    assert_close(*found, 100 * SMALL**2)


@pytest.mark.parametrize("name", LOOPS)
def test_projection_does_not_trust_a_factor_that_leaves_out_a_row(name):
    equations, y = strayed(name)
    equations.work.rank[0] -= 1  # as if it were redundant where the loop is open
    assert close(equations, 0.0, y, 0.0, True) > 0
    evaluate(equations, 0.0, y, np.zeros(len(y)))
    assert max(violation(equations.work, values) for values in (equations.work.phi, equations.work.rate)) < CLOSED
