"""[response] of a pipeline file: from the mesh to curves, peaks, plots, the page and JSON."""

import csv
import json

import h5py
import numpy as np
import pytest
from toml_beams import RECTANGLE, TIP

import modalprep as mp
from modalprep.cli import main
from modalprep.pipeline.responses import respond
from modalprep.response import (
    History,
    Spectrum,
    harmonic_response,
    random_response,
    sweep_response,
    transient_response,
)

G = 9.80665
TOML = (
    RECTANGLE
    + TIP
    + """
[recovery.beam]
kind = "section_force"
stations = 2
allowable = "1 MN"

[reduction]
modes = 6
damping = 0.02

[output]
pictures = "none"

[response.shaker]
kind = "harmonic"
lowest = "0.5 Hz"
highest = "20 Hz"
points = 50

[response.shaker.base]
z = "1 g"
y = {{ frequency = [1, 10, 20], values = ["0.5 g", "0.5 g", 1.0], phase = ["0 deg", "90 deg", "90 deg"] }}

[response.launch]
kind = "random"
damping = 0.03
channels = ["base.force", "tip"]
coherence = [{{ between = ["base.z", "tip.y"], coherence = 0.25, phase = "60 deg" }}]
base.z = {{ frequency = [2, 4, 50, 100], values = ["3 dB/oct", "0.01 g^2/Hz", "0.01 g^2/Hz", "-6 dB/oct"] }}
forces.tip.y = {{ file = "force.csv", unit = "kN^2/Hz" }}

[response.sweep]
kind = "sweep"
lowest = "1 Hz"
highest = "3 Hz"
rate = "10 oct/min"
base.z = "1 g"

[response.separation]
kind = "transient"
duration = "0.5 s"
step = "0.1 ms"
base.x = {{ t = ["0 s", "10 ms", "20 ms"], values = [0, "2 g", 0], unit = "g" }}
"""
)


@pytest.fixture
def job(project, tmp_path):
    def write(old="", new=""):
        text = TOML.format(mesh=project / "meshes" / "beam.msh")
        assert old in text
        (tmp_path / "job.toml").write_text(text.replace(old, new))
        (tmp_path / "force.csv").write_text("Hz,value\n2,1e-6\n100,1e-6\n")
        return tmp_path / "job.toml"

    return write


def rows(path):
    with path.open() as file:
        return list(csv.DictReader(file))


