"""Robots: joint torques by virtual work along their own kinematics, tables of a pipeline file, wrong files."""

import numpy as np
import pytest
from compare import assert_close
from scipy.spatial.transform import Rotation

import modalprep as mp
from modalprep.cli import main
from modalprep.examples import uniform_beam
from modalprep.formats import read_urdf, write_urdf
from modalprep.formats.robots.write import lost_in_urdf
from modalprep.multibody import inverse_dynamics
from modalprep.multibody.simulate import simulate
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.load import load
from modalprep.pipeline.systems.read import read_system

GRAVITY = np.array([0.5, -1.0, -9.81])
X, Y, Z, ZERO = (1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, 0)
# name, type, parent, xyz, rpy, axis, mass, centre, rpy of the inertia, moments; the massless flange has none
LINKS = (
    ("shoulder", "continuous", "base", (0.1, 0, 0.3), (0.2, -0.4, 0.5), Z, 4.0, (0.1, 0, 0.2), X, (0.4, 0.5, 0.3)),
    ("upper", "revolute", "shoulder", (0, 0.2, 0.1), (1, 0.1, 0), (0, 2, 0), 3.0, (0.3, 0, 0), Y, (0.1, 0.3, 0.35)),
    ("camera", "fixed", "upper", (0.2, 0.1, 0), (0, 0, 0.7), None, 0.5, (0, 0, 0.05), Z, (0.01, 0.02, 0.02)),
    ("slide", "prismatic", "upper", (0.6, 0, 0), (0, 0.5, 0), (1, 0, 1), 2.0, (0, 0.1, 0), ZERO, (0.05, 0.04, 0.03)),
    ("hand", "revolute", "slide", (0.1, 0, 0.2), ZERO, X, 1.0, (0, 0, 0.1), ZERO, (0.01, 0.02, 0.015)),
)
MOVING = [link for link in LINKS if link[1] != "fixed"]


def text(numbers):
    return " ".join(repr(float(x)) for x in numbers)


def element(link):
    name, kind, parent, xyz, rpy, axis, mass, centre, turned, moments = link
    i = " ".join(f'i{k}{k}="{v}"' for k, v in zip("xyz", moments, strict=True)) + ' ixy="0" ixz="0" iyz="0"'
    axes = f'<axis xyz="{text(axis)}"/>' if axis else ""
    limit = '<limit lower="-2" upper="2" effort="9" velocity="9"/>' if kind in ("revolute", "prismatic") else ""
    return (
        f'<link name="{name}"><inertial><origin xyz="{text(centre)}" rpy="{text(turned)}"/><mass value="{mass}"/>'
        f'<inertia {i}/></inertial></link><joint name="{name}_joint" type="{kind}"><parent link="{parent}"/>'
        f'<child link="{name}"/><origin xyz="{text(xyz)}" rpy="{text(rpy)}"/>{axes}{limit}</joint>'
    )


FLANGE = (
    '<link name="flange"/><joint name="flange_joint" type="fixed"><parent link="hand"/><child link="flange"/>'
    '<origin xyz="0 0 0.3"/></joint>'
)
ARM = f'<robot name="arm"><link name="base"/>{"".join(map(element, LINKS))}{FLANGE}<transmission name="t"/></robot>'


@pytest.fixture
def arm(tmp_path):
    (tmp_path / "arm.urdf").write_text(ARM)
    return tmp_path / "arm.urdf"


def matrix(xyz, rotation):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation.as_matrix(), xyz
    return T


def places(q):
    """The frames (4, 4) of the links at joint coordinates, as the definition of URDF has them."""
    value = dict(zip((link[0] for link in MOVING), q, strict=True))
    found = {"base": np.eye(4)}
    for name, kind, parent, xyz, rpy, axis, *_ in LINKS:
        e = np.zeros(3) if axis is None else np.array(axis) / np.linalg.norm(axis)
        x = value.get(name, 0.0)
        slides = kind == "prismatic"
        moved = matrix(x * e * slides, Rotation.from_rotvec(x * e * (not slides)))
        found[name] = found[parent] @ matrix(xyz, Rotation.from_euler("xyz", rpy)) @ moved
    return found


def torques(path, t):
    """Virtual work of inertia and weight in each joint coordinate, all derivatives by differences."""
    h = 1e-4

    def state(q, link):
        T, (mass, centre, turned, moments) = places(q)[link[0]], link[6:]
        R = T[:3, :3] @ Rotation.from_euler("xyz", turned).as_matrix()
        return T[:3, 3] + T[:3, :3] @ np.array(centre), R, mass, np.diag(moments)

    def spin(a, b):
        return Rotation.from_matrix(b @ a.T).as_rotvec()

    def moment(s, link):
        before, now, after = (state(path(s + k * h), link) for k in (-0.5, 0, 0.5))
        return now[1] @ now[3] @ now[1].T @ spin(before[1], after[1]) / h

    found = np.zeros(len(path(t)))
    for link in LINKS:
        r = [state(path(t + k * h), link)[0] for k in (-1, 0, 1)]
        force = link[6] * ((r[0] - 2 * r[1] + r[2]) / h**2 - GRAVITY)
        turn = (moment(t + h / 2, link) - moment(t - h / 2, link)) / h
        for i, e in enumerate(np.eye(len(found))):
            low, high = (state(path(t) + k * h * e, link) for k in (-0.5, 0.5))
            found[i] += (force @ (high[0] - low[0]) + turn @ spin(low[1], high[1])) / h
    return found


