"""Notches, [srs] and [fatigue] of a pipeline file: their files, the page and JSON agree with the Python functions."""

import csv
import json

import numpy as np
import pytest
from toml_beams import RECTANGLE, TIP

import modalprep as mp
from modalprep.cli import main
from modalprep.response import SNCurve, harmonic_response, rainflow_damage, shock_spectrum, transient_response

G = 9.80665
TOML = (
    RECTANGLE
    + TIP
    + """
[recovery.beam]
kind = "section_force"
stations = 2

[reduction]
modes = 4
damping = 0.02

[output]
pictures = "none"

[response.sine]
kind = "harmonic"
lowest = "0.5 Hz"
highest = "20 Hz"
points = 50
base.z = "1 g"

[[response.sine.notch]]
channel = "base.force.z"
factor = 1.2
break_frequency = "1 Hz"
max_depth = 40

[[response.sine.notch]]
channel = "tip.acceleration.z"
limit = "2 g"
max_depth = 40

[response.noise]
kind = "random"
channels = ["tip.acceleration"]
base.z = {{ frequency = [0.2, 2, 50], values = ["0.01 g^2/Hz", "0.01 g^2/Hz", "-3 dB/oct"] }}

[[response.noise.notch]]
channel = "base.force.z"
design_acceleration = "0.5 g"
max_depth = 60

[response.drop]
kind = "transient"
channels = ["tip.acceleration", "beam"]
duration = 3.0
step = 1e-3
base.z = {{ t = [0, 0.05, 0.1], values = [0, "5 g", 0] }}

[srs.tip]
response = "drop"
channels = ["tip.acceleration.z"]
lowest = "1 Hz"
highest = "50 Hz"
points = 20

[fatigue.root]
response = "drop"
channels = ["beam.1.start.My"]
scale = 500  # 1/m^3
stress = "50 MPa"
cycles = 1e6
slope = 5
repeats = 100

[fatigue.shaken]
response = "noise"
channels = ["tip.acceleration.z"]
stress = "10 m/s^2"
cycles = 1e6
slope = 4
duration = "1 h"
"""
)
RUN = """
[joints.hinge]
type = "revolute"
child = "beam.root"
axis = [0, 1, 0]

[simulation]
t_end = 0.4
output_step = 0.004

[environment]
gravity = [0, 0, -9.81]

[srs.tip]
channels = ["beam.tip.acceleration.z"]
lowest = "1 Hz"
highest = "20 Hz"
points = 5

[fatigue.root]
channels = ["beam.recovery.beam.1.start.My"]
stress = "10 MPa"
cycles = 1e6
slope = 5
scale = 500
"""


@pytest.fixture
def job(project, tmp_path):
    def write(text=TOML, old="", new=""):
        text = text.format(mesh=project / "meshes" / "beam.msh")
        assert old in text
        (tmp_path / "job.toml").write_text(text.replace(old, new))
        return tmp_path / "job.toml"

    return write


def columns(path):
    with path.open() as file:
        heads, *rows = csv.reader(file)
    return dict(zip(heads, np.array(rows, dtype=float).T, strict=True))


