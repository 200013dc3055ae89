"""Systems that move in a plane are evaluated within it: the recursion in space is the second implementation."""

import numpy as np
import pytest
from compare import assert_close
from scipy.spatial.transform import Rotation

import modalprep as mp
from modalprep.errors import InputError
from modalprep.examples import uniform_beam
from modalprep.multibody.evaluation.evaluate import build_equations, evaluate
from modalprep.multibody.evaluation.evaluator import Evaluator
from modalprep.multibody.model.constraints import Closure
from modalprep.multibody.model.joint_element import HingeElement
from modalprep.multibody.packing import row_paths
from modalprep.multibody.packing.constraints import pack_constraints
from modalprep.multibody.packing.tree import pack

ROUND_OFF = 1e-11  # of two recursions over five links, of a regular position


TIP, SIDE = np.array([1.0, 0.2, 0.3]), np.array([0.4, -0.3, -0.2])
ANGLES = {"a": 0.3, "b": 1.1, "c": 0.8, "d": 0.9, "e": -1.2}  # of the joints


def bar(seed):
    """A bar whose centre and ends are out of its plane, and whose principal axes are turned."""
    turn, ends = Rotation.random(random_state=seed).as_matrix(), {"root": np.zeros(3), "tip": TIP, "side": SIDE}
    inertia, centre = turn @ np.diag([1.0, 1.2, 1.5]) @ turn.T, np.random.default_rng(seed).standard_normal(3)
    return mp.rigid_body("bar", mass=1.0 + seed, centre=centre, inertia=inertia, interfaces=ends)


def reach(chain, end):
    """Return where the end of the last bar of a chain is, from the root of the first."""
    angles = np.cumsum([ANGLES[name] for name in chain])
    turns = Rotation.from_rotvec(np.outer(angles, [0, 0, 1.0]))
    return turns.apply(np.array([TIP] * (len(chain) - 1) + [end])).sum(axis=0)


def hinge(parent, child, axis, *elements):
    angle, axis = ANGLES.get(child, 0.0), np.array(axis, dtype=float)
    return mp.Joint(
        name=f"j{child}", type="revolute", parent=parent, child=child, angle=angle, axis=axis, elements=elements
    )


def linkage(seed=0, tilt=0.0, body=None, kind="revolute", raised=0.0, branch=None):
    """Five bars in a plane turned at random, closed from bar to bar and from a bar to the ground; two hinges resist.

    Another one, `branch` its hinge's axis, is in no loop.
    """
    frame = Rotation.random(random_state=seed).as_matrix()
    normal, bodies = frame[:, 2], {name: bar(k) for k, name in enumerate("abcde")}
    bodies["c"] = body or bodies["c"]
    c = reach("ab", SIDE) - reach("cd", TIP) + [0.1 if kind == "distance" else 0.0, 0, 0]
    on_ground = {"type": "revolute", "parent": "ground", "axis": normal, "rotation": frame}
    joints = (
        mp.Joint(name="ja", child="a", angle=ANGLES["a"], rate=0.5, **on_ground),
        hinge("a.tip", "b", (tilt, 0, 1), HingeElement(stiffness=20.0)),
        mp.Joint(name="jc", child="c", angle=ANGLES["c"], position=frame @ c, **on_ground),
        hinge("c.tip", "d", (0, 0, 1), HingeElement(damping=5.0)),
        hinge("b.tip", "e", (0, 0, 1)),
    )
    pin = frame @ (reach("abe", SIDE) + np.array([0, 0, raised]))
    if branch is not None:
        bodies["f"] = bar(5)
        joints += (hinge("b.side", "f", branch),)
    closures = (
        Closure(name="inner", type=kind, a="b.side", b="d.tip"),
        Closure(name="outer", type="spherical", a="ground", b="e.side", position=pin, axis=normal),
    )
    return mp.System(bodies=bodies, joints=joints, closures=closures, gravity=np.array([1.0, -2.0, 9.81]))


def in_space(monkeypatch):
    """Let no loop count as planar."""
    monkeypatch.setattr(row_paths, "_planar", lambda *_: False)


