"""Joint positions and speeds that meet targets: textbook mechanisms in closed form."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import modalprep as mp
from modalprep.body.rigid import rigid_body
from modalprep.examples import uniform_beam
from modalprep.multibody import Closure, Target, TimeFunction, inverse_kinematics
from modalprep.multibody.preparation import start_channels

FREE = float("nan")


def rod(name, length):
    ends = {"root": np.zeros(3), "tip": np.array([length, 0, 0])}
    return rigid_body(name, mass=1.0, centre=np.array([length / 2, 0, 0]), inertia=np.eye(3), interfaces=ends)


def hinge(name, parent, child, angle=0.0, **more):
    return mp.Joint(name=name, type="revolute", parent=parent, child=f"{child}.root", angle=angle, **more)


def four_bar(crank=1.0, rate=2.0):
    """Ground 4 m, crank 1 m, coupler 3 m, rocker 3 m."""
    bodies = {"crank": rod("crank", 1.0), "coupler": rod("coupler", 3.0), "rocker": rod("rocker", 3.0)}
    joints = (
        hinge("a", "ground", "crank", crank, rate=rate),
        hinge("b", "crank.tip", "coupler", -0.5),
        hinge("c", "ground", "rocker", 1.9, position=(4.0, 0, 0)),
    )
    pin = Closure(name="pin", type="spherical", a="coupler.tip", b="rocker.tip")
    return mp.System(bodies=bodies, joints=joints, closures=(pin,))


@pytest.mark.parametrize("angle", [0.3, 1.0, 2.0])
def test_a_four_bar_with_its_crank_given(angle):
    """Norton, Design of Machinery, 4.5: the tip of the rocker is where two circles meet; its speed from the loop."""
    found = inverse_kinematics(four_bar(angle), given=["a"])
    crank = np.exp(1j * angle)
    d = 4.0 - crank
    tip = crank + d / 2 + 1j * d / abs(d) * np.sqrt(9.0 - abs(d) ** 2 / 4)
    rocker, coupler = np.angle(tip - 4.0), np.angle(tip - crank)
    assert found.joints["a"][0] == angle
    assert found.joints["c"][0] == pytest.approx(rocker, abs=1e-12)
    assert found.joints["b"][0] == pytest.approx(coupler - angle, abs=1e-12)
    speed = 2.0 * np.sin(angle - coupler) / np.sin(rocker - coupler) / 3.0
    assert found.joint_rates["a"][0] == 2.0
    assert found.joint_rates["c"][0] == pytest.approx(speed, abs=1e-11)
    assert (found.freedom, found.open) == (0, ())


def test_without_given_joints_a_loop_leaves_one_motion_open():
    found = inverse_kinematics(four_bar())
    assert found.freedom == 1
    assert set(found.open) == {"a", "b", "c"}


def slider_crank(angle=1.0):
    joints = (hinge("a", "ground", "crank", angle, rate=1.0), hinge("b", "crank.tip", "rod", -1.3))
    slot = Closure(name="slot", type="point_on_line", a="ground", b="rod.tip", axis=(1, 0, 0))
    return mp.System(bodies={"crank": rod("crank", 1.0), "rod": rod("rod", 3.0)}, joints=joints, closures=(slot,))


def test_a_slider_crank_with_its_slider_given():
    """The law of cosines; the speed of the slider by the principle of virtual work."""
    x, v = 3.2, -0.7
    target = Target(at="rod.tip", position=(x, FREE, FREE), velocity=(v, FREE, FREE))
    found = inverse_kinematics(slider_crank(), [target])
    angle = np.arccos((1 + x**2 - 9) / (2 * x))
    assert found.joints["a"][0] == pytest.approx(angle, abs=1e-11)
    lean = np.arcsin(np.sin(angle) / 3)
    assert found.joint_rates["a"][0] == pytest.approx(-v / np.sin(angle + lean) * np.cos(lean), abs=1e-10)
    channels = start_channels(found.system)
    assert channels["rod.tip.position"][0] == pytest.approx([x, 0, 0], abs=1e-11)
    assert channels["rod.tip.velocity"][0] == pytest.approx([v, 0, 0], abs=1e-10)


def robot(seed=0):
    """Six hinges in turn about z, y, y, x, y, x; the second link is flexible, at rest."""
    beam = uniform_beam(modes=2)
    bodies = {name: rod(name, 0.5) for name in "acdef"} | {"b": beam}
    axes = dict(zip("abcdef", np.eye(3)[[2, 1, 1, 0, 1, 0]], strict=True))
    angles = np.random.default_rng(seed).uniform(0.3, 0.8, 6)
    ends = {"b": beam.interface_name[1]}
    parents = ["ground", *(f"{name}.{ends.get(name, 'tip')}" for name in "abcde")]
    joints = tuple(
        mp.Joint(name=f"j{name}", type="revolute", parent=parent, child=name, axis=axes[name], angle=angle, rate=0.1)
        for name, parent, angle in zip("abcdef", parents, angles, strict=True)
    )
    return mp.System(bodies=bodies, joints=joints)


def forward(system, rates):
    """Position, rotation, velocity and angular velocity of the tip by a product of rotations."""
    lengths = [0.5, 10.0, 0.5, 0.5, 0.5, 0.5]
    place, turn, hinges = np.zeros(3), np.eye(3), []
    for joint, length in zip(system.joints, lengths, strict=True):
        hinges.append((place, turn @ joint.axis))
        turn = turn @ Rotation.from_rotvec(joint.angle * joint.axis).as_matrix()
        place = place + turn @ [length, 0, 0]
    spins = [rate * axis for rate, (_, axis) in zip(rates, hinges, strict=True)]
    velocity = sum(np.cross(spin, place - at) for spin, (at, _) in zip(spins, hinges, strict=True))
    return {"position": place, "rotation": turn, "velocity": velocity, "angular_velocity": sum(spins)}


def test_a_robot_reaches_a_place_and_an_orientation():
    """Six equations of six angles, and of six speeds."""
    rates = np.array([0.1, -0.2, 0.3, 0.4, -0.1, 0.2])
    wanted = forward(robot(1), rates)
    found = inverse_kinematics(robot(), [Target(at="f.tip", **wanted)])
    assert found.freedom == 0
    reached = forward(found.system, [joint.rate for joint in found.system.joints])
    for what, value in wanted.items():
        assert reached[what] == pytest.approx(value, abs=1e-8), what  # 1e-10 of ten metres


def test_a_redundant_robot_says_what_stays_open_and_weights_choose():
    wanted = start_channels(robot(1))["f.root.position"][0]
    target = Target(at="f.root", position=wanted)
    free = inverse_kinematics(robot(), [target])
    assert free.freedom == 3
    assert "jf" in free.open  # which turns about the axis through that point
    heavy = inverse_kinematics(robot(), [target], weights={"ja": 1e6})
    before = robot().joints[0].angle
    assert abs(heavy.joints["ja"][0] - before) < 1e-2 * abs(free.joints["ja"][0] - before)
    some = inverse_kinematics(robot(), [target], free=["ja", "jb", "jc"])
    assert some.freedom == 0
    assert some.joints["jd"][0] == robot().joints[3].angle


def test_a_delta_robot_in_closed_form():
    """Three arms of 0.3 m at a base of 0.2 m, pairs of rods of 0.8 m, a platform of 0.05 m that only travels."""
    base, arm, rods, plate, half = 0.2, 0.3, 0.8, 0.05, 0.04
    turns = 2 * np.pi / 3 * np.arange(3)
    across = [np.array([-np.sin(t), np.cos(t), 0]) for t in turns]
    along = [np.array([np.cos(t), np.sin(t), 0]) for t in turns]
    ends = {"root": np.zeros(3)}
    for k in range(3):
        ends |= {f"{k}{side}": plate * along[k] + s * half * across[k] for side, s in (("l", 1), ("r", -1))}
    bodies = {"platform": rigid_body("platform", mass=1.0, centre=np.zeros(3), inertia=np.eye(3), interfaces=ends)}
    joints = [mp.Joint(name="flight", type="free", parent="ground", child="platform.root", position=(0, 0, -0.7))]
    closures = []
    for k in range(3):
        places = {"root": np.zeros(3)} | {s: np.array([arm, f * half, 0]) for s, f in (("l", 1), ("r", -1))}
        bodies[f"arm{k}"] = rigid_body("arm", mass=1.0, centre=np.zeros(3), inertia=np.eye(3), interfaces=places)
        frame = np.column_stack([along[k], across[k], [0, 0, 1]])
        joints.append(
            mp.Joint(
                name=f"motor{k}",
                type="revolute",
                parent="ground",
                child=f"arm{k}.root",
                axis=across[k],
                position=base * along[k],
                rotation=frame,
                angle=0.2,
            )
        )
        closures += [
            Closure(
                name=f"rod{k}{side}",
                type="distance",
                a=f"arm{k}.{side}",
                b=f"platform.{k}{side}",
                length=TimeFunction(f"{rods}"),
            )
            for side in "lr"
        ]
    system = mp.System(bodies=bodies, joints=tuple(joints), closures=tuple(closures))
    place = np.array([0.12, -0.07, -0.75])
    found = inverse_kinematics(system, [Target(at="platform.root", position=place)])
    assert found.freedom == 0
    for k in range(3):
        x, y, z = (along[k] @ place + plate - base, across[k] @ place, place[2])
        reach = (x**2 + y**2 + z**2 + arm**2 - rods**2) / (2 * arm)  # x cos - z sin, z downwards turned
        angle = -np.arctan2(z, x) - np.arccos(reach / np.hypot(x, z))
        assert found.joints[f"motor{k}"][0] == pytest.approx(angle, abs=1e-10)


@pytest.mark.parametrize(
    ("make", "options", "error", "says"),
    [
        (slider_crank, {"targets": [Target(at="rod.tip", position=(5.0, FREE, FREE))]}, mp.SimulationError, "1 m away"),
        (
            four_bar,
            {"targets": [Target(at="rocker.tip", velocity=(9.0, FREE, FREE))], "given": ["a"]},
            mp.SimulationError,
            "velocity stays",
        ),
        (four_bar, {"given": ["a", "c"]}, mp.SimulationError, "do not close with joint"),
        (four_bar, {"given": ["d"]}, mp.InputError, "'d' does not exist"),
        (four_bar, {"given": ["a.2"]}, mp.InputError, "has 1 free coordinates"),
        (four_bar, {"given": ["a"], "free": ["b"]}, mp.InputError, "exclude each other"),
        (four_bar, {"weights": {"a": -1.0}}, mp.InputError, "must be positive"),
        (four_bar, {"targets": [Target(at="ground", position=(0, 0, 0))]}, mp.InputError, "does not move"),
        (four_bar, {"targets": 2 * [Target(at="crank.tip", position=(0, 1, 0))]}, mp.InputError, "two targets"),
    ],
)
def test_what_cannot_be_is_told(make, options, error, says):
    with pytest.raises(error, match=says):
        inverse_kinematics(make(), **options)


def test_nearest_is_accepted_where_it_is_meant():
    target = Target(at="rod.tip", position=(5.0, FREE, FREE))
    found = inverse_kinematics(slider_crank(), [target], nearest=True)
    assert found.errors["rod.tip.position"] == pytest.approx([-1.0, 0, 0], abs=1e-6)  # stretched, 4 m


@pytest.mark.parametrize("value", [{"position": (1.0, 2.0)}, {"weight": 0.0, "position": (0, 0, 0)}, {}])
def test_a_wrong_target_is_refused(value):
    with pytest.raises(mp.InputError, match="target at 'a.b'"):
        Target(at="a.b", **value)
