"""MuJoCo files: the same arm as in URDF, torques and accelerations of MuJoCo itself, equalities, wrong files."""

import numpy as np
import pytest
from compare import assert_close
from scipy.spatial.transform import Rotation

import modalprep as mp
from modalprep.examples import uniform_beam
from modalprep.fe.readers.surface import read_surface
from modalprep.formats import read_mjcf, read_urdf, write_mjcf
from modalprep.formats.robots.mjcf_write import lost_in_mjcf
from modalprep.multibody import inverse_dynamics
from modalprep.multibody.analysis.inverse_dynamics import hinge_forces
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.load import load
from modalprep.pipeline.systems.read import read_system

ROUND_OFF = 1e-12  # of the largest value: about ten bodies in a row
# All that turns by scalars: springs with ref, armature, two and three hinges, slides with hinges, every shape.
ALL = """<mujoco><compiler angle="degree" eulerseq="zyx"/>
<option gravity="0.3 -0.5 -9.81"><flag contact="disable" limit="disable" frictionloss="disable"/></option>
<default><joint damping="0.3"/><geom density="500"/><default class="arm"><joint armature="0.05"/>
<geom type="capsule" size="0.03"/>
<default class="stiff"><joint stiffness="20" springref="10" ref="5"/></default></default></default>
<worldbody><geom type="plane" size="1 1 1"/><frame pos="0.1 0 0.5" euler="10 20 30">
<body name="a" pos="0 0.2 0" axisangle="0 1 1 40" childclass="arm"><joint name="ja" axis="0 1 1" pos="0.05 0 0.1"/>
<geom fromto="0 0 0 0.4 0.1 0"/><site name="tip" pos="0.4 0.1 0"/>
<body name="b" pos="0.4 0.1 0" xyaxes="0 1 0 -1 0 0.2">
<joint name="jb1" axis="0 1 0" class="stiff"/><joint name="jb2"/>
<geom type="box" size="0.2 0.05 0.03" pos="0.2 0 0" euler="0 0 15"/>
<frame pos="0 0 0.1"><geom type="cylinder" size="0.04 0.1" mass="0.7"/></frame>
<body name="c" pos="0.3 0 0" zaxis="1 0 1">
<joint name="jc1" axis="1 0 0"/><joint name="jc2" axis="0 1 0"/><joint name="jc3"/>
<geom type="ellipsoid" size="0.1 0.05 0.04" fromto="0 0 0 0 0.2 0.1"/>
<body name="d" pos="0 0.2 0"><joint name="jd1" type="slide" axis="1 0 1" armature="0"/><joint name="jd2" axis="1 0 1"/>
<inertial pos="0.01 0.02 0.1" mass="1.5" fullinertia="0.02 0.03 0.025 0.001 0.002 -0.003"/>
<body name="e" pos="0 0 0.2"><joint name="je1" type="slide" axis="1 0 0" armature="0"/>
<joint name="je2" type="slide" axis="0 1 0" armature="0"/><joint name="je3" axis="0 0 1" pos="0.1 0 0"/>
<geom type="sphere" size="0.06" pos="0.05 0 0"/></body></body></body></body></body></frame></worldbody></mujoco>"""
GROUPS = {"ja": [0], "b_joint": [1, 2], "c_joint": [3, 4, 5], "d_joint": [6, 7], "e_joint": [8, 9, 10]}
STARTS = {"cylindrical": lambda x: {"displacement": x[0], "angle": x[1]}, "revolute": lambda x: {"angle": x[0]}}
STARTS["planar"] = lambda x: {"displacement": x[:2], "angle": x[2]}
TURNING = """<mujoco><option gravity="0 0.2 -9.81"><flag contact="disable"/></option><worldbody>
<body name="hub" pos="0.1 0.2 0.3" quat="0.9 0.1 0.2 0.3"><freejoint/>
<geom type="box" size="0.2 0.1 0.1" pos="0.05 0 0"/>
<body name="arm" pos="0.2 0 0" euler="0 30 0"><joint name="ball" type="ball" pos="0 0 0.05" damping="0.4"/>
<geom type="capsule" fromto="0 0 0 0 0 0.5" size="0.03"/></body></body></worldbody></mujoco>"""


