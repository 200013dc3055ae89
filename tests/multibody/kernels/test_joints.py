"""Joints of every type: what they refuse, and motions with a closed form."""

import numpy as np
import pytest

import modalprep as mp
from modalprep.errors import InputError
from modalprep.examples import uniform_beam
from modalprep.multibody.packing.tree import turn_to


def single(body=None, **changes):
    """One rigid block on one joint to the ground."""
    block = mp.rigid_body(
        "block", mass=2.0, centre=np.array([0.3, 0, 0]), inertia=np.diag([0.1, 0.2, 0.25]),
        interfaces={"root": np.zeros(3), "end": np.array([0.5, 0.1, 0])},
    )  # fmt: skip
    joint = mp.Joint(**{"name": "j", "parent": "ground", "child": "block"} | changes)
    return mp.System(bodies={"block": body or block}, joints=(joint,), gravity=np.array([0, 0, -9.81]))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"type": "sperical"}, "type 'sperical' does not exist; did you mean 'spherical'"),
        ({"type": "universal"}, "a universal joint needs a second_axis"),
        ({"type": "universal", "second_axis": np.array([0, 0, 2.0])}, "second_axis .* is parallel to axis"),
        ({"type": "planar", "second_axis": np.zeros(3)}, "second_axis .* has no direction"),
        ({"type": "prismatic", "axis": np.zeros(3)}, "axis .* has no direction"),
        ({"type": "prismatic", "angle": 1.0}, "a prismatic joint has no angle"),
        ({"type": "revolute", "displacement": 1.0}, "a revolute joint has no displacement"),
        ({"type": "revolute", "rate": np.ones(2)}, "rate .* must be 1 number"),
        ({"type": "planar", "speed": np.ones(3)}, "speed .* must be 2 number"),
        ({"type": "screw"}, r"a screw joint needs a pitch \(m for each turn\)"),
        ({"type": "revolute", "pitch": 0.01}, "'pitch' has no effect where type = 'revolute'; it belongs to 'screw'"),
    ],
)
def test_what_a_joint_refuses(changes, message):
    with pytest.raises(mp.InputError, match=f"joint 'j': {message}"):
        single(**changes)


def test_slide_on_an_inclined_axis():
    """A prismatic joint falls with the component of gravity along its axis."""
    axis = np.array([1.0, 2.0, -2.0]) / 3
    run = mp.simulate(single(type="prismatic", axis=axis, displacement=0.1, speed=0.4), t_end=1.0)
    expected = 0.1 + 0.4 * run.time + 0.5 * 9.81 * 2 / 3 * run.time**2
    np.testing.assert_allclose(run["j.displacement"], expected, rtol=1e-9)
    np.testing.assert_allclose(run["block.root.position"], expected[:, None] * axis, atol=1e-9)


def test_cylindrical_joint_falls_and_turns_on():
    run = mp.simulate(single(type="cylindrical", rate=3.0, angle=0.2), t_end=1.0)
    np.testing.assert_allclose(run["j.angle"], 0.2 + 3 * run.time, rtol=1e-9)
    np.testing.assert_allclose(run["j.displacement"], -0.5 * 9.81 * run.time**2, atol=1e-9)


@pytest.mark.parametrize("pitch", [0.3, -0.05])
def test_nut_falls_on_a_vertical_screw(pitch):
    """``(J + m h^2) angle'' = -m g h`` with h the travel for a radian and J about the axis."""
    h = pitch / (2 * np.pi)
    run = mp.simulate(single(type="screw", pitch=pitch, angle=0.4, rate=2.0), t_end=1.0)
    J = 0.25 + 2.0 * 0.3**2
    angle = 0.4 + 2.0 * run.time - 0.5 * 2.0 * 9.81 * h / (J + 2.0 * h**2) * run.time**2
    np.testing.assert_allclose(run["j.angle"], angle, rtol=1e-9)
    np.testing.assert_allclose(run["block.root.position"][:, 2], h * angle, atol=1e-12)
    spun = (0.5 + 0.1j) * np.exp(1j * angle)
    np.testing.assert_allclose(run["block.end.position"][:, :2], np.stack([spun.real, spun.imag], axis=1), atol=1e-9)


def test_driven_screw_gives_its_torque():
    """``(J + m h^2) angle'' + m g h`` is the generalised force of a prescribed motion."""
    h = 0.2 / (2 * np.pi)
    run = mp.simulate(single(type="screw", pitch=0.2, motion="t**2"), t_end=0.5)
    torque = (0.25 + 2.0 * 0.3**2 + 2.0 * h**2) * 2.0 + 2.0 * 9.81 * h
    np.testing.assert_allclose(run["j.drive"], torque, rtol=1e-9)


