"""Rows that nothing can move have no path: the reference implementation finds that their derivatives vanish."""

import numpy as np
import pytest
from multibody.closed_trees import Evaluation
from scipy.spatial.transform import Rotation

import modalprep as mp
from modalprep.examples import uniform_beam
from modalprep.multibody.model.constraints import Closure
from modalprep.multibody.packing.tree import pack
from modalprep.multibody.reference.constraints import dense_constraints

# held fast in the plane of the joints, and out of it
TYPES = {
    "weld": (3, 3), "revolute": (2, 3), "prismatic": (3, 2), "spherical": (2, 1), "planar": (0, 3),
    "point_on_plane": (0, 1), "cylindrical": (2, 2),
}  # fmt: skip
ROUND_OFF = 1e-13  # of unit vectors after four joints


def planar(kind, seed, tilt=0.0, body=None):
    """Two arms from the ground in a plane that is turned at random, a slider between; the arms' tips are joined."""
    rng = np.random.default_rng(seed)
    normal, along, across = Rotation.random(random_state=seed).as_matrix().T
    ends = {"root": np.zeros(3), "tip": rng.standard_normal(3)}
    rod = body or mp.rigid_body("rod", mass=1.0, centre=ends["tip"] / 2, inertia=np.eye(3), interfaces=ends)
    axis = normal + tilt * along
    joints = (
        mp.Joint(name="a", type="revolute", parent="ground", child="a", axis=normal),
        mp.Joint(name="b", type="prismatic", parent="a.tip", child="b", axis=along + across),
        mp.Joint(name="c", type="revolute", parent="b.tip", child="c", axis=axis / np.linalg.norm(axis)),
        mp.Joint(name="d", type="revolute", parent="ground", child="d", axis=-normal, position=across),
    )
    closure = Closure(name="k", type=kind, a="c.tip", b="d.tip", axis=normal)
    return mp.System(bodies=dict.fromkeys("abcd", rod), joints=joints, closures=(closure,))


def moving(system, seed):
    """Return the derivatives of the rows by the speeds, and which rows have a path, at a random state."""
    packed = pack(system)
    y = np.random.default_rng(seed).standard_normal(packed.nx + packed.nu)
    run = Evaluation(system, y, np.zeros((len(packed.links), 3)))
    run.solve()
    found = run.loops.work.S.diagonal() > 0
    return dense_constraints(system, packed, run.loops, y, run.motion, run.t).G, found


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("kind", TYPES)
def test_rows_out_of_a_plane_act_on_nothing(kind, seed):
    G, found = moving(planar(kind, seed), seed)
    inside, outside = TYPES[kind]
    assert (found.sum(), (~found).sum()) == (inside, outside)
    assert np.abs(G[~found]).max() <= ROUND_OFF * 10
    assert np.abs(G[found]).max(axis=1, initial=0.0).min(initial=np.inf) > 1e-3


@pytest.mark.parametrize("change", [{"tilt": 1e-6}, {"body": uniform_beam(modes=6)}])
def test_rows_act_where_an_axis_is_tilted_or_a_body_bends(change):
    assert moving(planar("weld", 0, **change), 0)[1].all()
