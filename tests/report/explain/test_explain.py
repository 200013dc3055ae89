"""Output files in plain sentences: their numbers are those of the records."""

import json

import numpy as np
import pytest

import modalprep as mp
from modalprep.cli import main
from modalprep.examples import uniform_beam
from modalprep.formats import read_response, write_response
from modalprep.report.explain.body import explain_body
from modalprep.report.explain.file import explain_file
from modalprep.report.explain.response import explain_response
from modalprep.report.explain.run import explain_run
from modalprep.response import harmonic_response, random_response


@pytest.fixture(scope="module")
def beam():
    return uniform_beam(modes=4)


def test_a_body_is_told_with_its_modes_mass_and_warnings(beam):
    said = "\n".join(explain_body(beam.with_(D=0.02 * 2 * np.pi * beam.frequency, notes=("its size is implausible",))))
    assert f"has {beam.m:.4g} kg" in said
    assert f"first mode has {beam.frequency[0]:.4g} Hz (1st bending in y)" in said
    assert "In y mode 1 at 0.6044 Hz has most of the mass, 61 %" in said  # 61.3 %: Blevins, cantilever
    assert "damping is 1 % of critical: a resonance amplifies about 50 times" in said  # 1 / (2 zeta)
    assert "Do not trust it blindly: its size is implausible." in said
    assert "Nothing speaks against it" not in said


def test_what_a_body_lacks_is_told(beam):
    said = "\n".join(explain_body(beam.conventional().with_(D=0 * beam.D, notes=())))
    assert "no damping" in said
    assert "no geometric stiffness" in said
    assert "Nothing speaks against it: it has no warnings." in said


def test_a_response_is_told_with_its_peak_margin_and_notes(beam, tmp_path):
    f = np.linspace(0.5, 0.7, 200)
    found = harmonic_response(beam, {"base.y": 0.01}, f, damping=0.02, channels=["base.force"])
    again = read_response(write_response(found, tmp_path / "sine.h5"))
    assert [p[:5] for p in again.peaks] == [p[:5] for p in found.peaks]
    assert [p.figures for p in again.peaks] == [p.figures for p in found.peaks]
    np.testing.assert_array_equal(again["base.force.y"], found["base.force.y"])
    assert (again.notes, again.chosen, again.inputs) == (found.notes, found.chosen, found.inputs)
    said = "\n".join(explain_response(again))
    peak = found.peak("base.force.y")
    assert f"base.force.y reaches {peak.largest:.4g} N at {peak.figures['at_hz']:.4g} Hz" in said
    assert "no margin is known" in said


def test_a_random_response_survives_its_file(beam, tmp_path):
    found = random_response(beam, {"base.y": 1e-4}, damping=0.02, band=(0.1, 3.0), channels=["base.force"])
    again = read_response(write_response(found, tmp_path / "random.h5"))
    np.testing.assert_array_equal(again.weight, found.weight)
    assert again.peak("base.force.y").largest == found.peak("base.force.y").largest


def test_a_run_is_told_with_its_extremes_and_balance():
    time = np.linspace(0, 2, 5)
    channels = {
        "hinge.angle": np.array([0.0, 0.4, 0.9, 0.2, -0.1]), "slider.displacement": time,
        "arm.modal": np.array([[0.0, 0.0], [0.1, 0.5], [0.2, 0.1], [0.0, 0.0], [0.0, 0.0]]),
        "energy.kinetic": 3 * time, "energy.gravity": -2 * time, "energy.strain": 0 * time,
    }  # fmt: skip
    run = mp.Result(
        time=time, channels=channels, status="done", message="", notes=("body 'arm' deflects by 1 m",),
        stats={"energy_error": 2e-5, "steps": 120, "method": "generalised_alpha"},
    )  # fmt: skip
    assert explain_run(run) == [
        "The run reached its end, t = 2 s.",
        "hinge.angle moves most of the joints: from -0.1 to 0.9 rad.",
        "Of the bodies 'arm' bends most, mostly in its mode 2.",
        "Its kinetic energy changes most, by 6 J, then its energy in gravity, by 4 J.",
        "Its energy balances to 0.002 % of its largest part.",
        "It took 120 steps by the method generalised alpha.",
        "Do not trust it blindly: body 'arm' deflects by 1 m.",
    ]
    lost = explain_run(run.with_(status="diverged", message="diverged at t = 1 s"))
    assert lost[0] == "The run did not reach its end: diverged at t = 1 s; do not use its histories."


def test_a_batch_is_told_with_its_verdicts_and_failures(tmp_path):
    good = mp.Verdict.of([mp.Requirement(name="mass", result="passed")])
    warned = mp.Verdict.of([], ["its size is implausible"])
    bad = mp.Verdict.of([mp.Requirement(name="mass", result="FAILED", says="9 kg")])
    jobs = [
        {"job": name, "status": "done", "cause": "", "seconds": 1.0, "verdict": verdict.summary()}
        for name, verdict in {"a": good, "b": warned, "c": bad}.items()
    ]
    jobs.append({"job": "d", "status": "failed", "cause": "no mesh", "seconds": 3.0})
    file = tmp_path / "batch.json"
    file.write_text(json.dumps({"format": "modalprep batch", "seconds": 6.0, "jobs": jobs}))
    assert explain_file(tmp_path) == [
        "The batch has 4 jobs, of which 3 are done; it took 6 s.",
        "The verdicts are 1 PASS, 1 PASS WITH WARNINGS, 1 FAIL.",
        "Not met: c (mass: 9 kg).",
        "1 job: its size is implausible.",
        "Not done: d (no mesh); the others can be used.",
        "The longest job is d, 3 s.",
    ]


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("job.toml", "", "is a pipeline file"),
        ("batch.json", "{", "is damaged"),
        ("batch.json", "{}", "is not the file of a batch"),
        ("gone.h5", None, "does not exist"),
        ("text.h5", "x", "is damaged"),
    ],
)
def test_other_files_are_refused_with_a_sentence(tmp_path, capsys, name, content, reason):
    file = tmp_path / name
    if content is not None:
        file.write_text(content)
    assert main(["explain", str(file)]) == 2
    printed = capsys.readouterr()
    assert reason in printed.err
    assert len(printed.err.splitlines()) == 1


def test_the_command_prints_a_sentence_a_line(beam, tmp_path, capsys):
    file = mp.write_body(beam, tmp_path / "beam.h5")
    assert main(["explain", str(file)]) == 0
    assert capsys.readouterr().out.splitlines() == explain_body(beam)
    assert main(["explain", str(file), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["sentences"] == explain_body(beam)
