"""Joints and loads in pipeline files: what each key becomes, and what is said of wrong ones."""

import math

import numpy as np
import pytest

import modalprep as mp
from modalprep.cli import main
from modalprep.multibody.elements.hinge import CONSTANTS
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.load import load
from modalprep.pipeline.schema.pipeline import Pipeline
from modalprep.pipeline.systems.read import read_system
from modalprep.pipeline.systems.systems import simulate_pipeline

FILE = """
[bodies.a]
file = "arm.h5"
[bodies.b]
file = "arm.h5"

[joints.hinge]
type = "revolute"
child = "a.root"
stiffness = 4
free_position = "90 deg"
damping = 0.1
friction = { coulomb = 2, transition_velocity = 0.01 }
limits = { upper = "120 deg", stiffness = 100, damping = 0.3 }
torque = "5*t"

[joints.slide]
type = "cylindrical"
parent = "a.tip"
child = "b.root"
start = { angle = "30 deg", speed = 0.2 }
stiffness = [1, 2]
friction = [0.5, { coulomb = 0 }]
force = { t = [0, 1, 1, 2], values = [1, 1, 3, 3] }
torque = [{ value = "t", until = 1 }, { value = 1 }]

[forces.push]
at = "b.tip"
force = [1, "sin(t)", { file = "thrust.csv" }]
torque = [0, 0, 2]
axes = "body"

[forces.gust]
body = "a"
box = [[2, -1, -1], [0.5, 1, 1]]
force = [0, 6, 0]
factor = "t**2"

[springs.stay]
between = ["ground", "b.tip"]
stiffness = 3
free_length = 0.5
position = [1, 2, 3]
actuator_force = 7

[bushings.mount]
between = ["a.tip", "b.tip"]
stiffness = [1, 2, 3, 4, 5, 6]
free_rotation = { axis = [0, 0, 1], angle = "90 deg" }

[environment]
gravity = { mu = 2.0, centre = [0, 0, -9] }

[simulation]
t_end = 0.02
"""


@pytest.fixture
def folder(tmp_path):
    ends = {"root": np.zeros(3), "tip": np.array([1.0, 0, 0])}
    arm = mp.rigid_body("arm", mass=2.0, centre=np.array([0.5, 0, 0]), inertia=0.1 * np.eye(3), interfaces=ends)
    mp.write_body(arm, tmp_path / "arm.h5")
    (tmp_path / "thrust.csv").write_text("t, value\n0, 1\n1, 2\n2, 5\n")
    (tmp_path / "job.toml").write_text(FILE)
    return tmp_path


@pytest.fixture
def system(folder):
    path = folder / "job.toml"
    return read_system(load(path), None, Reporter(quiet=True))


def test_hinge_elements(system):
    (hinge,) = system.joints[0].elements
    constants = [getattr(hinge, name) for name in CONSTANTS]
    assert constants == [4, math.pi / 2, 0.1, 2, 0.01, -math.inf, math.radians(120), 100, 0.3]
    assert hinge.drive(2.0) == (10, 5, 0)
    travel, turn = system.joints[1].elements
    assert (travel.stiffness, turn.stiffness, travel.friction, turn.friction) == (1, 2, 0.5, 0)
    assert (travel.drive(0.5)[0], travel.drive(1.5)[0]) == (1, 3)
    assert (turn.drive(0.5)[0], turn.drive(1.5)[0]) == (0.5, 1)
    assert system.joints[1].angle == pytest.approx(math.pi / 6)
    assert system.joints[1].speed == 0.2