def test_planar_joint_is_a_projectile_that_spins():
    """The centre of mass flies its parabola in the plane y-z; the turn about x is uniform."""
    normal, first = np.array([1.0, 0, 0]), np.array([0, 1.0, 0])
    system = single(type="planar", axis=normal, second_axis=first, speed=np.array([1.0, 4.0]), rate=2.0)
    centre = mp.rigid_body(
        "block", mass=2.0, centre=np.zeros(3), inertia=np.diag([0.1, 0.2, 0.25]),
        interfaces={"root": np.zeros(3), "end": np.array([0, 0.1, 0])},
    )  # fmt: skip
    run = mp.simulate(system.with_(bodies={"block": centre}), t_end=1.0)
    np.testing.assert_allclose(run["j.angle"], 2 * run.time, rtol=1e-9, atol=1e-12)
    flight = np.stack([0 * run.time, run.time, 4 * run.time - 0.5 * 9.81 * run.time**2], axis=1)
    np.testing.assert_allclose(run["block.root.position"], flight, atol=1e-9)


@pytest.mark.parametrize("kind", ["universal", "spherical"])
def test_steady_conical_pendulum(kind):
    """A point mass at distance l under the pivot turns with ``w^2 = g / (l cos theta)`` on its cone."""
    length, theta = 0.7, 0.4
    bob = mp.rigid_body(
        "block", mass=2.0, centre=np.array([0, 0, -length]), inertia=1e-9 * np.eye(3),
        interfaces={"root": np.zeros(3), "bob": np.array([0, 0, -length])},
    )  # fmt: skip
    w = np.sqrt(9.81 / (length * np.cos(theta)))
    c, s = np.cos(theta), np.sin(theta)
    tilted = np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])
    start = {"rotation": tilted, "angular_velocity": tilted.T @ np.array([0, 0, w])}
    if kind == "universal":  # the bob starts at +x with velocity along +y
        x, y = np.array([1.0, 0, 0]), np.array([0, 1.0, 0])
        start = {"axis": y, "second_axis": x, "angle": np.array([-theta, 0.0]), "rate": np.array([0.0, w * s])}
    run = mp.simulate(single(bob, type=kind, **start), t_end=3.0, rtol=1e-10, atol=1e-12)
    at = length * np.stack([s * np.cos(w * run.time), s * np.sin(w * run.time), 0 * run.time - c], axis=1)
    np.testing.assert_allclose(run["block.bob.position"], at, atol=1e-6)  # the bob's own inertia of 1e-9


def test_driven_slide_gives_its_force():
    """A prismatic joint moved as sin(t) along z bears weight and inertia."""
    system = single(type="prismatic", motion=mp.multibody.TimeFunction("sin(t)"))
    run = mp.simulate(system, t_end=2.0)
    np.testing.assert_allclose(run["j.displacement"], np.sin(run.time), atol=1e-9)
    np.testing.assert_allclose(run["j.drive"], 2 * (9.81 - np.sin(run.time)), rtol=1e-8)


def test_free_joint_on_a_body_feels_nothing_of_it():
    """A block that starts at the tip of a spinning arm and is free of it flies straight."""
    arm = mp.rigid_body(
        "arm", mass=1.0, centre=np.array([0.5, 0, 0]), inertia=np.diag([0.1, 0.2, 0.3]),
        interfaces={"root": np.zeros(3), "tip": np.array([1.0, 0, 0])},
    )  # fmt: skip
    block = single(type="weld").bodies["block"]
    centred = block.with_(s0=np.zeros(3), E0=np.diag([0.1, 0.1, 0.1]))
    joints = (
        mp.Joint(name="hub", type="revolute", parent="ground", child="arm", rate=2.0),
        mp.Joint(name="gap", type="free", parent="arm.tip", child="block", position=np.array([0.2, 0, 0])),
    )
    run = mp.simulate(mp.System(bodies={"arm": arm, "block": centred}, joints=joints), t_end=1.0, rtol=1e-10)
    # at rest relative to the arm: it leaves with the speed w r, along y
    path = np.array([1.2, 0, 0]) + run.time[:, None] * np.array([0, 2.0 * 1.2, 0])
    np.testing.assert_allclose(run["block.root.position"], path, atol=1e-8)


def test_axis_along_minus_z():
    np.testing.assert_array_equal(turn_to(np.array([0.0, 0, -1])) @ [0, 0, 1], [0, 0, -1])


def test_gravity_is_three_numbers():
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="arm")
    arm = mp.System(bodies={"arm": uniform_beam(modes=1)}, joints=(hinge,), gravity=[0, -9.81, 0])
    assert arm.gravity.tolist() == [0.0, -9.81, 0.0]
    for wrong in (-9.81, [0, np.nan, 0]):
        with pytest.raises(InputError, match="is not three numbers"):
            arm.with_(gravity=wrong)
