"""[recovery] of a pipeline file: from the mesh to the modal file, channels, envelopes and margins of a run."""

import csv

import numpy as np
import pytest
from pipeline.building.test_stress import HEIGHT, LENGTH, RHO, TOML, G

import modalprep as mp
from modalprep.cli import main

WEIGHT = RHO * 0.3 * HEIGHT * G  # N/m
TABLES = """
[recovery.beam]
kind = "section_force"
stations = 3
allowable = "200 kN"

[recovery.wall]
kind = "reaction"
allowable = "1e6 N"

[recovery.tip]
kind = "acceleration"
near = [10, 0, 0]

[simulation]
"""


@pytest.fixture
def job(project, tmp_path):
    def write(old="", new="", t_end=3.0):
        text = TOML.replace("[simulation]\n", TABLES).format(mesh=project / "meshes" / "beam.msh", t_end=t_end)
        (tmp_path / "job.toml").write_text(text.replace(old, new))
        return tmp_path / "job.toml"

    return write


def test_a_damped_run_ends_at_the_forces_of_statics(job, tmp_path, capsys):
    """V = w L and M = w L^2 / 2 at the wall, whose reaction is the weight; the tip feels gravity alone."""
    assert main(["simulate", str(job())]) == 0
    said = capsys.readouterr().out
    assert "\nRecovered over the run\n" in said
    made = tmp_path / "output" / "job"
    run = mp.read_result(made / "job-run.h5")
    # a sag of 1.5 % acts by its square
    assert run["job.recovery.wall.root.Fz"][-1] == pytest.approx(WEIGHT * LENGTH, rel=5e-4)
    assert run["job.recovery.wall.root.My"][-1] == pytest.approx(-WEIGHT * LENGTH**2 / 2, rel=5e-4)
    assert run["job.recovery.beam.1.start.Vz"][-1] == pytest.approx(-WEIGHT * LENGTH, rel=5e-4)
    assert run["job.recovery.beam.1.start.My"][-1] == pytest.approx(WEIGHT * LENGTH**2 / 2, rel=5e-4)
    assert run["job.recovery.tip.2.z"][-1] == pytest.approx(G, rel=1e-6)
    with (made / "job-run-envelopes.csv").open() as file:
        rows = list(csv.DictReader(file))
    (row,) = (r for r in rows if (r["recovery"], r["place"], r["component"]) == ("beam", "1.start", "Vz"))
    history = run["job.recovery.beam.1.start.Vz"]
    assert (float(row["highest"]), float(row["lowest"])) == pytest.approx((history.max(), history.min()), rel=1e-9)
    assert float(row["margin"]) == pytest.approx(200000 / np.abs(history).max() - 1, rel=1e-8)
    assert row["unit"] == "N"


def test_modal_file_has_the_matrices_and_the_table_says_so(job, tmp_path, capsys):
    assert main(["modes", str(job())]) == 0
    assert "beam (section_force), wall (reaction), tip (acceleration)" in " ".join(capsys.readouterr().out.split())
    body = mp.read_body(tmp_path / "output" / "job" / "job.h5")
    assert sorted(body.recovery) == ["beam", "tip", "wall"]
    assert body.recovery["beam"].allowable == 200000.0
    assert len(body.recovery["beam"].places) == 3 * 40


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('kind = "reaction"', 'kind = "reactions"', "kind"),
        ("near = [10, 0, 0]", "", "needs exactly one of group, node, near"),
        ("stations = 3", "stations = 1", "stations"),
        ("stations = 3", 'group = "rot"', "no group 'rot'"),
        ('"200 kN"', '"200 kg"', "allowable"),
        ("[recovery.beam]", '[recovery."a.b"]', "leave '.' and '/' out"),
        ('kind = "reaction"', 'kind = "resultant"', "there are no shells"),
    ],
)
def test_bad_tables_are_one_message(job, capsys, old, new, words):
    assert main(["run", str(job(old=old, new=new))]) == 2
    said = capsys.readouterr().err
    assert words in " ".join(said.split())
    assert "job.toml" in said


def test_report_has_the_table(job, tmp_path):
    assert main(["run", str(job(t_end=0.5))]) == 0
    page = (tmp_path / "output" / "job" / "job.html").read_text()
    assert "Recovered over the run" in page
    assert "<td>job.beam</td><td>Vz</td>" in page


def test_an_event_of_a_file_sees_a_recovery(job, tmp_path):
    """The run ends where the reaction is 0.9 of the weight."""
    limit = 0.9 * WEIGHT * LENGTH
    event = f'[events.near]\nwhen = "job.recovery.wall.root.Fz - {limit}"\nterminal = true\n\n[simulation]\n'
    assert main(["simulate", str(job("[simulation]\n", event, t_end=1.0))]) == 0
    run = mp.read_result(tmp_path / "output" / "job" / "job-run.h5")
    assert 0 < run.time[-1] < 1.0
    assert run["job.recovery.wall.root.Fz"][-1] == pytest.approx(limit, rel=1e-6)  # of the time that was located


def test_json_has_the_worst_places(job, capsys):
    import json

    assert main(["simulate", str(job('"200 kN"', '"1 kN"', t_end=0.5)), "--json"]) == 1  # the moment is above it
    printed = capsys.readouterr()
    said = json.loads(printed.out)
    rows, verdict = said["envelopes"], said["verdict"]
    failed = {each["name"]: each["says"] for each in verdict["requirements"] if each["result"] == "FAILED"}
    assert failed["margin of job.beam My"].startswith("-")
    assert all(f"{name} ({says})" in printed.err for name, says in failed.items())
    assert {row["recovery"] for row in rows} == {"beam", "wall", "tip"}
    assert len(rows) == 6 + 6 + 3