def test_loads(system):
    push, gust, stay, mount, planet = system.loads
    assert [f(1.0)[0] for f in (*push.force, *push.torque)] == pytest.approx([1, math.sin(1), 2, 0, 0, 2])
    assert (push.at, push.axes) == ("b.tip", "body")
    np.testing.assert_array_equal(gust.force, [[0, 0, 0], [0, 6, 0]])  # of the two points only the tip is in the box
    assert gust.factor(3.0)[0] == 9
    assert (stay.between, stay.stiffness, stay.free_length, stay.actuator_force(0.0)[0]) == (
        ("ground", "b.tip"),
        3,
        0.5,
        7,
    )
    np.testing.assert_array_equal(stay.position, [1, 2, 3])
    np.testing.assert_array_equal(mount.stiffness, np.arange(1, 7))
    np.testing.assert_allclose(mount.free_rotation @ [1, 0, 0], [0, 1, 0], atol=1e-15)
    assert planet.mu == 2
    np.testing.assert_array_equal(planet.centre, [0, 0, -9])
    np.testing.assert_array_equal(system.gravity, np.zeros(3))


def test_points_share_a_force(folder):
    path = folder / "job.toml"
    path.write_text(FILE.replace("box = [[2, -1, -1], [0.5, 1, 1]]", ""))
    gust = read_system(load(path), None, Reporter(quiet=True)).loads[1]
    np.testing.assert_array_equal(gust.force, [[0, 3, 0], [0, 3, 0]])


def test_it_runs(folder):
    assert main(["simulate", str(folder / "job.toml")]) == 0
    assert mp.read_result(folder / "output/job/job-run.h5").stats["energy_error"] < 1e-5


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("stiffness = 4", "stifness = 4"), ["line 10", "[joints.hinge]", "unknown key 'stifness'", "did you mean"]),
        (("stiffness = 4", "stiffness = -4"), ["line 10", "[joints.hinge.stiffness]", "greater than or equal to 0"]),
        (("stiffness = 4", "stiffness = [4, 5]"), ["joint 'hinge'", "stiffness has 2 value(s)", "1 coordinate"]),
        (("stiffness = [1, 2]", "stiffness = 1"), ["joint 'slide'", "stiffness has 1 value(s)", "2 coordinate"]),
        (("stiffness = [1, 2]", "stiffness = []"), ["joint 'slide'", "stiffness has 0 value(s)"]),
        (('torque = "5*t"', 'force = "5*t"'), ["joint 'hinge'", "'revolute' does not slide; give torque"]),
        (('torque = "5*t"', 'motion = "5*t"'), ["joint 'hinge'", "its motion is prescribed"]),
        (('torque = "5*t"', 'torque = "5*x"'), ["joint 'hinge'", "unknown name x"]),
        (('torque = "5*t"', 'torque = "sqrt(t)"'), ["joint 'hinge': drive", "no finite value", "t = 0 s"]),
        (('"120 deg"', '"120 degrees"'), ["[joints.hinge.limits", "90 deg"]),
        (("values = [1, 1, 3, 3]", "values = [1, 1, 3]"), ["joint 'slide'", "4 times and 3 values"]),
        (("t = [0, 1, 1, 2], ", ""), ["both 't' and 'values'"]),
        (
            ("values = [1, 1, 3, 3] }", "values = [1, 1, 3, 3] }\nmotion = 1"),
            ["joint 'slide'", "motion has 1 value(s)", "2 coordinate"],
        ),
        (('at = "b.tip"', 'at = "b.top"'), ["force 'push'", "'b.top' names no interface", "did you mean 'tip'?"]),
        (('at = "b.tip"', ""), ["[forces.push]", "needs either 'at' or 'body'"]),
        (('"thrust.csv"', '"trust.csv"'), ["force 'push'", "trust.csv does not exist"]),
        (('axes = "body"', 'axes = "bdy"'), ["[forces.push.axes]", "'inertial' or 'body'"]),
        (('body = "a"', 'body = "c"'), ["force 'gust'", "body 'c' does not exist", "known are a, b"]),
        (("[2, -1, -1]", "[9, -1, -1]"), []),
        (("[0.5, 1, 1]", "[1.5, 1, 1]"), ["force 'gust'", "no point of body 'a' lies in the box"]),
        (("force = [0, 6, 0]", 'force = [0, "t", 0]'), ["[forces.gust]", "give its time dependence by 'factor'"]),
        (('["ground", "b.tip"]', '["ground", "ground"]'), ["spring 'stay'", "name two different ends"]),
        (('["ground", "b.tip"]', '["ground", "d.tip"]'), ["spring 'stay'", "body 'd' does not exist"]),
        (("[1, 2, 3, 4, 5, 6]", "[1, 2, 3]"), ["[bushings.mount.stiffness]", "at least 6 items"]),
        (("mu = 2.0", "mu = 0"), ["[environment.gravity", "greater than 0"]),
        (("{ mu = 2.0, centre = [0, 0, -9] }", "[0, -9.81]"), ["[environment.gravity", "at least 3 items"]),
        (("[springs.stay]", "[spring.stay]"), ["unknown key 'spring'", "did you mean 'springs'?"]),
    ],
)
def test_one_thing_wrong(folder, capsys, change, words):
    assert FILE.count(change[0]) == 1 or change[0].startswith('["ground') or change[0] == '"thrust.csv"'
    (folder / "job.toml").write_text(FILE.replace(*change))
    code = main(["simulate", str(folder / "job.toml")])
    if not words:  # a box by any two opposite corners
        assert code == 0
        return
    assert code == 2
    error = capsys.readouterr().err
    assert len(error.strip().splitlines()) == 1
    for word in words:
        assert word in error


