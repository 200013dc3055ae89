"""The [analysis] of a pipeline file, theories and free flight of its [simulation], exports: what each key does."""

import csv
import json
import tomllib

import h5py
import numpy as np
import pytest
from multibody.single_bodies import particles
from multibody.trees import random_body
from scipy.io import loadmat

import modalprep as mp
from modalprep.cli import main
from modalprep.examples import uniform_beam
from modalprep.formats.resultfile import read_csv

SWING = """
[bodies.arm]
file = "arm.h5"

[joints.hinge]
type = "revolute"
child = "arm.root"
stiffness = 30
damping = 0.7
free_position = 0.2
"""
ANALYSIS = """
[environment]
gravity = [0, -10, 0]

[analysis]
inputs = ["hinge", "arm.tip.force.y"]
outputs = ["hinge.angle", "arm.tip.position.y"]
state_space = ["mat", "npz", "h5"]
response = { lowest = 0.1, highest = 10, points = 30 }

[analysis.inverse]
motion = { hinge = "0.5*(1 - cos(2*t))" }
t_end = 1
output_step = 0.25
"""
INERTIA = 0.1 + 2 * 0.25  # of 2 kg at 0.5 m about the hinge


@pytest.fixture
def folder(tmp_path):
    ends = {"root": np.zeros(3), "tip": np.array([1.0, 0, 0])}
    arm = mp.rigid_body("arm", mass=2.0, centre=np.array([0.5, 0, 0]), inertia=0.1 * np.eye(3), interfaces=ends)
    mp.write_body(arm, tmp_path / "arm.h5")
    mp.write_body(uniform_beam(modes=3), tmp_path / "beam.h5")
    return tmp_path


def job(folder, text, *command):
    (folder / "job.toml").write_text(text)
    return main([*command, str(folder / "job.toml")])


def angle_of(folder):
    return json.loads((folder / "output/job/job-analysis.json").read_text())["equilibrium"]["joints"]["hinge"][0]


@pytest.mark.parametrize("command", ["analyse", "run"])
def test_pendulum_with_a_spring(folder, charts, capsys, command):
    """Rest, frequency, damping, response, and torque in closed form."""
    assert job(folder, SWING + ANALYSIS, command) == 0
    said, files = capsys.readouterr().out, folder / "output/job"
    found = json.loads((files / "job-analysis.json").read_text())
    a = angle_of(folder)
    assert 30 * (a - 0.2) + 10 * np.cos(a) == pytest.approx(0, abs=1e-10)
    stiffness = 30 - 10 * np.sin(a)
    omega = np.sqrt(stiffness / INERTIA)
    assert found["equilibrium"]["stable"]
    assert found["modes"]["frequency_Hz"] == pytest.approx([omega / (2 * np.pi)], rel=1e-9)
    assert found["modes"]["damping_ratio"] == pytest.approx([0.7 / (2 * INERTIA * omega)], rel=1e-8)
    assert found["modes"]["moves_most"] == ["hinge"]
    assert "stable equilibrium" in said
    assert "Modes of the system" in said
    A = np.array([[0, 1], [-stiffness / INERTIA, -0.7 / INERTIA]])
    B = np.array([[0, 0], [1, np.cos(a)]]) / INERTIA
    mat = loadmat(files / "job-state-space.mat")
    with np.load(files / "job-state-space.npz") as npz, h5py.File(files / "job-state-space.h5") as h5:
        for file in (mat, npz, h5):
            np.testing.assert_allclose(file["A"][()] if file is h5 else file["A"], A, rtol=1e-9)
            np.testing.assert_allclose(file["B"][()] if file is h5 else file["B"], B, rtol=1e-9, atol=1e-12)
            assert np.shape(file["C"]) == np.shape(file["D"]) == (2, 2)
        assert [str(name[0]) for name in mat["outputs"].ravel()] == ["hinge.angle", "arm.tip.position.y"]
        assert list(npz["inputs"]) == ["hinge", "arm.tip.force.y"]
        assert h5["states"].asstr()[()].tolist() == ["hinge.angle", "hinge.rate"]
    with (files / "job-response.csv").open() as file:
        header, *rows = csv.reader(file)
    rows = np.array(rows, dtype=float)
    w = 2 * np.pi * rows[:, 0]
    place = header.index("arm.tip.position.y / hinge re")
    gain = np.cos(a) / (stiffness + 0.7j * w - INERTIA * w**2)
    np.testing.assert_allclose(rows[:, place] + 1j * rows[:, place + 1], gain, rtol=1e-8)
    assert (rows[0, 0], rows[-1, 0], len(rows)) == (0.1, 10, 30)
    run = mp.read_result(files / "job-inverse.h5")
    law = mp.multibody.TimeFunction("0.5*(1 - cos(2*t))")
    angle, rate, acceleration = np.array([law(t) for t in run.time]).T
    torque = INERTIA * acceleration + 0.7 * rate + 30 * (angle - 0.2) + 10 * np.cos(angle)
    np.testing.assert_allclose(run["hinge.drive"], torque, rtol=1e-10)
    np.testing.assert_allclose(read_csv(files / "job-inverse.csv")["hinge.drive"], torque, rtol=1e-9)
    assert all((files / f"job-{name}.png").stat().st_size > 10_000 for name in ("response", "inverse"))


