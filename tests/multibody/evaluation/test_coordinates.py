"""State vectors read by name: what the joints were told to start with comes back."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import modalprep as mp
from modalprep.examples import uniform_beam
from modalprep.multibody import TimeFunction, coordinates
from modalprep.multibody.evaluation.evaluator import start_state
from modalprep.multibody.evaluation.expressions import channel_expression
from modalprep.multibody.evaluation.state import State
from modalprep.multibody.packing.coordinate_names import coordinate_names
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


def test_rows_of_linear_equations_have_the_names_of_channels(system):
    """As many as A has, speeds after coordinates; each is an output that reads its own state, and a channel of a run.

    Shifts and rotations of spherical and free joints are in other axes than displacements and quaternions of a run.
    """
    names = mp.linearise(system).states
    linear = mp.linearise(system, outputs=names)
    np.testing.assert_allclose(linear.C, np.eye(len(names)), atol=1e-12)
    run = mp.simulate(system, t_end=1e-3, output_step=1e-3)
    changes = [name for name in names if name.split(".")[1] in ("shift", "rotation")]
    assert len(changes) == 9
    assert all(name in run for name in names if name not in changes)
    assert {"universal.angle.2", "spherical.angular_velocity.3", "last.modal_rate.1"} <= set(names)


def test_control_laws_read_every_state_by_its_name(system):
    """The value of the channel at a state is that of the record of the state."""
    packed = pack(system)
    y = np.arange(1.0, packed.nx + packed.nu + 1) / 10
    state = State(system, packed, y, np.zeros((len(packed.links), 3)), None)
    rates = coordinate_names(packed).speeds
    found = [channel_expression(system, packed, name, "law")(0.0, state) for name in rates]
    np.testing.assert_array_equal(found, y[packed.nx :])
    assert (
        channel_expression(system, packed, "spherical.quaternion.4", "law")(0.0, state)
        == y[packed.coordinates_of("spherical")[3]]
    )


def test_a_component_is_known_by_its_number_too():
    """``gimbal.angle.2`` of a control law is that of a history, whose components are x, y and z."""
    gimbal = mp.Joint(name="gimbal", type="gimbal", parent="ground", child="arm", rate=np.array([1.0, 2, 3]))
    system = mp.System(bodies={"arm": uniform_beam(modes=1)}, joints=(gimbal,))
    run = mp.simulate(system, t_end=1e-3, output_step=1e-3)
    assert np.array_equal(run["gimbal.rate.2"], run["gimbal.rate.y"])
    assert "gimbal.rate.3" in run
    assert "gimbal.rate.4" not in run
