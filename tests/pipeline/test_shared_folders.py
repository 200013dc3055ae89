"""Two files of one name in different folders: neither overwrites the outputs of the other in one output folder."""

from pathlib import Path

import pytest
from batches import write_beam, write_grid
from outputs import contents

from modalprep.cli import main
from modalprep.examples import uniform_beam
from modalprep.formats.modalfile import write_body

SYSTEM = """
[bodies.arm]
mass = {mass}
[joints.slide]
type = "prismatic"
child = "arm.root"
stiffness = 50.0
[simulation]
t_end = 0.01
[analysis]
about = "start"
"""
OF_BEAMS = """
bodies.a.pipeline = "a/beam.toml"
bodies.b.pipeline = "b/beam.toml"
joints.a = { type = "weld", child = "a.root" }
joints.b = { type = "weld", child = "b.root" }
simulation.t_end = 0.001
analysis.about = "start"
"""


def run(capsys, *arguments):
    """Return the exit code and all that a command printed."""
    code = main([str(argument) for argument in arguments])
    return code, "".join(capsys.readouterr())


@pytest.fixture
def two(tmp_path):
    """Two systems of one name."""
    files = [tmp_path / folder / "x.toml" for folder in "ab"]
    for file, mass in zip(files, (1.0, 2.0), strict=True):
        file.parent.mkdir()
        file.write_text(SYSTEM.format(mass=mass))
    return files


@pytest.mark.parametrize("command", ["run", "simulate", "analyse", "batch"])
def test_second_file_is_refused(two, tmp_path, capsys, command):
    first, second = two
    assert run(capsys, command, first, "--output", tmp_path / "out")[0] == 0
    before = contents(tmp_path / "out" / "x")
    for again in ("run", "simulate", "analyse", "batch"):
        code, said = run(capsys, again, second, "--output", tmp_path / "out")
        assert code == 2, said
        assert "would overwrite the outputs of" in said
    kept = contents(tmp_path / "out" / "x")
    assert {name: kept[name] for name in before} == before


def test_same_file_may_run_again(two, tmp_path, capsys):
    first, second = two
    for arguments in (["run", first], ["simulate", first], ["run", first, "--set", "simulation.rtol=1e-6"]):
        code, said = run(capsys, *arguments, "--output", tmp_path / "out")
        assert code == 0, said
    code, said = run(capsys, "run", second, "--set", "simulation.rtol=1e-6", "--output", tmp_path / "out")
    assert code == 2
    assert "would overwrite the outputs of" in said


def test_folder_of_a_file_that_is_gone_is_taken_over(two, tmp_path, capsys):
    first, second = two
    run(capsys, "run", first, "--output", tmp_path / "out")
    first.unlink()
    assert run(capsys, "run", second, "--output", tmp_path / "out")[0] == 0


def test_folders_may_move_together(two, tmp_path, capsys):
    first, _ = two
    assert run(capsys, "run", first)[0] == 0
    moved = first.parent.rename(tmp_path / "moved")
    assert run(capsys, "run", moved / "x.toml")[0] == 0


@pytest.mark.parametrize("command", ["run", "simulate", "analyse"])
def test_bodies_of_one_name_are_refused(project, tmp_path, capsys, command):
    """Both bodies would be written as out/beam/beam.h5."""
    for folder in "ab":
        (tmp_path / folder).mkdir()
        write_beam(project, tmp_path / folder / "beam.toml", modes=2)
    (tmp_path / "pair.toml").write_text(OF_BEAMS)
    code, said = run(capsys, command, tmp_path / "pair.toml", "--output", tmp_path / "out")
    assert code == 2
    assert "would both write into" in said
    assert not (tmp_path / "out").exists()


def test_grids_of_one_name_are_refused(project, tmp_path, capsys):
    for folder in "ab":
        (tmp_path / folder).mkdir()
        write_grid(project, tmp_path / folder / "x.toml", reduction__modes=[1, 2])
    assert run(capsys, "batch", tmp_path / "a" / "x.toml", "--output", tmp_path / "out", "--list")[0] == 0
    code, said = run(capsys, "batch", tmp_path / "b" / "x.toml", "--output", tmp_path / "out", "--list")
    assert code == 2
    assert "would overwrite the outputs of" in said


@pytest.fixture(scope="module")
def body():
    return uniform_beam(modes=3, elements=6)


OF_ONE_STEM = {  # two commands whose default outputs have one name
    "render": [("render", "a/arm.h5"), ("render", "b/arm.h5")],
    "import": [("import", "a/arm.op4"), ("import", "a/arm.sid")],
    "export": [("export", "a/arm.h5", "--to", "op4"), ("export", "a/arm.hdf5", "--to", "op4")],
    "compare": [("compare", "a/arm.h5", "a/test.h5"), ("compare", "a/arm.h5", "b/test.h5")],
}


@pytest.mark.parametrize("command", OF_ONE_STEM)
def test_default_outputs_of_one_stem_are_refused(body, rough_edges, tmp_path, monkeypatch, capsys, command):
    monkeypatch.chdir(tmp_path)
    for folder in "ab":
        write_body(body, Path(folder, "arm.h5"))
        write_body(body, Path(folder, "test.h5"))
    write_body(body, Path("a", "arm.hdf5"))
    first, second = OF_ONE_STEM[command]
    if command == "import":
        run(capsys, "export", "b/arm.h5", "--to", "op4", "-o", "a/arm.op4")
        run(capsys, "export", "b/arm.h5", "--to", "sid", "-o", "a/arm.sid")
        Path("a", "arm.h5").unlink()
    for _ in range(2):
        code, said = run(capsys, *first)
        assert code == 0, said
    before = contents(tmp_path)
    code, said = run(capsys, *second)
    assert code == 2
    assert "would overwrite the outputs of" in said
    assert contents(tmp_path) == before


def test_pages_of_one_name_are_refused(body, tmp_path, capsys):
    for folder in "ab":
        write_body(body, tmp_path / folder / "arm.h5")
    out = tmp_path / "out"
    for _ in range(2):
        assert run(capsys, "modes", tmp_path / "a" / "arm.h5", "--output", out)[0] == 0
    code, said = run(capsys, "modes", tmp_path / "b" / "arm.h5", "--output", out)
    assert code == 2
    assert "would overwrite the outputs of" in said
