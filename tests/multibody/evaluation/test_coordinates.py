"""State vectors read by name: what the joints were told to start with comes back."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import modalprep as mp
from modalprep.examples import uniform_beam
from modalprep.multibody import StateSpace, TimeFunction, coordinates
from modalprep.multibody.evaluation.evaluator import start_state
from modalprep.multibody.packing.tree import pack

TURN = Rotation.from_rotvec([0.1, -0.2, 0.3])
MOVES = {  # by type: the start, coordinates, speeds
    "revolute": ({"angle": 0.1, "rate": 2.0}, [0.1], [2.0]),
    "prismatic": ({"displacement": 0.3, "speed": -1.0}, [0.3], [-1.0]),
    "cylindrical": ({"displacement": 0.3, "angle": 0.1, "speed": 4.0, "rate": 5.0}, [0.3, 0.1], [4.0, 5.0]),
    "universal": (
        {"second_axis": np.eye(3)[0], "angle": np.array([0.1, 0.2]), "rate": np.array([3.0, 4.0])},
        [0.1, 0.2],
        [3.0, 4.0],
    ),
    "weld": ({}, [], []),
    "spherical": (
        {"rotation": TURN.as_matrix(), "angular_velocity": np.array([1.0, 2, 3])},
        TURN.as_quat(scalar_first=True),
        [1.0, 2.0, 3.0],
    ),
    "free": (
        {
            "position": np.array([1.0, 2, 3]),
            "velocity": np.array([4.0, 5, 6]),
            "angular_velocity": np.array([7.0, 8, 9]),
        },
        [1.0, 2, 3, 1, 0, 0, 0],
        [4.0, 5, 6, 7, 8, 9],
    ),
}


def chain():
    """One joint of each type in a tree; beams with two modes each."""
    joints = [
        mp.Joint(name=kind, type=kind, parent="ground", child=f"b_{kind}", **start)
        for kind, (start, _, _) in MOVES.items()
    ]
    driven = mp.Joint(name="driven", type="revolute", parent="b_weld.tip", child="last", motion=TimeFunction("2 + 3*t"))
    bodies = {f"b_{kind}": uniform_beam(modes=2) for kind in MOVES} | {"last": uniform_beam(modes=1)}
    return mp.System(bodies=bodies, joints=(*joints, driven))


@pytest.fixture(scope="module")
def system():
    return chain()


def test_joints_have_the_start_that_they_were_told(system):
    state = coordinates(system, start_state(pack(system)))
    for kind, (_, position, rate) in MOVES.items():
        np.testing.assert_allclose(state.joint(kind).position, position, atol=1e-15)
        np.testing.assert_allclose(state.joint(kind).rate, rate, atol=1e-15)


def test_every_number_of_a_state_belongs_to_one_name(system):
    """Names of joints and bodies share the state out: each number is read once."""
    packed = pack(system)
    y = np.arange(1.0, packed.nx + packed.nu + 1)
    state = coordinates(system, y)
    free = [joint.name for joint in system.joints if joint.name != "driven"]
    read = [part for name in free for part in state.joint(name)]
    read += [part for name in system.bodies for part in (state.modal(name), state.modal_rate(name))]
    assert np.array_equal(np.sort(np.concatenate(read)), y)


def test_prescribed_joints_are_where_their_motion_is(system):
    packed = pack(system)
    y = np.zeros((3, packed.nx + packed.nu))
    state = coordinates(system, y, np.array([0.0, 1.0, 2.0]))
    assert state.joint("driven").position.tolist() == [[2.0], [5.0], [8.0]]
    assert state.joint("driven").rate.tolist() == [[3.0]] * 3
    assert state.modal("last").shape == (3, 1)


def test_unknown_names_and_other_sizes_are_refused(system):
    y = start_state(pack(system))
    with pytest.raises(mp.InputError, match="state: joint 'revolut' does not exist; did you mean 'revolute'"):
        coordinates(system, y).joint("revolut")
    with pytest.raises(mp.InputError, match="state: body 'tree' does not exist"):
        coordinates(system, y).modal("tree")
    with pytest.raises(mp.InputError, match=rf"has {len(y)} numbers; the one given has the shape \(3,\)"):
        coordinates(system, np.zeros(3))


def test_rows_of_linear_equations_have_names():
    """As many as A has, speeds after coordinates; a coordinate that a loop makes dependent is not among them."""
    owner = (
        ("joint", "hinge"),
        ("body", "arm"),
        ("body", "arm"),
        ("joint", "ball"),
        ("joint", "ball"),
        ("joint", "ball"),
    )
    some = {key: np.zeros(0) for key in ("A", "B", "C", "D", "R", "y", "udot", "error_estimate")}
    linear = StateSpace(**some, inputs=(), outputs=(), owner=owner, independent=np.array([0, 2, 3, 5]), error=0.0)
    names = ("hinge", "arm.modal.2", "ball.1", "ball.3")
    assert linear.states == (*names, *(f"{name}.rate" for name in names))