def test_files_page_and_json_have_what_python_computes(job, tmp_path, capsys, monkeypatch):
    assert main(["run", str(job()), "--json"]) == 1  # the moment exceeds its allowable
    printed = capsys.readouterr()
    said, made = json.loads(printed.out), tmp_path / "output" / "job"
    assert said["verdict"]["word"] == "FAIL"
    assert len(printed.err.splitlines()) == 1
    assert "requirement is not met: " in printed.err
    body = mp.read_body(made / "job.h5")
    level = np.array([0.5 * G, 0.5 * G, 1.0])
    y = Spectrum(frequency=np.array([1.0, 10, 20]), value=level, phase=np.array([0, np.pi / 2, np.pi / 2]))
    shaker = harmonic_response(body, {"base.y": y, "base.z": G}, np.geomspace(0.5, 20, 50))
    for name in ("tip.acceleration.z", "beam.1.start.My"):
        peak = shaker.peak(name)
        (row,) = (r for r in rows(made / "job-shaker-peaks.csv") if r["channel"] == name)
        assert float(row["peak"]) == pytest.approx(peak.largest, rel=1e-9)  # ten digits
        assert float(row["at_hz"]) == pytest.approx(peak.figures["at_hz"], rel=1e-9)
    assert float(row["margin"]) == pytest.approx(1e6 / peak.largest - 1, rel=1e-8)
    curves = rows(made / "job-shaker-response.csv")
    assert [float(r["base.force.z (N)"]) for r in curves] == pytest.approx(np.abs(shaker["base.force.z"]), rel=1e-9)
    b = 1e-2 * G**2
    z = Spectrum(frequency=np.array([2.0, 4, 50, 100]), value=np.array([b * 10**-0.3, b, b, b * 10**-0.6]))
    r = 0.5 * np.exp(1j * np.pi / 3)
    launch = random_response(
        body, {"base.z": z, "tip.y": Spectrum(frequency=np.array([2.0, 100]), value=np.ones(2))},
        correlation=np.array([[1, r], [r.conj(), 1]]), damping=0.03,
    )  # fmt: skip
    (row,) = (r for r in rows(made / "job-launch-peaks.csv") if r["channel"] == "beam.1.start.My")
    assert float(row["three_sigma"]) == pytest.approx(launch.peak("beam.1.start.My").largest, rel=1e-9)
    assert not any(name.startswith("beam") for name in rows(made / "job-launch-response.csv")[0])
    with h5py.File(made / "job-shaker-response.h5") as file:
        at = list(file["channels"].asstr()).index("base.force.z")
        assert file["curves"][:, at] == pytest.approx(shaker["base.force.z"], rel=1e-12)
        at = list(file["peaks/channel"].asstr()).index("beam.1.start.My")
        assert file["peaks/margin"][at] == pytest.approx(peak.margin, rel=1e-12)
    sweep = sweep_response(body, {"base.z": G}, 1.0, 3.0, (10.0, "oct/min"))
    (row,) = (r for r in rows(made / "job-sweep-peaks.csv") if r["channel"] == "tip.acceleration.z")
    figures = sweep.peak("tip.acceleration.z").figures
    assert [float(row[key]) for key in figures] == pytest.approx(list(figures.values()), rel=1e-9)
    push = History(time=np.array([0, 0.01, 0.02]), value=np.array([0, 2 * G, 0]))
    push = transient_response(body, {"base.x": push}, duration=0.5, step=1e-4)
    monkeypatch.setattr(respond, "ROWS", 1000)
    respond.write_curves(push, tmp_path / "few.csv")
    for file, each in ((made / "job-separation-response.csv", 1), (tmp_path / "few.csv", 6)):
        curve = [float(r["base.force.x (N)"]) for r in rows(file)]
        assert curve == pytest.approx(push["base.force.x"][::each], rel=1e-9, abs=1e-6)
    page = (made / "job.html").read_text()
    for words in ("<h2>Response shaker</h2>", "<h2>Response launch</h2>", "base.force.z</td>"):
        assert words in page
    peaks = {row["channel"]: row for row in said["responses"]["launch"]["peaks"]}
    assert peaks["base.force.z"]["rms"] == pytest.approx(launch.peak("base.force.z").figures["rms"], rel=1e-12)
    assert any("response shaker: the input base.y is zero outside its table" in note for note in said["notes"])
    assert any(str(file).endswith("job-launch-response.png") for file in said["files"])


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('kind = "harmonic"', 'kind = "harmonics"', "does not match any of the expected tags"),
        ('z = "1 g"', 'z = "1 kN"', "another dimension than m/s^2"),
        ('z = "1 g"', 'z = "fast"', "no number with a unit of m/s^2"),
        ('highest = "20 Hz"', 'highest = "0.1 Hz"', "must be below highest"),
        ('highest = "20 Hz"', "", "needs 'lowest' and 'highest'"),
        ("forces.tip.y", "forces.top.y", "no input 'top.y'; did you mean 'tip.y'?"),
        ("forces.tip.y", "forces.root.y", "no input 'root.y'"),
        ('"tip.y"], coherence', '"tip.z"], coherence', "no input 'tip.z'"),
        ('channels = ["base.force", "tip"]', 'channels = ["best.force"]', "no channel 'best.force'"),
        ("force.csv", "none.csv", "none.csv does not exist"),
        ('"3 dB/oct"', '"3 dB"', "no number with a unit"),
        ("phase = [", "phase = [0, ", "'phase' needs as many"),
        ("[response.launch]", '[response."la/unch"]', "has '/' in its name"),
        ('kind = "random"', 'kind = "random"\ncorrelation = "full"', "contradict each other"),
        ("10 oct/min", "10 oct/s", "give its rate in 'oct/min' or 'Hz/s'"),
        ("10 oct/min", "1e-6 Hz/s", "too many; sweep faster"),
        ('file = "force.csv"', "frequency = [2, 3], values = [-1, 1]", "has a negative density"),
        ("10 oct/min", "fast", "rate = 'fast' is none"),
        ('"10 ms", "20 ms"', '"10 ms"', "t has 2 values and values 3"),
        ('"10 ms", "20 ms"', '"10 ms", "5 ms"', "must ascend"),
        ("[mesh]", "[messh]", "unknown key 'messh'"),
    ],
)
def test_bad_tables_are_one_message_before_the_body_is_built(job, tmp_path, capsys, old, new, words):
    assert main(["run", str(job(old=old, new=new))]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert words in said
    assert "job.toml" in said
    assert not (tmp_path / "output").exists()


def test_random_without_damping_is_refused_with_its_table(job, capsys):
    assert main(["run", str(job(old="damping = 0.03", new="damping = 0.0"))]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "[response.launch]: the mode at" in said
    assert "has no damping" in said


def test_a_response_needs_a_body(tmp_path, capsys):
    file = tmp_path / "job.toml"
    file.write_text('[response.a]\nkind = "harmonic"\nfrequency = [1.0]\nbase.x = 1.0\n\n[simulation]\nt_end = 1.0\n')
    assert main(["run", str(file)]) == 2
    assert "is that of the body" in " ".join(capsys.readouterr().err.split())