@pytest.mark.parametrize("text", ["1, 2, 3\n", "0, a\n", "", "t, value\n"])
def test_a_table_that_is_none(folder, capsys, text):
    (folder / "thrust.csv").write_text(text)
    assert main(["simulate", str(folder / "job.toml")]) == 2
    assert "force 'push'" in capsys.readouterr().err


def test_schema_describes_every_key_of_a_system():
    definitions = Pipeline.model_json_schema()["$defs"]
    for table in ("JointTable", "ForceTable", "AxialSpringTable", "BushingTable", "CentralTable", "LimitsTable"):
        missing = [
            key
            for key, value in definitions[table]["properties"].items()
            if not value.get("description") and key not in ("type", "rotation", "start")
        ]
        assert not missing, table


PULSE = """
[bodies.arm]
mass = 1.0
centre = [0, 0, 0]
inertia = [1, 1, 1]
interfaces = { root = [0, 0, 0] }

[joints.hinge]
type = "revolute"
child = "arm.root"
start = { rate = 1.0 }
torque = "1000*exp(-((t - 5.0037)/0.01)**2)"

[simulation]
t_end = 10.0
"""


def run_of(tmp_path, text):
    path = tmp_path / "pulse.toml"
    path.write_text(text)
    (run,) = simulate_pipeline(path, None, Reporter(quiet=True)).runs.values()
    return run


def test_a_pulse_in_a_file_is_not_stepped_over(tmp_path):
    """The rate gains 1000 sqrt(pi) 0.01, and the page says what else might be missed."""
    run = run_of(tmp_path, PULSE)
    assert run["hinge.rate"][-1] == pytest.approx(1 + 10 * math.pi**0.5, rel=1e-4)  # 10 times rtol
    assert run.notes[0].startswith("features of t shorter than 0.001 s may be missed in 'hinge'")
    run = run_of(tmp_path, PULSE + 'shortest_event = "5 ms"\nmax_step = 0.1\n')
    assert run["hinge.rate"][-1] == pytest.approx(1 + 10 * math.pi**0.5, rel=1e-4)
    assert not run.notes
    assert run.stats["steps"] >= 100


@pytest.mark.parametrize(("how", "most"), [("", 10.0), (", smooth = true", 10.0), (", spline = true", 255.05)])
def test_points_in_a_file_are_joined_as_it_says(tmp_path, how, most):
    """A trapezoid; the spline through it is SciPy's."""
    table = "{ t = [0, 1, 1.01, 2, 2.01, 10], values = [0, 0, 10, 10, 0, 0]" + how + " }"
    path = tmp_path / "pulse.toml"
    path.write_text(PULSE.replace('"1000*exp(-((t - 5.0037)/0.01)**2)"', table))
    torque = read_system(load(path), None, Reporter(quiet=True)).joints[0].elements[0].drive
    assert max(torque(t)[0] for t in np.linspace(0, 10, 20001)) == pytest.approx(most, rel=1e-3)