def test_start_and_steady_are_other_states(folder):
    """About the start the spring alone counts; spinning, the beam is stiffer than at rest."""
    assert job(folder, SWING + '[analysis]\nabout = "start"\n', "analyse") == 0
    found = json.loads((folder / "output/job/job-analysis.json").read_text())
    assert "equilibrium" not in found
    assert found["modes"]["frequency_Hz"] == pytest.approx([np.sqrt(30 / INERTIA) / (2 * np.pi)], rel=1e-9)
    spin = '[bodies.b]\nfile = "beam.h5"\n[joints.hub]\ntype = "revolute"\nchild = "b.root"\nmotion = "6*t"\n'
    assert job(folder, f'{spin}[analysis]\nabout = "steady"\nmodes = 2\n', "analyse") == 0
    frequency = json.loads((folder / "output/job/job-analysis.json").read_text())["modes"]["frequency_Hz"]
    expected = mp.multibody.spin_modes(uniform_beam(modes=3), np.array([0, 0, 6.0])).frequency[:2]
    np.testing.assert_allclose(frequency, expected, rtol=1e-9)  # two are listed


def test_rest_on_a_turning_hub_and_at_another_time(folder):
    """``k (a - a0) = -w^2 m c sin a (r + c cos a)``; then a torque of its time."""
    hub = '[bodies.hub]\nfile = "arm.h5"\n[joints.hub]\ntype = "revolute"\nchild = "hub.root"\naxis = [0, 1, 0]\n'
    arm = SWING.replace('child = "arm.root"', 'child = "arm.root"\nparent = "hub.tip"')
    assert job(folder, hub + 'motion = "3*t"\n' + arm + '[analysis]\nabout = "steady"\n', "analyse") == 0
    a = angle_of(folder)
    assert 30 * (a - 0.2) == pytest.approx(-9 * 2 * 0.5 * np.sin(a) * (1 + 0.5 * np.cos(a)), rel=1e-9)
    assert job(folder, SWING + 'torque = "5*t"\n[analysis]\ntime = 0.4\n', "analyse") == 0
    assert angle_of(folder) == pytest.approx(0.2 + 2 / 30, rel=1e-9)


LOOP = """
[bodies.crank]
file = "arm.h5"
[bodies.coupler]
file = "arm.h5"
[bodies.rocker]
file = "arm.h5"

[joints.hinge]
type = "revolute"
child = "crank.root"
stiffness = 90
keep_start = true
start = { angle = 0.4 }
[joints.b]
type = "revolute"
parent = "crank.tip"
child = "coupler.root"
start = { angle = -0.4 }
[joints.c]
type = "revolute"
child = "rocker.root"
position = [1, 0, 0]
start = { angle = 0.4 }

[closures.pin]
type = "revolute"
a = "rocker.tip"
b = "coupler.tip"

[environment]
gravity = [0, -10, 0]

[analysis]
"""


