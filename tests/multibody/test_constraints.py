"""Loops and motion constraints of the kernel against the dense twin, on random trees."""

import numpy as np
import pytest
from multibody.trees import random_state, random_tree
from scipy.spatial.transform import Rotation

from modalprep.multibody import kernel
from modalprep.multibody.closures import Closure, Coupler
from modalprep.multibody.dense import mass_and_force
from modalprep.multibody.dense_constraints import closed_accelerations, dense_constraints, reduced_accelerations
from modalprep.multibody.layout import pack, workspace
from modalprep.multibody.loops import Loops

TYPES = (
    "weld", "revolute", "prismatic", "cylindrical", "universal", "spherical", "planar", "point_on_line",
    "point_on_plane", "distance", "position",
)  # fmt: skip


def random_closures(system, seed, count):
    """Closures of random types between random interfaces or the ground, and a coupler."""
    rng = np.random.default_rng(seed)
    names, found = list(system.bodies), []
    for k in range(count):
        kind = TYPES[(seed + 3 * k) % len(TYPES)]
        one, two = (f"{name}.{rng.choice(['a', 'b'])}" for name in rng.choice(names, 2, replace=False))
        a, b = [(one, two), ("ground", two), (one, "ground")][rng.integers(3)]
        options = {"length": "2 + sin(t)/3"} if kind == "distance" else {}
        options |= {"path": ("1 + t", None, "cos(t)")} if kind == "position" else {}
        options |= {"second_axis": rng.standard_normal(3)} if kind == "universal" else {}
        turn = Rotation.random(random_state=int(rng.integers(1 << 30))).as_matrix()
        found.append(
            Closure(name=f"c{k}", type=kind, a=a, b=b, axis=rng.standard_normal(3), rotation=turn,
                    position=rng.standard_normal(3), **options)
        )  # fmt: skip
    coupled = [f"{name}.{count}" if count > 1 else name for name, count in system.coordinate_counts.items() if count]
    if coupled:
        found.append(Coupler(name="gear", factors=dict.fromkeys(coupled, 1.5), value="t + t**2"))
    return tuple(found)


class Evaluation:
    """One evaluation of the kernel at a state, loops included."""

    def __init__(self, system, y, motion, t=0.3):
        self.system, self.packed = system, pack(system)
        self.loops = Loops(system, self.packed, t_end=1.0)
        self.W, self.F = workspace(self.packed.tree, self.packed.flex)
        self.udot, self.tau = np.zeros((2, self.packed.nu))
        self.y, self.motion, self.t = y, motion, t

    def solve(self, baumgarte=(0.0, 0.0)):
        tree, flex = self.packed.tree, self.packed.flex
        kernel.outward(tree, flex, self.W, self.F, self.y, self.motion)
        self.loops.residual(self.W, self.F, self.y, self.motion, self.t)
        assert kernel.inward(tree, flex, self.W, self.F, self.tau, None, 0.0, 0.0) == -1
        kernel.forward(tree, flex, self.W, self.F, self.tau, self.udot)
        self.loops.correct(self.W, self.F, self.udot, baumgarte)
        return self.udot


def closed_tree(seed):
    root = ["free", "revolute", "weld", "prescribed"][seed % 4]
    most = 1 if seed % 3 == 0 else 6  # rigid
    system = random_tree(seed, root=root, geometric=seed % 2 == 0, most=most)
    if pack(system).nu == 0:
        system = random_tree(seed, root="free", geometric=seed % 2 == 0, most=most)
    system = system.with_(closures=random_closures(system, seed, 1 + seed % 2))
    y = random_state(system, seed)
    motion = np.random.default_rng(seed).standard_normal((len(pack(system).links), 3))
    return system, y, motion


@pytest.mark.parametrize("seed", range(33))
def test_loops_equal_the_dense_solution_on_random_trees(seed):
    """Every type of closure, rigid and flexible trees, with and without geometric stiffness, any violation."""
    system, y, motion = closed_tree(seed)
    run = Evaluation(system, y, motion)
    found = run.solve((3.0, 2.0))
    rows = dense_constraints(system, run.packed, run.loops.closing, y, motion, run.t)
    work = run.loops.work
    for one, other in ((work.phi, rows.phi), (work.rate, rows.rate)):
        np.testing.assert_allclose(one, other, rtol=1e-11, atol=1e-11 * max(1.0, np.abs(other).max()))
    expected, multiplier = closed_accelerations(system, run.loops.closing, y, motion, run.t, 3.0, 2.0)
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
    rows = dense_constraints(system, run.packed, run.loops.closing, y, motion, run.t)
    if run.loops.work.rank[0] < len(rows.G) or np.linalg.cond(rows.G) > 1e6:
        system = system.with_(closures=system.closures[-1:])  # the coupler alone, or one closure
        run = Evaluation(system, y, motion)
        found = run.solve()
    expected = reduced_accelerations(system, run.loops.closing, y, motion, run.t)
    assert np.abs(found - expected).max() <= 1e-8 * np.abs(expected).max()