def test_torques_are_those_of_virtual_work(arm):
    """Second differences over 1e-4 s have a relative error of about 1e-7."""
    system = read_urdf(arm).with_(gravity=GRAVITY)
    assert system.order == ("shoulder", "upper", "slide", "hand")
    rng = np.random.default_rng(2)
    a, b, c = rng.uniform(-1, 1, (3, 4))
    names = [f"{link[0]}_joint" for link in MOVING]
    motion = {name: f"{x!r} + {y!r} * t + {z!r} * t^2" for name, x, y, z in zip(names, a, b, c, strict=True)}
    found = inverse_dynamics(system, {k: v.replace("np.float64", "") for k, v in motion.items()}, np.array([0.0, 0.3]))
    expected = torques(lambda t: a + b * t + c * t**2, 0.3)
    assert_close([found.force[name].ravel()[-1] for name in names], expected, 1e-6, scale=np.abs(expected).max())


def test_what_is_fixed_is_an_interface(arm):
    system = read_urdf(arm)
    assert system.bodies["hand"].interface_name == ("root", "flange")
    assert_close(system.bodies["hand"].interface_position[1], [0, 0, 0.3], 1e-15)
    assert system.bodies["upper"].m == 3.5
    assert [joint.range for joint in system.joints] == [None, (-2.0, 2.0), (-2.0, 2.0), (-2.0, 2.0)]
    assert system.notes == ("elements of the robot file that are left out: transmission",)


def test_a_free_base_falls(tmp_path):
    (tmp_path / "f.urdf").write_text(
        ARM.replace('<link name="base"/>', element(("base", *LINKS[0][1:])).split("<joint")[0])
    )
    system = read_urdf(tmp_path / "f.urdf", base="free")
    assert system.carrier("base").type == "free"
    assert sum(body.m for body in system.bodies.values()) == pytest.approx(14.5)


def test_joints_that_follow_others(arm):
    follow = '<mimic joint="upper_joint" multiplier="-2" offset="0.1"/></joint>'
    head, tail = arm.read_text().split('name="hand_joint"')
    arm.write_text(head + 'name="hand_joint"' + tail.replace("</joint>", follow, 1))
    system = read_urdf(arm).with_(gravity=GRAVITY)
    run = simulate(system, 0.3)
    assert_close(run.channels["hand_joint.angle"], 0.1 - 2 * run.channels["upper_joint.angle"], 1e-6, scale=1.0)


def pipeline(folder, more=""):
    body = uniform_beam(modes=2, truncation=("interfaces",))
    mp.write_body(body.with_(interface_name=("root", "slide_joint")), folder / "upper.h5")
    far = (*LINKS[:3], ("slide", "prismatic", "upper", (10.0, 0, 0), *LINKS[3][4:]), *LINKS[4:])
    (folder / "arm.urdf").write_text(f'<robot><link name="base"/>{"".join(map(element, far))}{FLANGE}</robot>')
    file = folder / "arm.toml"
    file.write_text(
        '[robot]\nfile = "arm.urdf"\n[bodies.upper]\nfile = "upper.h5"\n[environment]\ngravity = [0, 0, -9.81]\n'
        f"[simulation]\nt_end = 0.1\n{more}"
    )
    return file


def test_a_link_becomes_flexible(tmp_path):
    """The camera that is fixed to it is welded, as the flexible body has its own mass alone."""
    file = pipeline(tmp_path)
    with pytest.raises(mp.InputError, match="interface 'camera_joint' does not exist"):
        read_system(load(file), None, Reporter(quiet=True))
    text = (tmp_path / "arm.urdf").read_text()
    camera = element(LINKS[2])
    (tmp_path / "arm.urdf").write_text(text.replace(camera, ""))
    system = read_system(load(file), None, Reporter(quiet=True))
    assert {name: body.n for name, body in system.bodies.items()} == {"shoulder": 0, "upper": 8, "slide": 0, "hand": 0}
    assert main(["simulate", str(file)]) == 0
    plain = read_urdf(tmp_path / "arm.urdf", bodies={"upper": system.bodies["upper"]})
    for one, other in zip(plain.joints, system.joints, strict=True):
        assert one.moves_like(other)


def test_a_body_with_another_length_is_refused(tmp_path):
    file = pipeline(tmp_path)
    text = (tmp_path / "arm.urdf").read_text().replace(element(LINKS[2]), "").replace('"10.0 0.0 0.0"', '"9.0 0.0 0.0"')
    (tmp_path / "arm.urdf").write_text(text)
    with pytest.raises(mp.InputError, match=r"interface 'slide_joint' of link 'upper' is at \[9.0, 0.0, 0.0\]"):
        read_system(load(file), None, Reporter(quiet=True))