def test_parallelogram_of_a_pipeline_file(folder):
    """Two cranks of 0.6 kg m^2 and a coupler of 2 kg that only translates; weights of 40 N m at angle 0."""
    assert job(folder, LOOP, "analyse") == 0
    found = json.loads((folder / "output/job/job-analysis.json").read_text())
    a = angle_of(folder)
    assert 90 * a + 40 * np.cos(a) == pytest.approx(0, abs=1e-9)
    frequency = np.sqrt((90 - 40 * np.sin(a)) / (2 * INERTIA + 2)) / (2 * np.pi)
    assert found["modes"]["frequency_Hz"] == pytest.approx([frequency], rel=1e-9)
    assert found["equilibrium"]["closures"]["pin.force"][1] == pytest.approx(-10 * np.cos(a), abs=1e-9)


def test_ruthless_theory_of_a_modal_analysis(folder):
    """About a steady spin the ruthless body keeps its frequencies; the conventional one is softer."""
    spin = '[bodies.b]\nfile = "beam.h5"\n[joints.hub]\ntype = "revolute"\nchild = "b.root"\nmotion = "2*t"\n'
    body, found = uniform_beam(modes=3), {}
    for theory in ("consistent", "no_geometric_stiffness", "ruthless"):
        assert job(folder, f'{spin}[analysis]\nabout = "steady"\ntheory = "{theory}"\n', "analyse") == 0
        found[theory] = json.loads((folder / "output/job/job-analysis.json").read_text())["modes"]["frequency_Hz"]
    np.testing.assert_allclose(found["ruthless"], body.frequency, rtol=1e-9)
    e = 2 / (2 * np.pi * body.frequency[0])
    lag = [found[theory][0] / body.frequency[0] - 1 for theory in ("consistent", "no_geometric_stiffness")]
    # 1 + .0967 e^2 and 1 - .5 e^2; e^4 is 0.08; three modes miss a little of the stiffening
    assert lag[0] == pytest.approx(0.0967 * e**2, rel=0.2)
    assert lag[1] == pytest.approx(np.sqrt(1 - e**2) - 1, rel=1e-2)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("[analysis]", '[analysis]\nabout = "rest"'), ["[analysis.about]", "'equilibrium', 'steady' or 'start'"]),
        (("[analysis]", "[analysis]\ntime = -1"), ["[analysis.time]", "greater than or equal to 0"]),
        (("[analysis]", "[analysis]\nmods = 3"), ["unknown key 'mods'", "did you mean 'modes'?"]),
        (('inputs = ["hinge", "arm.tip.force.y"]', ""), ["[analysis]", "a response needs both"]),
        (('"hinge", "arm.tip.force.y"', '"hingr"'), ["job.toml: input 'hingr': name a joint"]),
        (('"hinge.angle"', '"hinge.angel"'), ["output 'hinge.angel'", "did you mean 'angle'?"]),
        (('"npz"', '"csv"'), ["[analysis.state_space", "'mat', 'npz' or 'h5'"]),
        (("lowest = 0.1", "lowest = 20"), ["[analysis.response]", "lowest = 20 Hz must be below highest = 10 Hz"]),
        (("lowest = 0.1, ", ""), ["[analysis.response.lowest]", "required"]),
        (('hinge = "0.5', 'hing = "0.5'), ["joint 'hing' does not exist", "did you mean 'hinge'?"]),
        (('"0.5*(1 - cos(2*t))"', '["t", "t"]'), ["needs 1 functions of time, not 2"]),
        (('"0.5*(1 - cos(2*t))"', '"x"'), ["motion of joint 'hinge'", "unknown name x"]),
        (("t_end = 1", "t_end = 0"), ["[analysis.inverse.t_end]", "greater than 0"]),
        (("stiffness = 30\ndamping = 0.7\nfree_position = 0.2", 'torque = "20"'), ["no static equilibrium", "20"]),
    ],
)
def test_one_thing_wrong(folder, capsys, change, words):
    assert (SWING + ANALYSIS).count(change[0]) == 1
    code = job(folder, (SWING + ANALYSIS).replace(*change), "analyse")
    assert code == (1 if "equilibrium" in words[0] and "[" not in words[0] else 2)
    error = capsys.readouterr().err
    assert len(error.strip().splitlines()) == 1
    for word in words:
        assert word in error