def test_all_of_it(job, tmp_path, capsys):
    assert main(["run", str(job()), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    made = tmp_path / "output" / "job"
    body = mp.read_body(made / "job.h5")

    given = harmonic_response(body, {"base.z": G}, np.geomspace(0.5, 20, 50))
    f = given.axis
    force, tip = (np.abs(given[name]) for name in ("base.force.z", "tip.acceleration.z"))
    limits = 1.2 * body.m * G * np.minimum(1, 1 / f), np.full(len(f), 2 * G)
    expected = G * np.minimum(1, np.minimum(limits[0] / force, limits[1] / tip))
    cut, curves = columns(made / "job-sine-notched.csv"), columns(made / "job-sine-response.csv")
    np.testing.assert_allclose(cut["notched"], expected, rtol=1e-9)  # ten digits
    np.testing.assert_allclose(curves["base.force.z (N)"], force * expected / G, rtol=2e-9)
    at = cut["notched"] < cut["given"]
    ratio = np.maximum(curves["base.force.z (N)"] / limits[0], curves["tip.acceleration.z (m/s^2)"] / limits[1])
    assert abs(ratio[at] - 1).max() < 2e-9
    assert ratio.max() < 1 + 2e-9
    notches = said["responses"]["sine"]["notches"]
    assert {n["reason"] for n in notches} == {"base.force.z (semi-empirical)", "tip.acceleration.z (limit)"}

    rms = {row["channel"]: row for row in said["responses"]["noise"]["peaks"]}["base.force.z"]["three_sigma"]
    assert rms == pytest.approx(0.5 * body.m * G, rel=2e-3)  # the cut level was found on another grid of frequencies
    assert {n["reason"] for n in said["responses"]["noise"]["notches"]} == {"base.force.z (quasi-static)"}

    history = mp.response.History(time=np.array([0, 0.05, 0.1]), value=np.array([0, 5 * G, 0]))
    drop = transient_response(body, {"base.z": history}, duration=3.0, step=1e-3)
    srs = shock_spectrum(drop.axis, drop["tip.acceleration.z"], np.geomspace(1, 50, 20))
    np.testing.assert_allclose(columns(made / "job-tip-srs.csv")["tip.acceleration.z maximax"], srs.maximax, rtol=1e-9)
    assert said["srs"]["tip"]["tip.acceleration.z"]["maximax"] == pytest.approx(srs.maximax.max(), rel=1e-9)
    curve = SNCurve(stress=50e6, cycles=1e6, slope=5)
    once = rainflow_damage(drop.axis, 500 * drop["beam.1.start.My"], curve)
    assert said["fatigue"]["root"]["beam.1.start.My"]["damage"] == pytest.approx(100 * once.damage, rel=1e-9)
    assert said["fatigue"]["shaken"]["tip.acceleration.z"]["method"] == "dirlik"
    page = (made / "job.html").read_text()
    for words in (
        "Notches: the input is lowered",
        "base.force.z (semi-empirical)",
        "Shock spectrum tip",
        "Fatigue root",
    ):
        assert words in page


def test_a_notch_that_may_not_be_deep_enough_is_warned_of(job, tmp_path, capsys):
    """With 14 dB, the default, the tip exceeds its 2 g; page, terminal and JSON say by how much."""
    assert main(["run", str(job(old='limit = "2 g"\nmax_depth = 40\n', new='limit = "2 g"\n')), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    words = "tip.acceleration.z (limit) is exceeded by "
    assert any(note.startswith(words) and "max_depth" in note for note in said["responses"]["sine"]["notes"])
    deepest = max(said["responses"]["sine"]["notches"], key=lambda n: n["depth"] if "tip" in n["reason"] else 0)
    assert deepest["depth"] == pytest.approx(14.0)
    assert deepest["limited"] is True
    assert words in (tmp_path / "output" / "job" / "job.html").read_text()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("factor = 1.2\n", "", "a notch needs one of limit; factor and break_frequency; design_acceleration"),
        ('"base.force.z"\nfactor', '"base.force.x"\nfactor', "limit of base.force.x needs an input along it"),
        ('"base.force.z"\ndesign', '"tip.force.z"\ndesign', "not 'tip.force.z'; give 'limit'"),
        ('channel = "tip', 'channel = "top', "no channel 'top.acceleration.z'; they begin with"),
        ('response = "noise"', 'response = "noises"', "names the response 'noises'; did you mean 'noise'?"),
        ('duration = "1 h"\n', "", "[fatigue.shaken] needs the duration of its random response"),
        ('[srs.tip]\nresponse = "drop"', '[srs.tip]\nresponse = "noise"', "[srs.tip] cannot use a random response"),
        ('[srs.tip]\nresponse = "drop"', "[srs.tip]", "needs the channels of a run or of a response"),
        ('channels = ["beam.1', 'channels = ["bean.1', "no channel 'bean.1.start.My'; they begin with"),
        ("slope = 5", "slope = 0", "greater than 0"),
        ("lowest = \"1 Hz\"\nhighest = \"50 Hz\"", "lowest = \"60 Hz\"\nhighest = \"50 Hz\"", "must be below highest"),
    ],
)  # fmt: skip
def test_bad_tables_are_one_message_before_the_body_is_built(job, tmp_path, capsys, old, new, words):
    assert main(["run", str(job(old=old, new=new))]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert words in said
    assert "job.toml" in said
    assert not (tmp_path / "output").exists()


def test_of_a_run(job, tmp_path, capsys):
    """The same tables without a response: of channels of the simulation, also by the command simulate."""
    text = TOML[: TOML.index("[response.sine]")].replace("[mesh]", 'name = "beam"\n\n[mesh]', 1) + RUN
    file = job(text)
    assert main(["simulate", str(file), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    made = tmp_path / "output" / "job"
    run = mp.read_result(made / "job-run.h5")
    srs = shock_spectrum(run.time, run["beam.tip.acceleration.z"], np.geomspace(1, 20, 5))
    assert said["srs"]["tip"]["beam.tip.acceleration.z"]["maximax"] == pytest.approx(srs.maximax.max(), rel=1e-9)
    moment = run["beam.recovery.beam.1.start.My"]
    damage = rainflow_damage(run.time, 500 * moment, SNCurve(stress=10e6, cycles=1e6, slope=5)).damage
    assert said["fatigue"]["root"]["beam.recovery.beam.1.start.My"]["damage"] == pytest.approx(damage, rel=1e-9)
    assert main(["simulate", str(job(text, old="scale = 500", new="scale = 500000"))]) == 1
    assert "1 requirement is not met: fatigue root (largest damage" in capsys.readouterr().err
    assert main(["simulate", str(job(text, old="beam.tip.acc", new="beam.top.acc"))]) == 2
    assert "no channel 'beam.top.acceleration.z'" in " ".join(capsys.readouterr().err.split())
