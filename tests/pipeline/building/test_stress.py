"""[stress] of a pipeline file: from the mesh to the modal file, the histories of a run, its table and its picture."""

import numpy as np
import pytest
from toml_beams import RECTANGLE

import modalprep as mp
from modalprep.cli import main

HEIGHT, LENGTH, RHO, G = 0.2, 10.0, 3000.0, 9.81
TOML = (
    RECTANGLE
    + """
[stress.clamp]
group = "root"

[reduction]
modes = 4
damping = 1.0

[output]
pictures = "none"

[joints.wall]
type = "weld"
child = "job.root"

[environment]
gravity = [0, 0, -9.81]

[simulation]
t_end = {t_end}
output_step = 0.5
method = "generalised_alpha"
output = ["job.stress.clamp.1.xx"]

[[plots]]
y = ["job.stress.clamp.1.xx", "job.stress.clamp.3.von_mises"]
"""
)


@pytest.fixture
def job(project, tmp_path):
    def write(old="", new="", t_end=3.0):
        text = TOML.format(mesh=project / "meshes" / "beam.msh", t_end=t_end).replace(old, new)
        (tmp_path / "job.toml").write_text(text)
        return tmp_path / "job.toml"

    return write


def test_a_damped_run_ends_at_the_static_stress(job, tmp_path):
    """``M / W = rho g L^2 / 2 A / W = 3 rho g L^2 / h`` under its weight, but for l^2 / 12 of elements of 0.25 m."""
    assert main(["simulate", str(job())]) == 0
    made = tmp_path / "output" / "job"
    run = mp.read_result(made / "job-run.h5")
    exact = 6 * RHO * G * (LENGTH**2 / 2 - 0.25**2 / 12) / HEIGHT
    # 30 time constants of the critically damped first mode; a sag of 1.5 % acts by its square
    assert run["job.stress.clamp.1.xx"][-1] == pytest.approx(exact, rel=5e-4)
    assert run["job.stress.clamp.3.von_mises"][-1] == pytest.approx(exact, rel=5e-4)
    assert (made / "job-history.png").exists()
    lines = (made / "job-run.csv").read_text().splitlines()
    assert lines[0] == "time,job.stress.clamp.1.xx"
    assert float(lines[-1].split(",")[1]) == pytest.approx(exact, rel=5e-4)


def test_other_points_make_the_body_again(job, tmp_path):
    """A simulation takes the modal file that is there only if it has the points of its pipeline file."""
    for name in ("clamp", "foot"):
        assert main(["simulate", str(job("clamp", name, t_end=0.5))]) == 0
        body = mp.read_body(tmp_path / "output" / "job" / "job.h5")
        assert sorted(body.stress) == [f"{name}.{k}" for k in range(1, 9)]


def test_shipped_bracket_has_its_point_in_the_unit_of_the_mesh(project, bracket_model):
    from modalprep.pipeline.building.model import pipeline_stress, read_pipeline_mesh
    from modalprep.pipeline.schema.load import load

    path = project / "pipelines" / "bracket.toml"
    source = load(path)
    recovery = pipeline_stress(source.pipeline, read_pipeline_mesh(source), bracket_model)
    (at,) = recovery.nodes
    assert at.name == "neck"
    assert np.linalg.norm(at.position + bracket_model.origin - [0.016, 0.012, 0]) < 1.5e-3  # half an element


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('[stress.clamp]\ngroup = "root"', '[stress.clamp]\ngroup = "rot"', "no group 'rot'"),
        ('[stress.clamp]\ngroup = "root"', "[stress.clamp]", "needs exactly one of group, node, near"),
        ("[stress.clamp]", "[stress.clamp]\nposition = [0, 0, 0]", "unknown key 'position'"),
        ("[stress.clamp]", "[stress.clamp]\nfibres = [[0]]", "at least 2 items"),
        ("[stress.clamp]", '[stress."a.b"]', "leave '.' and '/' out"),
        ("[stress.clamp]", "[stress.clamp]\naxis = [1, 0, 0]", "'axis' is not for elements of type beam"),
        ("clamp.1.xx", "clamp.9.xx", "has no channel 'job.stress.clamp.9.xx'"),
    ],
)
def test_bad_tables_are_one_message(job, capsys, old, new, words):
    assert main(["run", str(job(old=old, new=new))]) == 2
    said = capsys.readouterr().err
    assert words in " ".join(said.split())
    assert "job.toml" in said


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('[matrices]\nfile = "a.npz"\n', "[matrices] recover reaction, acceleration and displacement"),
        ('[body]\nfile = "a.h5"\n', "[body] has the recoveries of its file"),
        (
            "[beams.a]\nlength = 1\nsegments = 2\nmass_per_length = 1\nEI = 1\n[simulation]\nt_end = 1\n",
            "have the forces of their joints",
        ),
    ],
)
def test_recoveries_without_elements_are_refused(tmp_path, capsys, text, words):
    (tmp_path / "job.toml").write_text(text + '[recovery.x]\nkind = "section_force"\n')
    assert main(["modes", str(tmp_path / "job.toml")]) == 2
    assert words in " ".join(capsys.readouterr().err.split())


def test_matrices_have_no_stress(tmp_path, capsys):
    text = '[matrices]\nfile = "a.npz"\n[interfaces.a]\nnode = 1\n[stress.a]\nnode = 1\n'
    (tmp_path / "job.toml").write_text(text)
    assert main(["modes", str(tmp_path / "job.toml")]) == 2
    assert "[stress] needs the elements of a [mesh]" in " ".join(capsys.readouterr().err.split())