def test_own_keys_of_joints(arm, tmp_path):
    file = tmp_path / "arm.toml"
    file.write_text(
        '[robot]\nfile = "arm.urdf"\n[joints.upper_joint]\ndamping = 2.0\nlimits = { stiffness = 1e4, upper = 1.5 }\n'
        "[simulation]\nt_end = 0.1\n"
    )
    system = read_system(load(file), None, Reporter(quiet=True))
    (element,) = next(joint for joint in system.joints if joint.name == "upper_joint").elements
    assert (element.damping, element.lower, element.upper, element.limit_stiffness) == (2.0, -2.0, 1.5, 1e4)
    assert [joint.range for joint in system.joints] == [None, None, (-2.0, 2.0), (-2.0, 2.0)]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("<robot", "<sdf", "is no XML file"),
        ('<parent link="slide"/>', '<parent link="slid"/>', "parent link 'slid' does not exist; did you mean 'slide'"),
        ('type="prismatic"', 'type="prismatc"', "joint 'slide_joint': type 'prismatc' does not exist"),
        ('ixx="0.01"', 'ixx="1"', "the inertia of link '(hand|upper)' is physically impossible"),
        ('<mass value="2.0"/>', '<mass value="0"/>', "link 'slide' moves and has no mass"),
        ('<mass value="2.0"/>', '<mass value="two"/>', "<mass value='two'> needs 1 numbers"),
        ('<child link="hand"/>', '<child link="slide"/>', "have no parent, or others two"),
        ('link name="hand"', 'link name="slide"', "a link has no name of its own"),
    ],
)
def test_wrong_files_are_one_sentence(arm, old, new, said):
    content = arm.read_text()
    assert old in content
    arm.write_text(content.replace(old, new))
    with pytest.raises(mp.InputError, match=said) as error:
        read_urdf(arm)
    assert str(arm) in str(error.value)


def test_unknown_links_and_files(arm, tmp_path):
    with pytest.raises(mp.InputError, match="link 'upr' does not exist; did you mean 'upper'"):
        read_urdf(arm, bodies={"upr": uniform_beam(modes=1)})
    with pytest.raises(mp.InputError, match="no.urdf does not exist"):
        read_urdf(tmp_path / "no.urdf")


def test_what_is_written_as_urdf_is_read_back(arm):
    """A mimic, a quarter turn of pitch (where the angles of URDF are singular), a slide without range, ranges."""
    follow = '<mimic joint="upper_joint" multiplier="-2" offset="0.1"/></joint>'
    head, tail = arm.read_text().replace('rpy="0.2 -0.4 0.5"', f'rpy="0.2 {np.pi / 2} 0.5"').split('name="hand_joint"')
    arm.write_text(head + 'name="hand_joint"' + tail.replace("</joint>", follow, 1))
    system = read_urdf(arm)
    back = read_urdf(write_urdf(system, arm.with_name("back.urdf")))
    for one, other in zip(system.joints, back.joints, strict=True):
        assert (one.name, one.type, one.parent, one.child, one.range) == (
            other.name,
            other.type,
            *ends(other),
            other.range,
        )
        assert_close([*one.axis, *one.rotation.ravel()], [*other.axis, *other.rotation.ravel()], 1e-12, scale=1.0)
    for name, body in system.bodies.items():
        for key in ("m", "s0", "E0", "interface_position"):
            assert_close(getattr(back.bodies[name], key), getattr(body, key), 1e-12, scale=1.0)
        assert back.bodies[name].interface_name == body.interface_name
    assert back.closures[0].factors == {"hand_joint": 1.0, "upper_joint": 2.0}
    assert back.closures[0].value(0.0)[0] == 0.1


def ends(joint):
    return joint.parent, joint.child


def test_what_urdf_does_not_hold_is_told_or_refused(arm):
    system = read_urdf(arm).with_(gravity=GRAVITY)
    assert lost_in_urdf(system) == ["gravity of the system has no place in a URDF file"]
    ball = system.joints[0].with_(type="spherical", axis=(0, 0, 1.0))
    with pytest.raises(mp.InputError, match="a URDF file has no spherical joint"):
        write_urdf(system.with_(joints=(ball, *system.joints[1:])), arm)


def test_a_system_of_a_pipeline_file_is_written(arm, tmp_path, capsys):
    (tmp_path / "a.toml").write_text(
        '[robot]\nfile = "arm.urdf"\n[simulation]\nt_end = 0.1\n[environment]\ngravity = [0, 0, -9.81]\n'
    )
    assert main(["export", str(tmp_path / "a.toml"), "--to", "urdf", "-o", str(tmp_path / "b.urdf"), "--json"]) == 0
    assert "gravity of the system has no place in a URDF file" in capsys.readouterr().out
    assert read_urdf(tmp_path / "b.urdf").order == read_urdf(arm).order
    assert main(["export", str(arm), "--to", "urdf"]) == 2
    assert main(["export", str(tmp_path / "a.toml"), "--to", "urdf", "-o", str(arm)]) == 2