def mujoco_of(text):
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string(text)
    return mujoco, model, mujoco.MjData(model)


def written(folder, text, name="robot.xml"):
    (folder / name).write_text(text)
    return folder / name


def law(x, v, a):
    return f"{float(x)!r} + {float(v)!r} * t + {float(a) / 2!r} * t^2"


def test_torques_are_those_of_mujoco(tmp_path):
    mujoco, model, data = mujoco_of(ALL)
    x, v, a = np.random.default_rng(1).uniform(-1, 1, (3, model.nv))
    data.qpos[:], data.qvel[:], data.qacc[:] = x + model.qpos0, v, a
    mujoco.mj_inverse(model, data)
    system = read_mjcf(written(tmp_path, ALL))
    started = {name: x[own] for name, own in GROUPS.items()}
    joints = [
        j.with_(**STARTS.get(j.type, lambda x: {"angle": x})(started[j.name])) if j.name in started else j
        for j in system.joints
    ]
    motion = {name: [law(*each) for each in zip(x[own], v[own], a[own], strict=True)] for name, own in GROUPS.items()}
    found = inverse_dynamics(system.with_(joints=tuple(joints)), motion, np.array([0.0, 0.1]))
    forces = np.concatenate([found.force[name][0] for name in GROUPS])
    assert_close(forces, data.qfrc_inverse, ROUND_OFF, scale=np.abs(data.qfrc_inverse).max())


def test_free_and_ball_joints_accelerate_as_in_mujoco(tmp_path):
    """Speeds of a free root are there in its axes, in MuJoCo not; rotations of a ball there begin at the body's."""
    mujoco, model, data = mujoco_of(TURNING)
    rng = np.random.default_rng(3)
    data.qpos[:], data.qvel[:] = rng.uniform(-1, 1, model.nq), rng.uniform(-1, 1, model.nv)
    mujoco.mj_normalizeQuat(model, data.qpos)
    mujoco.mj_forward(model, data)
    turn = Rotation.from_quat(data.qpos[3:7], scalar_first=True).as_matrix()
    own = np.concatenate([turn.T @ data.qvel[:3], data.qvel[3:]])
    expected = data.qacc.copy()
    expected[:3] = turn.T @ data.qacc[:3] - np.cross(own[3:6], own[:3])
    system = read_mjcf(written(tmp_path, TURNING))
    ball = Rotation.from_euler("y", 30, degrees=True) * Rotation.from_quat(data.qpos[7:], scalar_first=True)
    y = np.concatenate([data.qpos[:7], ball.as_quat(scalar_first=True), own])
    missing = hinge_forces(system, y, expected)
    assert_close(missing, np.zeros(9), ROUND_OFF, scale=9.81 * model.body_mass.sum())


UNGEARED = ALL.replace(' armature="0.05"', "").replace(' armature="0"', "")  # a rotor is a body here


def test_what_is_written_is_the_same_model_for_mujoco(tmp_path):
    """Joints of one to three coordinates, springs, dampers, gravity: torques of MuJoCo for both files."""
    mujoco, *first = mujoco_of(UNGEARED)
    system = read_mjcf(written(tmp_path, UNGEARED))
    _, *second = mujoco_of(write_mjcf(system, tmp_path / "back.xml").read_text())
    x, v, a = np.random.default_rng(1).uniform(-1, 1, (3, first[0].nv))
    for model, data in (first, second):
        data.qpos[:], data.qvel[:], data.qacc[:] = x + model.qpos0, v, a
        mujoco.mj_inverse(model, data)
    torques = first[1].qfrc_inverse
    assert_close(second[1].qfrc_inverse, torques, ROUND_OFF, scale=np.abs(torques).max())