def evaluated(system, seed):
    """Return if the evaluation was in the plane; accelerations, multipliers, rank, Phi near the assembled state."""
    evaluator = Evaluator(system)
    equations = build_equations(evaluator.packed, evaluator.loading)
    rng, nx, nu = np.random.default_rng(seed), evaluator.nx, evaluator.nu
    y = np.append(evaluator.start, 0.0)
    y[nx:-1] += rng.standard_normal(nu)
    y[:nx] += 1e-3 * rng.standard_normal(nx)
    rates = np.zeros(nx + nu + 1)
    assert evaluate(equations, 0.0, y, rates) < 0
    work = equations.work
    return bool(work.in_plane[0]), rates, work.multiplier.copy(), work.rank[0], work.phi.copy()


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    ("kind", "branch"),
    [("revolute", None), ("spherical", (0, 0, 1.0)), ("point_on_plane", None)],
)
def test_evaluation_in_the_plane_equals_that_in_space(kind, branch, seed, monkeypatch):
    """Bars with centres and products of inertia out of the plane, gravity across it, loops between bars and ground."""
    planar, *found = evaluated(linkage(seed, kind=kind, branch=branch), seed)
    in_space(monkeypatch)
    spatial, *expected = evaluated(linkage(seed, kind=kind, branch=branch), seed)
    assert planar
    assert not spatial
    for one, other in zip(found, expected, strict=True):
        assert_close(one, other, ROUND_OFF)


def test_added_mass_out_of_the_plane_counts(monkeypatch):
    """A tilted rod in water pushes along the normal when it turns, where gravity does work on it."""
    water = mp.multibody.Water(density=1000.0)
    rod = mp.multibody.ImmersedRod(name="wet", body="d", ends=("side", "tip"), diameter=0.2, water=water)
    planar, *found = evaluated(linkage().with_(loads=(rod,)), 1)
    in_space(monkeypatch)
    spatial, *expected = evaluated(linkage().with_(loads=(rod,)), 1)
    assert planar
    assert not spatial
    for one, other in zip(found, expected, strict=True):
        assert_close(one, other, ROUND_OFF)


def test_joints_and_closures_carry_what_leaves_the_plane(monkeypatch):
    """Torques about the axes in the plane, which the evaluation leaves out, are in the channels."""
    run = mp.simulate(linkage(), t_end=0.02, output_step=0.01, rtol=1e-8)
    in_space(monkeypatch)
    other = mp.simulate(linkage(), t_end=0.02, output_step=0.01, rtol=1e-8)
    assert run.status == other.status == "done"
    for name in run.channels:
        assert_close(run[name], other[name], 1e-8, scale=max(1.0, np.abs(other[name]).max()), name=name)
    assert np.abs(run["ja.torque"]).max() > 1.0


def test_a_link_without_inertia_about_its_hinge_is_named():
    """The status of an evaluation is the link, as from the recursion in space."""
    evaluator = Evaluator(linkage())
    equations = build_equations(evaluator.packed, evaluator.loading)
    light = equations.data.links[4]
    light["mass"], light["first_moment"], light["inertia"] = 0.0, 0.0, 0.0
    assert equations.model.links["last_child"][4] == -1
    assert evaluate(equations, 0.0, np.append(evaluator.start, 0.0), np.zeros(len(evaluator.start) + 1)) == 4


@pytest.mark.parametrize(
    "change", [{"tilt": 1e-6}, {"body": uniform_beam(modes=4)}, {"kind": "distance"}, {"branch": (0.6, 0, 0.8)}]
)
def test_systems_that_leave_the_plane_are_evaluated_in_space(change):
    system = linkage(**change)
    packed = pack(system)
    assert not row_paths.row_paths(pack_constraints(system, packed, 1.0).arrays, packed).planar


def test_in_an_orbit_the_evaluation_is_in_space():
    """There the ground turns, which the rows in the plane leave out."""
    system = linkage()
    assert evaluated(system, 0)[0]
    assert not evaluated(system.with_(orbit=mp.multibody.Orbit(rate=1e-3), gravity=np.zeros(3)), 0)[0]


def test_a_gap_across_the_plane_is_refused():
    with pytest.raises(InputError, match="'outer' cannot be closed.*a gap of 0.001 m"):
        Evaluator(linkage(raised=1e-3))
