"""What the pages of the documentation show is run; their tables and lists are those of the program."""

import re
import tomllib
from typing import get_args

import numpy as np
import pytest
from scipy.io import mmwrite

import modalprep as mp
from modalprep.cli import main
from modalprep.cli.commands import app
from modalprep.ensemble.cases import DISTRIBUTIONS
from modalprep.examples import uniform_beam
from modalprep.pipeline.schema.analysis import DistributionTable
from modalprep.pipeline.schema.force_elements import ForceElements
from modalprep.pipeline.schema.pipeline import Pipeline
from modalprep.pipeline.schema.properties import Section
from modalprep.pipeline.schema.system import JointTable


@pytest.fixture
def page(project):
    """Return the text of a page of the documentation."""
    return lambda name: (project / "docs" / name).read_text()


def blocks(text, language):
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)


def test_python_blocks_run_in_order(page, project, tmp_path, monkeypatch, capsys):
    """Of the tutorial, then of the page that reads its modal file."""
    (tmp_path / "meshes").symlink_to(project / "meshes")
    monkeypatch.chdir(tmp_path)
    scope: dict = {}
    for block in blocks(page("tutorials/python.md") + page("how-to/modal-file.md"), "python"):
        exec(compile(block, "tutorial", "exec"), scope)
    printed = capsys.readouterr().out
    assert "modalprep 2 SI" in printed
    assert "fixed-interface" in printed
    assert scope["run"].stats["energy_error"] < 1e-4
    assert scope["run"].time[-1] == 0.004  # of the run with the control law


def test_matrices_block_runs(page, tmp_path, bracket_model):
    """With the matrices of the bracket in t, mm, s, it gives the body of the bracket's mesh."""
    (block,) = blocks(page("how-to/matrices.md"), "toml")
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


def write_satellite(folder):
    """Write the bodies of the page's satellite, with a beam of the examples as boom."""
    places = {"root": [0, 0, 0], "side": [0.5, 0, 0], "nozzle": [0, 0, -0.5]}
    bus = mp.rigid_body(
        "bus", mass=200.0, centre=np.zeros(3), inertia=40 * np.eye(3),
        interfaces={name: np.array(place, dtype=float) for name, place in places.items()},
    )  # fmt: skip
    mp.write_body(bus, folder / "bus.h5")
    mp.write_body(uniform_beam(modes=2), folder / "boom.h5")


def test_system_block_runs(page, tmp_path):
    """Its satellite, with a beam of the examples as boom; the boom ends at its limit."""
    block = blocks(page("reference/simulation.md"), "toml")[0]
    write_satellite(tmp_path)
    (tmp_path / "job.toml").write_text(block)
    assert main(["simulate", str(tmp_path / "job.toml")]) == 0
    run = mp.read_result(tmp_path / "output/job/job-run.h5")
    assert run.stats["energy_error"] < 1e-6
    assert run["hinge.angle"][-1] > run["hinge.angle"][0]
    assert run["energy.stored"][0] > 0


def test_loop_block_is_valid(page):
    """Its closure and its coupler, in a system that has their bodies and joints."""
    loop = tomllib.loads(blocks(page("reference/simulation.md"), "toml")[1])
    hinges = {name: {"type": "revolute", "child": f"{name}.root"} for name in ("pinion", "wheel")}
    bodies = {name: {"file": f"{name}.h5"} for name in ("rocker", "coupler", "pinion", "wheel")}
    Pipeline.model_validate({"bodies": bodies, "joints": hinges, "simulation": {"t_end": 1.0}, **loop})