def test_what_is_written_is_read_back(tmp_path):
    """Trees, free and ball joints, sites, loops, a coupler; friction and a range; what has no place is told."""
    equality = """<equality><connect name="pin" site1="tip" site2="end"/>
    <joint name="gear" joint1="jd1" joint2="ja" polycoef="0.1 -2 0 0 0"/></equality></mujoco>"""
    site = '<site name="end" pos="0 0.1 0"/><body name="d"'
    text = UNGEARED.replace("</mujoco>", equality).replace('<body name="d"', site)
    text = text.replace('pos="0.05 0 0.1"/>', 'pos="0.05 0 0.1" range="-40 50" frictionloss="0.2"/>')
    for each in (text, TURNING):
        system = read_mjcf(written(tmp_path, each))
        back = read_mjcf(write_mjcf(system, tmp_path / "back.xml"))
        assert [(j.type, j.parent.partition(".")[0], j.child) for j in back.joints] == [
            (j.type, j.parent.partition(".")[0], j.child) for j in system.joints
        ]
        for one, other in zip(system.joints, back.joints, strict=True):
            assert_close([*one.axis, *one.rotation.ravel()], [*other.axis, *other.rotation.ravel()], 1e-12, scale=1.0)
            assert [vars(e) for e in one.elements] == [vars(e) for e in other.elements]
            assert one.range == other.range
        for name, body in system.bodies.items():
            for key in ("m", "s0", "E0"):
                assert_close(getattr(back.bodies[name], key), getattr(body, key), 1e-12, scale=1.0)
        assert np.array_equal(back.gravity, system.gravity)
    pin, gear = read_mjcf(write_mjcf(read_mjcf(written(tmp_path, text)), tmp_path / "back.xml")).closures
    assert pin.type == "spherical"
    assert gear.factors == {"d_joint.1": 1.0, "ja": 2.0}
    assert gear.value(0.0)[0] == 0.1


def test_what_mjcf_does_not_hold_is_told_or_refused(tmp_path):
    system = read_mjcf(written(tmp_path, TURNING))
    moved = system.joints[0].with_(angular_velocity=(0, 0, 1.0))
    assert lost_in_mjcf(system.with_(joints=(moved, *system.joints[1:]))) == [
        f"start values of joints {moved.name} have no place in an MJCF file"
    ]
    screw = system.joints[1].with_(type="screw", pitch=0.1, elements=())
    with pytest.raises(mp.InputError, match="an MJCF file has no screw joint"):
        write_mjcf(system.with_(joints=(system.joints[0], screw)), tmp_path / "x.xml")
    with pytest.raises(mp.InputError, match=r"an MJCF file ends in \.xml"):
        write_mjcf(system, tmp_path / "x.urdf")
    assert not (tmp_path / "x.xml").exists()


ARM = """<robot name="arm"><link name="base"/><link name="upper"><inertial><origin xyz="0.1 0 0.2" rpy="0.3 0.2 0.1"/>
<mass value="2"/><inertia ixx="0.02" iyy="0.03" izz="0.025" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="slider"><inertial><origin xyz="0 0.1 0"/><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0"
ixz="0" iyz="0"/></inertial></link>
<joint name="elbow" type="revolute"><parent link="base"/><child link="upper"/>
<origin xyz="0 0.1 0.2" rpy="0.4 0 0.2"/>
<axis xyz="0 1 0"/><limit lower="-1" upper="2"/><dynamics damping="0.5"/></joint>
<joint name="slide" type="prismatic"><parent link="upper"/><child link="slider"/><origin xyz="0.3 0 0"/>
<axis xyz="1 0 0"/><limit lower="-0.1" upper="0.2"/></joint></robot>"""
SAME = """<mujoco><compiler angle="radian" eulerseq="XYZ"/><worldbody>
<body name="upper" pos="0 0.1 0.2" euler="0.4 0 0.2">
<joint name="elbow" axis="0 1 0" range="-1 2" damping="0.5"/><inertial pos="0.1 0 0.2" euler="0.3 0.2 0.1" mass="2"
diaginertia="0.02 0.03 0.025"/><body name="slider" pos="0.3 0 0"><joint name="slide" type="slide" axis="1 0 0"
range="-0.1 0.2"/><inertial pos="0 0.1 0" mass="1" diaginertia="0.01 0.01 0.01"/></body></body></worldbody></mujoco>"""


