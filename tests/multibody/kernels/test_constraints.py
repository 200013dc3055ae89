"""Loops and motion constraints of the kernel against the dense reference implementation, on random trees."""

import numpy as np
import pytest
from multibody.closed_trees import TYPES, Evaluation, closed_tree

from modalprep.multibody.reference.constraints import closed_accelerations, dense_constraints, reduced_accelerations
from modalprep.multibody.reference.equations import mass_and_force


@pytest.mark.parametrize("seed", range(33))
def test_loops_equal_the_dense_solution_on_random_trees(seed):
    """Every type of closure, rigid and flexible trees, with and without geometric stiffness, any violation."""
    system, y, motion = closed_tree(seed)
    run = Evaluation(system, y, motion)
    found = run.solve((3.0, 2.0))
    rows = dense_constraints(system, run.packed, run.loops, y, motion, run.t)
    work = run.loops.work
    for one, other in ((work.phi, rows.phi), (work.rate, rows.rate)):
        np.testing.assert_allclose(one, other, rtol=1e-11, atol=1e-11 * max(1.0, np.abs(other).max()))
    expected, multiplier = closed_accelerations(system, run.loops, y, motion, run.t, 3.0, 2.0)
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
        wanted = rows.bias[kept] + 6.0 * rows.rate[kept] + 4.0 * rows.phi[kept]
        assert np.abs(rows.G[kept] @ found + wanted).max() <= 1e-6 * np.abs(wanted).max()


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