def test_what_has_no_analysis(folder, capsys):
    assert job(folder, SWING + "[simulation]\nt_end = 1\n", "analyse") == 2
    assert "has no [analysis]: add one" in capsys.readouterr().err
    assert job(folder, SWING, "run") == 2
    assert "'joints' has no effect without 'simulation' or 'analysis'" in capsys.readouterr().err
    inverse = "[analysis.inverse]\nmotion = { hinge = 0.4 }\nmodes = 'quasi_static'\nt_end = 1\n"
    assert job(folder, LOOP + inverse, "analyse") == 2
    assert "'pin' closes a loop" in capsys.readouterr().err


def test_analysis_for_a_program(folder, capsys):
    assert job(folder, SWING + "[analysis]\n", "analyse", "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert found["equilibrium"]["stable"]
    assert found["files"] == [str(folder / "output/job/job-analysis.json")]


# ---- theories of a run ----

TURN = """
[bodies.b]
file = "beam.h5"
[joints.hub]
type = "revolute"
child = "b.root"
motion = "0.5*t**2"
[simulation]
t_end = 0.5
output_step = 0.1
rtol = 1e-9
method = "explicit"
"""


def test_theories_of_a_run(folder, capsys):
    """`theory`, the older key and the flag of the command line name the same three systems."""
    bodies = {"b": uniform_beam(modes=3)}
    hub = mp.Joint(
        name="hub", type="revolute", parent="ground", child="b", motion=mp.multibody.TimeFunction("0.5*t**2")
    )
    system = mp.System(bodies=bodies, joints=(hub,))
    expected = {
        name: mp.simulate(each, t_end=0.5, output_step=0.1, rtol=1e-9, method="explicit")["b.modal"]
        for name, each in (("consistent", system), ("no", system.conventional()), ("ruthless", system.ruthless()))
    }
    asked = {
        "": "consistent",
        'theory = "consistent"\n': "consistent",
        'theory = "no_geometric_stiffness"\n': "no",
        "geometric_stiffness = false\n": "no",
        'geometric_stiffness = false\ntheory = "ruthless"\n': "ruthless",
    }
    for keys, theory in asked.items():
        assert job(folder, TURN + keys, "simulate") == 0
        found = mp.read_result(folder / "output/job/job-run.h5")["b.modal"]
        np.testing.assert_allclose(found, expected[theory], rtol=1e-12, atol=1e-15)
    for keys, theory in (("", "no"), ('theory = "ruthless"\n', "ruthless")):
        assert job(folder, TURN + keys, "simulate", "--no-geometric-stiffness") == 0
        found = mp.read_result(folder / "output/job/job-run.h5")["b.modal"]
        np.testing.assert_allclose(found, expected[theory], rtol=1e-12, atol=1e-15)
    assert job(folder, TURN + 'theory = "ruthless"\ncompare_conventional = true\n', "simulate") == 0
    assert "linearised in the modes" in capsys.readouterr().out
    assert np.abs(expected["ruthless"] - expected["no"]).max() > 1e-6 * np.abs(expected["no"]).max()


def test_theories_that_contradict(folder, capsys):
    assert job(folder, TURN + 'theory = "consistent"\ngeometric_stiffness = false\n', "simulate") == 2
    assert "contradicts theory = 'consistent'" in capsys.readouterr().err
    assert job(folder, TURN + 'theory = "rutless"\n', "simulate") == 2
    assert "[simulation.theory]" in capsys.readouterr().err


# ---- free flight ----

FLIGHT = """
[bodies.a]
file = "cloud.h5"
[joints.flight]
type = "free"
child = "a.root"
position = [1, 2, 3]
rotation = { axis = [1, 2, 3], angle = "40 deg" }
start = { velocity = [0.3, -0.2, 0.5], angular_velocity = [0.6, -0.4, 0.8] }
[environment]
gravity = [0, -1, 2]
[simulation]
t_end = 2
output_step = 0.5
rtol = 1e-11
"""


def consistent(body):
    """The body with the frequencies of its stiffness, as files of bodies must have them."""
    return body.with_(frequency=np.sqrt(body.K) / (2 * np.pi))


def test_momenta_and_efficient_variables_fly_as_joints_do(folder, capsys):
    """A hub and particles on springs: the same motion from three sets of variables."""
    cloud = particles(np.random.default_rng(2)).with_(name="cloud")
    mp.write_body(consistent(cloud).with_(D=np.full(cloud.n, 0.3)), folder / "cloud.h5")
    found = {}
    for variables in ("joint", "momentum", "efficient"):
        assert job(folder, f'{FLIGHT}variables = "{variables}"\n[[plots]]\ny = "a.root.position"\n', "simulate") == 0
        found[variables] = mp.read_result(folder / "output/job/job-run.h5")
        assert found[variables].stats["energy_error"] < 1e-9
    assert f"{'efficient'} variables" in capsys.readouterr().out
    assert np.abs(found["joint"]["a.modal"]).max() > 1e-2
    for variables in ("momentum", "efficient"):
        assert found[variables].channels.keys() <= found["joint"].channels.keys()
        for name in found[variables].channels:
            exact = found["joint"][name]
            sign = np.sign(np.sum(exact * found[variables][name])) if name.endswith("orientation") else 1.0
            scale = max(np.abs(exact).max(), 1.0)
            np.testing.assert_allclose(sign * found[variables][name], exact, atol=1e-8 * scale, err_msg=name)


def test_interfaces_of_a_flexible_body_in_momenta(folder):
    """Random modes with geometric stiffness: where its interfaces go, second order of the deflection included."""
    mp.write_body(consistent(random_body(np.random.default_rng(0), 4)).with_(name="cloud"), folder / "cloud.h5")
    runs = []
    for variables in ("joint", "momentum"):
        assert job(folder, f'{FLIGHT}variables = "{variables}"\n', "simulate") == 0
        runs.append(mp.read_result(folder / "output/job/job-run.h5"))
    for name in ("a.a.position", "a.b.position", "a.modal"):
        np.testing.assert_allclose(runs[1][name], runs[0][name], atol=1e-7 * np.abs(runs[0][name]).max())


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("t_end = 2", 't_end = 2\nvariables = "momenta"'), "[simulation.variables]"),
        (("t_end = 2", 't_end = 2\nvariables = "momentum"\nmethod = "rosenbrock"'), "'method' has no effect"),
        (('type = "free"', 'type = "spherical"'), "joint 'flight' is spherical, not free"),
        (("[environment]", '[forces.f]\nat = "a.root"\nforce = [1, 0, 0]\n[environment]'), "here is a load"),
        (("[environment]", "[environment]\n"), "has geometric stiffness"),
        (("t_end = 2", 't_end = 2\ntheory = "ruthless"'), "modes do not represent a fraction"),
    ],
)
def test_flights_that_cannot_be(folder, capsys, change, words):
    mp.write_body(uniform_beam(modes=2), folder / "cloud.h5")
    text = (
        FLIGHT.replace("start = { velocity = [0.3, -0.2, 0.5], angular_velocity", "start = { angular_velocity")
        if "spherical" in words
        else FLIGHT
    )
    asked = "" if "variables" in change[1] else 'variables = "efficient"\n'
    assert job(folder, text.replace(*change) + asked, "simulate") == 2
    error = capsys.readouterr().err
    assert len(error.strip().splitlines()) == 1
    assert words in error


