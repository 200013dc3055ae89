"""What the README shows is run."""

import re
import tomllib
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from scipy.io import mmwrite

import modalprep as mp
from modalprep.cli import main
from modalprep.cli.commands import app
from modalprep.examples import uniform_beam
from modalprep.pipeline.schema.pipeline import Pipeline


@pytest.fixture
def text(project):
    return (project / "README.md").read_text()


def test_python_blocks_run_in_order(text, project, tmp_path, monkeypatch, capsys):
    (tmp_path / "meshes").symlink_to(project / "meshes")
    monkeypatch.chdir(tmp_path)
    scope: dict = {}
    for block in re.findall(r"```python\n(.*?)```", text, re.DOTALL):
        exec(compile(block, "README.md", "exec"), scope)
    printed = capsys.readouterr().out
    assert "modalprep 1 SI" in printed
    assert "fixed-interface" in printed
    assert scope["run"].stats["energy_error"] < 1e-4


def test_pipeline_block_is_valid_and_true(text, project):
    block = tomllib.loads(re.search(r"```toml\n(.*?)```", text, re.DOTALL)[1])
    shipped = tomllib.loads((project / "pipelines" / "bracket.toml").read_text())
    Pipeline.model_validate(block)
    assert block == {key: shipped[key] for key in block}


def test_matrices_block_runs(text, tmp_path, bracket_model):
    """The second block, with the matrices of the bracket in t, mm, s, gives the body of the bracket's mesh."""
    block = re.findall(r"```toml\n(.*?)```", text, re.DOTALL)[1]
    n = 3 * len(bracket_model.points)
    for name in ("K", "M"):
        mmwrite(tmp_path / f"{name.lower()}.mtx", 1e-3 * getattr(bracket_model, name)[:n, :n], symmetry="symmetric")
    points = 1e3 * (bracket_model.points + bracket_model.origin)
    np.savetxt(tmp_path / "nodes.csv", np.column_stack([np.arange(1, len(points) + 1), points]), delimiter=",")
    (tmp_path / "job.toml").write_text(block + '[output]\npictures = "none"\n')
    assert main(["modes", str(tmp_path / "job.toml")]) == 0
    made = mp.read_body(tmp_path / "output/job/job.h5")
    assert not made.has_geometric_stiffness
    assert np.allclose(
        made.modes.frequency[:20], mp.craig_bampton(bracket_model, modes=20).table.frequency[:20], rtol=1e-9
    )


def test_system_block_runs(text, tmp_path):
    """Its satellite, with a beam of the examples as boom; the boom ends at its limit."""
    block = next(b for b in re.findall(r"```toml\n(.*?)```", text, re.DOTALL) if "[joints.orbit]" in b)
    places = {"root": [0, 0, 0], "side": [0.5, 0, 0], "nozzle": [0, 0, -0.5]}
    bus = mp.rigid_body(
        "bus", mass=200.0, centre=np.zeros(3), inertia=40 * np.eye(3),
        interfaces={name: np.array(place, dtype=float) for name, place in places.items()},
    )  # fmt: skip
    mp.write_body(bus, tmp_path / "bus.h5")
    mp.write_body(uniform_beam(modes=2), tmp_path / "boom.h5")
    (tmp_path / "job.toml").write_text(block)
    assert main(["simulate", str(tmp_path / "job.toml")]) == 0
    run = mp.read_result(tmp_path / "output/job/job-run.h5")
    assert run.stats["energy_error"] < 1e-6
    assert run["hinge.angle"][-1] > run["hinge.angle"][0]
    assert run["energy.stored"][0] > 0


def test_analysis_block_runs(text, tmp_path):
    """A boom on a wall, with the hinge and the names of the block."""
    block = next(b for b in re.findall(r"```toml\n(.*?)```", text, re.DOTALL) if "[analysis]" in b)
    mp.write_body(uniform_beam(modes=2), tmp_path / "boom.h5")
    system = '[bodies.boom]\nfile = "boom.h5"\n[joints.hinge]\ntype = "revolute"\nchild = "boom.root"\nstiffness = 20\n'
    (tmp_path / "job.toml").write_text(system + block)
    assert main(["analyse", str(tmp_path / "job.toml")]) == 0
    made = {file.name for file in (tmp_path / "output/job").iterdir()}
    assert {"job-analysis.json", "job-response.png", "job-state-space.mat", "job-inverse.csv"} <= made


def test_every_command_exists(text):
    shown = set(re.findall(r"bin/modalprep (\w+)", text))
    assert shown == {command.name or command.callback.__name__ for command in app.registered_commands}


def test_every_file_named_exists(text, project):
    for name in re.findall(r"\]\((\S+?)\)", text) + [f"pipelines/{n}" for n in re.findall(r"`([\w-]+\.toml)`", text)]:
        assert (project / Path(name)).exists(), name


def test_element_page(project, capsys):
    """Its TOML is valid where a material and a mesh are added; its Python runs."""
    text = (project / "src" / "modalprep" / "fe" / "README.md").read_text()
    elements, deck = (tomllib.loads(block) for block in re.findall(r"```toml\n(.*?)```", text, re.DOTALL))
    Pipeline.model_validate({"mesh": {"file": "a.msh"}, **elements})
    Pipeline.model_validate(deck)
    for block in re.findall(r"```python\n(.*?)```", text, re.DOTALL):
        exec(compile(block, "fe/README.md", "exec"), {})
    assert len(capsys.readouterr().out.splitlines()) == 2


def test_element_page_names_every_type(project):
    from modalprep.pipeline.schema.properties import Section

    types = {get_args(table.model_fields["type"].annotation)[0] for table in get_args(get_args(Section)[0])}
    text = (project / "src" / "modalprep" / "fe" / "README.md").read_text()
    assert set(re.findall(r"^\| `(\w+)` \|", text, re.MULTILINE)) - {"type"} == types
