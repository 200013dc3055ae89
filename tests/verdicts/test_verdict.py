"""Inputs that are bad on purpose: the same verdict, with its reason, in page, JSON, terminal, Python and exit code."""

import html
import json
import re
import warnings
from dataclasses import FrozenInstanceError, replace
from types import SimpleNamespace

import pytest
from batches import write_beam
from toml_beams import RECTANGLE

import modalprep as mp
from modalprep.cli import main
from modalprep.formats.responsefile import read_response
from modalprep.pipeline.outcome import Outcome
from modalprep.report.body_page import requirements
from modalprep.report.numbers import raised
from modalprep.verdicts.verdict import FAILED, Requirement

SHAKER = """
[response.shaker]
kind = "harmonic"
lowest = "0.3 Hz"
highest = "{highest}"
points = 40
base.y = "0.001 m/s^2"
"""
SWING = """
[joints.hinge]
type = "weld"
child = "job.root"

[environment]
gravity = [0, -9.81, 0]

[simulation]
t_end = 1.0
output_step = 0.1
"""
TOML = (
    RECTANGLE
    + """
[reduction]
modes = 10
truncation_vectors = ["inertia"]
damping = 0.02

[output]
pictures = "none"
"""
)
LIMIT = '\n[recovery.wall]\nkind = "reaction"\nallowable = "1e-6 N"\n'
BAD = {  # changes of the file, text behind it, verdict, part of the reason
    "nothing": ({}, SHAKER.format(highest="9 Hz"), "PASS", ""),
    "density in t/mm^3": ({"3000.0": "3e-9"}, "", "PASS WITH WARNINGS", "did you mean 3e-09 t/mm^3?"),
    "modulus in MPa": ({"7e10": "7e4"}, "", "PASS WITH WARNINGS", "did you mean 7e+04 MPa?"),
    "lengths in mm": ({"[mesh]": '[mesh]\nlength_unit = "km"'}, "", "PASS WITH WARNINGS", "is implausible"),
    "damping in per cent": ({"0.02": "2.0"}, "", "PASS WITH WARNINGS", "damping ratio 2 is implausible"),
    "no damping": ({"0.02": "0.0"}, SHAKER.format(highest="9 Hz"), "PASS WITH WARNINGS", "modes without damping"),
    "wrong band": ({}, SHAKER.format(highest="3000 Hz"), "PASS WITH WARNINGS", "beyond it the dropped modes"),
    "dropped modes": ({"modes = 10": "modes = 10\nup_to = 60\nkeep = [3]"}, "", "PASS WITH WARNINGS", "drops"),
    "coarse mesh": ({"{mesh}": "coarse.msh"}, "", "PASS WITH WARNINGS", "the mesh is too coarse"),
    "huge deflection": ({"width = 0.3, height = 0.2": "width = 0.05, height = 0.01"}, SWING, "PASS WITH WARNINGS",
                        "above 10 % the theory is not valid"),
    "an allowable exceeded": ({}, SHAKER.format(highest="9 Hz") + LIMIT, "FAIL", "margin of wall"),
    "a requirement not met": ({}, '\n[require]\nmass = { below = "1 kg" }\n', "FAIL", "must be below 1 kg"),
}  # fmt: skip


@pytest.fixture
def job(project, tmp_path):
    """Write a pipeline file with changes, and the mesh of one beam along z, and of two elements along x."""
    points = "".join(f"{k + 1} {10 * k} 0 0\n" for k in range(2))
    names = '3\n0 1 "root"\n0 2 "tip"\n1 3 "beam"'
    cells = "1 15 2 1 1 1\n2 15 2 2 2 2\n3 1 2 3 1 1 2\n"
    (tmp_path / "coarse.msh").write_text(
        f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n{names}\n$EndPhysicalNames\n"
        f"$Nodes\n2\n{points}$EndNodes\n$Elements\n3\n{cells}$EndElements\n"
    )

    def write(changes, text):
        whole = TOML
        for old, new in changes.items():
            assert old in whole, old
            whole = whole.replace(old, new)
        (tmp_path / "job.toml").write_text(whole.format(mesh=project / "meshes" / "beam.msh") + text)
        return str(tmp_path / "job.toml")

    return write


def heard(folder):
    """Return what Python says of the body, the responses and the run in a folder, by its warnings and in texts."""
    said, texts = [], []
    for read, pattern in ((mp.read_body, "job.h5"), (read_response, "*response.h5"), (mp.read_result, "*run.h5")):
        for file in folder.glob(pattern):
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                texts.append(repr(read(file)))
            assert all(each.category is mp.ModalprepWarning for each in caught)
            assert all(each.filename == __file__ for each in caught)  # the user's line, not one of this package
            said += [str(each.message) for each in caught]
    return said, "\n".join(texts)