# ---- files of a run ----


def test_a_run_where_requested(folder):
    """HDF5 with all channels where -o says, CSV with those named beside it, plots of named channels."""
    text = SWING + '[simulation]\nt_end = 0.5\noutput = ["hinge.angle", "arm.tip.position"]\n'
    text += '[[plots]]\ny = ["hinge.angle", "hinge.rate"]\n[[plots]]\ny = "arm.tip.position.y"\n'
    target = folder / "there" / "run.h5"
    assert job(folder, text, "simulate", "-o", str(target)) == 0
    run, table = mp.read_result(target), read_csv(target.with_suffix(".csv"))
    assert set(table.channels) == {"hinge.angle", "arm.tip.position"}
    for name in table.channels:
        np.testing.assert_allclose(table[name], run[name], rtol=1e-9, atol=1e-300)
    assert "energy.error" in run.channels
    assert sorted(file.name for file in target.parent.glob("*.png")) == ["job-history-1.png", "job-history-2.png"]


def test_pandas_is_an_extra(project):
    extras = tomllib.loads((project / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    assert extras["dataframe"] == [name for name in extras["test"] if name.startswith("pandas")]


ROTOR = """
[bodies.disc]
mass = 10.0
inertia = [0.2, 0.15, 0.15]
interfaces = { hub = [0, 0, 0] }

[joints.flight]
type = "free"
child = "disc.hub"

[bushings.bearing]
between = ["ground", "disc.hub"]
stiffness = [0, 1e6, 8e5, 0, 0, 0]
damping = [0, 20, 20, 0, 0, 0]

[analysis]
modes = 0
about = "start"

[analysis.rotor.wheel]
joint = "flight"
axis = [1, 0, 0]
highest = "4000 rpm"
points = 5
modes = 4
"""


def test_a_campbell_diagram(tmp_path, capsys, charts):
    """The springs' axes stand still: critical speeds at ``sqrt(k / m)``, decrement ``pi c / sqrt(k m)``."""
    assert job(tmp_path, ROTOR, "analyse") == 0
    [folder] = (tmp_path / "output").iterdir()
    critical = json.loads((folder / "job-analysis.json").read_text())["rotors"]["wheel"]["critical_speeds"]
    found = sorted((each["rpm"], each["logarithmic_decrement"]) for each in critical if each["whirl"] == "planar")
    for (rpm, decrement), k in zip(found, (8e5, 1e6), strict=True):
        w = np.sqrt(k / 10 - 1.0)  # damped: (c / 2 m)^2 = 1
        assert (rpm, decrement) == pytest.approx((w * 30 / np.pi, 2 * np.pi / w), rel=1e-7)
    with (folder / "job-rotor-wheel.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert float(rows[-1]["rpm"]) == pytest.approx(4000.0)
    assert (folder / "job-rotor-wheel.png").stat().st_size > 1000
    assert "Critical speeds of rotor wheel" in capsys.readouterr().out


def test_a_response_to_unbalance(tmp_path, capsys):
    """``U W^2 / |k - m W^2 + i c W|`` of the stiffer support, at 4000 rpm."""
    text = f"{ROTOR}unbalance = {{ 'disc.hub' = [0, 1e-4, 0] }}\n"
    assert job(tmp_path, text, "analyse") == 0
    [folder] = (tmp_path / "output").iterdir()
    with (folder / "job-rotor-wheel-unbalance.csv").open() as file:
        last = list(csv.DictReader(file))[-1]
    w = 4000 * np.pi / 30
    y, z = (1e-4 * w**2 / abs(k - 10 * w**2 + 20j * w) for k in (1e6, 8e5))
    assert float(last["disc.hub major m"]) == pytest.approx(max(y, z), rel=1e-3)  # both lag alike but for the damping
    peaks = json.loads((folder / "job-analysis.json").read_text())["rotors"]["wheel"]["unbalance"]["disc.hub"]
    assert len(peaks) == 1
    assert "Response of rotor wheel to unbalance" in capsys.readouterr().out


def test_a_rotor_without_a_joint_is_refused(tmp_path, capsys):
    assert job(tmp_path, ROTOR.replace('joint = "flight"', 'joint = "fligth"'), "analyse") == 2
    assert "did you mean 'flight'" in capsys.readouterr().err