def same(one, other):
    for a, b in zip(one.joints, other.joints, strict=True):
        assert (a.name, a.type, a.parent, a.child, a.range) == (b.name, b.type, b.parent, b.child, b.range)
        assert_close([*a.axis, *a.rotation.ravel()], [*b.axis, *b.rotation.ravel()], 1e-15, scale=1.0)
        assert [e.damping for e in a.elements] == [e.damping for e in b.elements]
    for name, body in one.bodies.items():
        assert_close(body.E0, other.bodies[name].E0, 1e-14)
        assert_close(body.s0, other.bodies[name].s0, 1e-14)


def test_the_same_arm_in_both_formats(tmp_path):
    same(read_urdf(written(tmp_path, ARM, "arm.urdf")), read_mjcf(written(tmp_path, SAME)))


def test_a_run_tells_when_a_joint_leaves_its_range(tmp_path):
    """Under its weight alone, along its axis, the slide moves by t^2."""
    text = SAME.replace('euler="0.4 0 0.2"', "").replace('damping="0.5"', "")
    system = read_mjcf(written(tmp_path, text)).with_(gravity=[2.0, 0, 0])
    elbow, slide = system.joints
    system = system.with_(joints=(elbow.with_(motion="0*t"), slide))
    run = mp.simulate(system, 1.0, rtol=1e-8)
    (note,) = [note for note in run.notes if "range" in note]
    assert note.startswith("joint 'slide' leaves its range of -0.1 to 0.2 m at t = 0.45 s, by up to 0.8 m at t = 1 s")
    driven = inverse_dynamics(read_mjcf(written(tmp_path, SAME)), {"elbow": "3*t"}, np.array([0.0, 1.0]))
    assert driven.notes[0].startswith("joint 'elbow' leaves its range of -1 to 2 rad at t = 1 s, by up to 1 rad")


LOOP = """<equality><connect name="pin" body1="slider" body2="world" anchor="0.1 0 0"/><weld name="glue" body1="upper"
body2="slider" active="false"/><joint name="gear" joint1="elbow" joint2="slide" polycoef="0 3 0 0 0"/></equality>"""


def test_equalities_close_loops(tmp_path):
    text = SAME.replace("</mujoco>", LOOP + "</mujoco>")
    system = read_mjcf(written(tmp_path, text))
    pin, gear = system.closures
    assert (pin.type, pin.a, pin.b, gear.factors) == (
        "spherical",
        "slider.pin_a",
        "ground",
        {"elbow": 1.0, "slide": -3.0},
    )
    turn = Rotation.from_euler("xyz", [0.4, 0, 0.2]).as_matrix()
    assert_close(pin.position, np.array([0, 0.1, 0.2]) + turn @ [0.4, 0, 0], 1e-14)
    assert "equality 'glue' (weld) is left out" in system.notes


def test_a_body_of_a_pipeline_file_becomes_flexible(tmp_path):
    """Gravity is that of the robot file; the flexible body has the interface of the slide at its place."""
    beam = uniform_beam(modes=2, truncation=("interfaces",)).with_(interface_name=("root", "slide"))
    mp.write_body(beam, tmp_path / "upper.h5")
    written(tmp_path, SAME.replace('pos="0.3 0 0"', 'pos="10 0 0"'))
    file = written(
        tmp_path,
        '[robot]\nfile = "robot.xml"\n[bodies.upper]\nfile = "upper.h5"\n[simulation]\nt_end = 0.1\n',
        "arm.toml",
    )
    system = read_system(load(file), None, Reporter(quiet=True))
    assert ({name: body.n for name, body in system.bodies.items()}, system.gravity[2]) == (
        {"upper": 8, "slider": 0},
        -9.81,
    )