@pytest.mark.parametrize("name", BAD)
def test_every_way_to_look_tells_the_same(name, job, tmp_path, capsys):
    changes, text, word, reason = BAD[name]
    file, code, made = job(changes, text), 1 if word == "FAIL" else 0, tmp_path / "output" / "job"
    assert main(["run", file, "--json"]) == code
    printed = capsys.readouterr()
    verdict = json.loads(printed.out)["verdict"]
    assert verdict["word"] == word
    rows = [f"{r['name']}: {r['says']}" for r in verdict["requirements"] if r["result"] == "FAILED"]
    assert not reason or any(reason in said for said in (*rows, *verdict["warnings"])), verdict
    assert (reason.split(":")[0] in printed.err) if code else not printed.err
    page = html.unescape((made / "job.html").read_text(encoding="utf-8"))
    box = re.search(r'<div class="box .*?</header>', page, re.DOTALL)[0]
    assert f'<p class="word">{word}</p>' in box
    assert all(raised(said) in box for said in verdict["warnings"])
    if word == "PASS WITH WARNINGS":
        said, texts = heard(made)
        assert any(reason in each for each in said)
        assert reason in texts


@pytest.mark.parametrize("name", ["nothing", "damping in per cent", "a requirement not met"])
def test_the_verdict_is_the_last_that_a_terminal_shows(name, job, capsys):
    changes, text, word, reason = BAD[name]
    main(["run", job(changes, text)])
    lines = capsys.readouterr().out.splitlines()
    (start,) = (k for k, line in enumerate(lines) if line.startswith(f"{word}: "))
    assert all(line.startswith(("  warning: ", "  not met: ")) for line in lines[start + 1 :])
    assert reason in "\n".join(lines[start + 1 :])
    assert len(lines[start + 1 :]) == bool(reason)


def test_a_batch_has_the_verdicts_of_its_jobs(job, capsys):
    """Exit code 1 with a FAIL, although the job is done; the table has the word, the lines below the reason."""
    assert main(["batch", job(*BAD["a requirement not met"][:2])]) == 1
    said = capsys.readouterr().out
    assert re.search(r"job +done +FAIL ", said)
    assert "job: mass: 1800 kg, must be below 1 kg" in said


def test_a_verdict_survives_json():
    met = mp.Requirement(name="mass", result="passed", says="1 kg")
    failed = mp.Requirement(name="margin", result="FAILED", says="-0.2", anchor="recovered")
    from modalprep.verdicts.verdict import read_verdict

    again = read_verdict(json.loads(json.dumps(mp.Verdict.of([met, failed], ["late", "late"]).summary())))
    assert (again.word, again.reasons) == ("FAIL", ("margin: -0.2", "late"))


def test_a_warning_is_said_once_at_the_line_of_the_user(project):
    """Assembly says it of the section; reduction and body, whose notes have it too, do not say it again."""
    light = mp.Material(E=7e10, nu=0.3, rho=2.7e-9)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        mesh = mp.read_mesh(project / "meshes" / "beam.msh")
        section = mp.fe.beam_section("rectangle", light, width=0.2, height=0.3)
        model = mp.assemble(mesh, {"beam": section}, {"root": mp.Interface(group="root", kind="node")})
        body = mp.flexible_body(model, mp.craig_bampton(model, modes=2), name="light")
    assert [str(each.message) for each in caught if "density" in str(each.message)] == [body.notes[0]]
    assert {each.filename for each in caught} == {__file__}
    assert "did you mean 2.7e-09 t/mm^3?" in repr(model)
    assert "did you mean 2.7e-09 t/mm^3?" in repr(body)


def test_a_check_that_fails_is_heard():
    from modalprep.examples import uniform_beam

    beam = uniform_beam(modes=2)
    with pytest.warns(mp.ModalprepWarning, match="check of 'beam': modal damping: .*D is not negative"):
        mp.check_body(beam.with_(D=-beam.frequency))


def test_a_run_alone_keeps_the_margin_that_is_required(job, capsys):
    """`simulate` builds the body and does not judge it, but its recoveries have a margin."""
    limit = '\n[recovery.wall]\nkind = "reaction"\nallowable = "50 kN"\n\n[require]\nmargin = 1e3\n'
    assert main(["simulate", job({}, SWING + limit), "--json"]) == 1
    rows = {each["name"]: each for each in json.loads(capsys.readouterr().out)["verdict"]["requirements"]}
    assert rows["least margin"]["result"] == "FAILED"
    assert rows["least margin"]["says"].endswith("must be at least 1000")


def test_a_verdict_is_worked_out_once(project, tmp_path, monkeypatch, capsys):
    """For the page, the JSON, the quantities and the exit code of a run; an outcome that differs has its own."""
    count, original = [], requirements.body_verdict
    monkeypatch.setattr(requirements, "body_verdict", lambda **given: count.append(1) or original(**given))
    assert main(["run", str(write_beam(project, tmp_path / "beam.toml", modes=2)), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["verdict"]["word"] == "PASS"
    assert len(count) == 1


def test_a_changed_outcome_has_a_verdict_of_its_own(tmp_path):
    failed = Requirement(name="energy balance", result=FAILED)
    good = Outcome(tmp_path, simulated=SimpleNamespace(audits=(), envelopes=(), notes=()))
    assert good.verdict.word == "NOT CHECKED"
    assert good.verdict is good.verdict
    bad = replace(good, simulated=SimpleNamespace(audits=(failed,), envelopes=(), notes=()))
    assert (good.verdict.word, bad.verdict.word) == ("NOT CHECKED", "FAIL")
    with pytest.raises(FrozenInstanceError):
        good.built = None
