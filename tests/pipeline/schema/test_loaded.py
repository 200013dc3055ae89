"""A pipeline file is a value: each is read once, however many stages and bodies need it."""

import tomllib
from collections import Counter

import pytest
from batches import write_beam

from modalprep.cli import main
from modalprep.errors import InputError
from modalprep.pipeline.batch.job import Job, Setting
from modalprep.pipeline.batch.work import work
from modalprep.pipeline.schema.load import load
from modalprep.program import program

PARTS = """
[response.shaker]
kind = "harmonic"
lowest = 1.0
highest = 2.0
base = { z = 1.0 }
"""
SYSTEM = """
bodies = { one = { pipeline = "beam.toml" }, two = { pipeline = "../here/beam.toml" } }
[joints.wall]
type = "weld"
child = "one.root"
[joints.hinge]
type = "revolute"
child = "two.root"
[analysis]
modes = 1
[simulation]
t_end = 0.001
"""


@pytest.fixture
def parsed(monkeypatch):
    """How often each text was parsed as TOML."""
    counts, loads = Counter(), tomllib.loads
    monkeypatch.setattr(tomllib, "loads", lambda text: counts.update([text]) or loads(text))
    return counts


@pytest.fixture
def files(project, tmp_path):
    """A beam with a response, and a system of two such beams; one of them is named in another way."""
    (tmp_path / "here").mkdir()
    beam = write_beam(project, tmp_path / "here" / "beam.toml", modes=2)
    beam.write_text(beam.read_text() + PARTS)
    (tmp_path / "here" / "system.toml").write_text(SYSTEM)
    return beam, tmp_path / "here" / "system.toml"


@pytest.mark.parametrize("command", ["run", "simulate", "analyse"])
def test_each_file_is_parsed_once(files, parsed, command):
    beam, system = files
    assert main([command, str(system)]) == 0
    assert parsed == {file.read_text(): 1 for file in files}
    assert main(["run", str(beam)]) == 0
    assert parsed == {beam.read_text(): 2, system.read_text(): 1}


def test_a_worker_parses_each_file_once(files, parsed):
    """Also where the job was finished before and its mesh has changed, so that it runs again."""
    setting, job = Setting(None, 1e9, program()), Job(files[1], None)
    assert work(job, setting)["status"] == "done"
    assert parsed == {file.read_text(): 1 for file in files}
    (job.folder / "system-run.csv").unlink()
    assert work(job, setting)["status"] == "done"
    assert set(parsed.values()) == {2}


def test_a_body_is_found_by_the_name_of_its_table(files):
    """The folder of outputs has the name under which the system knows the file, also through a link."""
    (files[0].parent / "link.toml").symlink_to(files[0])
    files[1].write_text(SYSTEM.replace("../here/beam.toml", "link.toml"))
    system = load(files[1])
    one, two = (system.of_body(table.pipeline) for table in system.pipeline.bodies.values())
    assert (one.path.name, two.path.name) == ("beam.toml", "link.toml")
    assert one.pipeline is two.pipeline
    assert [file.path for file in system.files] == [files[1], two.path]


def test_a_file_that_names_itself_is_read_once(files, parsed):
    files[0].write_text(SYSTEM.replace("../here/beam.toml", "system.toml") + files[0].read_text())
    found = load(files[0])
    assert [file.path for file in found.files] == list(files)
    assert found.of_body("beam.toml").pipeline is found.pipeline
    assert set(parsed.values()) == {1}


def test_bodies_are_read_only_where_they_are_needed(files):
    files[0].unlink()
    with pytest.raises(InputError, match=r"pipeline file .*beam\.toml does not exist"):
        load(files[1]).files  # noqa: B018