def test_surfaces_are_drawn(tmp_path):
    """A tetrahedron in mm, moved with its geom; a file of another kind is told."""
    (tmp_path / "m").mkdir()
    (tmp_path / "m" / "t.obj").write_text(
        "v 0 0 0\nv 100 0 0\nv 0 100 0\nv 0 0 100\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    )
    (tmp_path / "m" / "u.ply").write_text("ply")
    meshes = '<asset><mesh file="t.obj" scale="0.001 0.001 0.001"/><mesh name="u" file="u.ply"/></asset>'
    seen = 'type="mesh" contype="0" conaffinity="0"'
    shapes = f'<geom {seen} mesh="t" pos="0 0 1"/><geom {seen} mesh="u"/>'
    text = SAME.replace("<worldbody>", meshes + "<worldbody>").replace("<inertial", shapes + "<inertial", 1)
    path = written(tmp_path, text.replace('angle="radian"', 'angle="radian" meshdir="m"'))
    system = read_mjcf(path)
    body = system.bodies["upper"]
    assert_close(body.points[-4:], np.array([[0, 0, 1], [0.1, 0, 1], [0, 0.1, 1], [0, 0, 1.1]]), 1e-15)
    assert len(body.cells["triangle"]) == 4
    assert any("neither STL, OBJ nor DAE are left out: u.ply" in note for note in system.notes)
    assert not read_mjcf(path, pictures=False).bodies["upper"].cells


DAE = """<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema"><asset><unit meter="0.001"/></asset>
<library_geometries><geometry id="g"><mesh><source id="s"><float_array>0 0 0 1 0 0 1 1 0 0 1 0</float_array></source>
<vertices id="v"><input semantic="POSITION" source="#s"/></vertices>
<polylist count="1"><input semantic="NORMAL" offset="1"
source="#n"/><input semantic="VERTEX" source="#v" offset="0"/><vcount>4</vcount><p>0 9 1 9 2 9 3 9</p></polylist>
</mesh></geometry></library_geometries><library_visual_scenes><visual_scene><node><translate>0 0 5</translate>
<node><rotate>0 0 1 90</rotate><scale>2 2 2</scale><instance_geometry url="#g"/></node></node></visual_scene>
</library_visual_scenes></COLLADA>"""


def test_collada_files_are_drawn(tmp_path):
    """A square of a millimetre, doubled, turned about z, and lifted by the node around it: two triangles."""
    points, triangles = read_surface(written(tmp_path, DAE, "a.dae"))
    assert_close(points, 1e-3 * np.array([[0, 0, 5], [0, 2, 5], [-2, 2, 5], [-2, 0, 5]]), 1e-14)
    assert triangles.tolist() == [[0, 1, 2], [0, 2, 3]]
    with pytest.raises(mp.InputError, match="has no triangles"):
        read_surface(written(tmp_path, DAE.replace("#g", "#h"), "b.dae"))
    with pytest.raises(mp.InputError, match="cannot be read"):
        read_surface(written(tmp_path, DAE.replace("<p>0 9", "<p>x"), "c.dae"))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("</worldbody>", "", "is no XML file"),
        ("<compiler ", '<compiler settotalmass="3" ', "<compiler settotalmass='3'> is not read"),
        ("<worldbody>", '<worldbody><replicate count="2"/>', "<replicate> is not read; write the compiled model"),
        ('mass="2"', 'mass="0"', "link 'upper' moves and has no mass"),
        (
            'diaginertia="0.01 0.01 0.01"',
            'diaginertia="0.01 0.01 1"',
            "inertia of link 'slider' is physically impossible",
        ),
        ('damping="0.5"', 'damping="0.5 2"', "only its first number can be other than 0"),
        ('damping="0.5"', 'class="stif"', "the file has no defaults of this class"),
        (
            '<joint name="slide" type="slide"',
            '<joint type="slide"/><joint name="slide" type="slide"',
            "together are no joint",
        ),
        ('axis="0 1 0"', 'axis="0 0 0"', "has an axis of length 0"),
        ('name="slider"', 'name="upper"', "two bodies or sites are called 'upper'"),
        ("<worldbody>", '<include file="no.xml"/><worldbody>', "no.xml does not exist"),
    ],
)
def test_wrong_files_are_one_sentence(tmp_path, old, new, said):
    assert old in SAME
    path = written(tmp_path, SAME.replace(old, new, 1))
    with pytest.raises(mp.InputError, match=said) as error:
        read_mjcf(path)
    assert str(path) in str(error.value)


def test_a_mesh_without_inertial_is_refused(tmp_path):
    text = SAME.replace(
        '<inertial pos="0 0.1 0" mass="1" diaginertia="0.01 0.01 0.01"/>', '<geom type="mesh" mesh="t"/>'
    )
    with pytest.raises(mp.InputError, match="the mass of geom 't' is that of a mesh"):
        read_mjcf(written(tmp_path, text))