def test_ensemble_block_runs(page, tmp_path, capsys):
    """With the satellite of the page and some of its cases; its Python runs too."""
    text = page("reference/simulation.md")
    system, *_, ensemble = blocks(text, "toml")
    write_satellite(tmp_path)
    few = ensemble.replace("cases = 256", "cases = 2")
    (tmp_path / "job.toml").write_text(system.replace("t_end = 5.0", "t_end = 0.1") + few)
    assert main(["simulate", str(tmp_path / "job.toml")]) == 0
    listed = set(re.findall(r"`X(-ensemble[\w.-]+)`", text))
    made = {file.name.removeprefix("job") for file in (tmp_path / "output/job").glob("*-ensemble*")}
    assert made == listed - {"-ensemble.png"} | {"-ensemble-1.png", "-ensemble-2.png"}
    scope: dict = {}
    for block in blocks(text, "python"):
        exec(compile(block, "simulation.md", "exec"), scope)
    assert scope["found"].status == ("done",) * 16


def test_simulation_page_names_every_distribution(page):
    told = re.findall(
        r"^\| `(\w+)` \| [^|]*\|$", page("reference/simulation.md").split("## Ensembles")[1], re.MULTILINE
    )
    assert set(told) == set(DISTRIBUTIONS) == set(DistributionTable.model_fields)


def test_simulation_page_names_every_joint_and_table(page):
    text = page("reference/simulation.md")
    for kind in JointTable.model_json_schema()["properties"]["type"]["enum"]:
        assert f"`{kind}`" in text, kind
    fields = [name for name in Pipeline.model_fields if name not in ForceElements.model_fields]
    tables = {"bodies", *ForceElements.model_fields, *fields[fields.index("joints") : fields.index("simulation")]}
    listed = set(re.findall(r"\[(\w+)(?:\.X)?\]`", text.split("## Tables of a system")[1].split("## Values")[0]))
    assert listed == tables


def test_analysis_block_runs(page, tmp_path):
    """A boom on a wall, with the hinge and the names of the block."""
    (block,) = blocks(page("reference/analysis.md"), "toml")
    mp.write_body(uniform_beam(modes=2), tmp_path / "boom.h5")
    system = '[bodies.boom]\nfile = "boom.h5"\n[joints.hinge]\ntype = "revolute"\nchild = "boom.root"\nstiffness = 20\n'
    (tmp_path / "job.toml").write_text(system + block)
    assert main(["analyse", str(tmp_path / "job.toml")]) == 0
    made = {file.name for file in (tmp_path / "output/job").iterdir()}
    assert {"job-analysis.json", "job-response.png", "job-state-space.mat", "job-inverse.csv"} <= made


def test_tutorial_has_every_command(page):
    shown = set(re.findall(r"bin/modalprep (\w+)", page("tutorials/first-body.md")))
    assert shown == {command.name or command.callback.__name__ for command in app.registered_commands}


def test_pages_name_pipelines_that_exist(project):
    for file in (project / "docs").rglob("*.md"):
        for name in re.findall(r"pipelines/([\w-]+\.toml)", file.read_text()):
            assert (project / "pipelines" / name).exists(), f"{file}: {name}"


def test_element_page(page, capsys):
    """Its TOML is valid where a material and a mesh are added; its Python runs."""
    text = page("reference/elements.md")
    for table in map(tomllib.loads, blocks(text, "toml")):
        Pipeline.model_validate({"mesh": {"file": "a.msh"}} | table)
    for block in blocks(text, "python"):
        exec(compile(block, "elements.md", "exec"), {})
    assert len(capsys.readouterr().out.splitlines()) == 2


def test_element_page_names_every_type(page):
    families = page("reference/elements.md").split("## Node sets")[0]
    sections = {get_args(table.model_fields["type"].annotation)[0] for table in get_args(get_args(Section)[0])}
    assert set(re.findall(r"^\| `(\w+)` \|", families, re.MULTILINE)) - {"type"} == sections


def test_page_of_meshes_has_every_mesh(page, project):
    text = page("reference/meshes.md")
    files = {file.name for file in (project / "meshes").glob("*.msh")}
    assert set(re.findall(r"`([\w-]+\.msh)`", text)) == files
    for script in re.findall(r"(meshes/\w+\.py)", text):
        assert (project / script).exists(), script
