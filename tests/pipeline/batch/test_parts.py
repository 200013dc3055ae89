"""Parts of a batch that know nothing of each other, what is collected of them, and files that workers see."""

import json

import pytest
from batches import Inline, manifests, write_beam, write_grid

from modalprep.cli import main
from modalprep.pipeline.batch.batch import forecast
from modalprep.pipeline.batch.dispatch import Where
from modalprep.pipeline.batch.job import Job, Setting
from modalprep.pipeline.batch.manifest import input_digests
from modalprep.pipeline.batch.plan import Batch, Shard, plan_batch
from modalprep.pipeline.batch.work import work
from modalprep.pipeline.schema.load import load
from modalprep.program import program

ASSEMBLY = """
[bodies.arm]
pipeline = "{name}.toml"
[synthesis]
modes = 2
[output]
pictures = "none"
[welds.wall]
between = ["ground", "arm.root"]
"""


@pytest.fixture(autouse=True)
def inline(monkeypatch):
    monkeypatch.setattr("modalprep.pipeline.batch.dispatch.Processes", Inline)


@pytest.fixture
def several(project, tmp_path):
    """Two beams and an assembly of each."""
    for name in ("a", "b"):
        write_beam(project, tmp_path / f"{name}.toml", modes=2)
        (tmp_path / f"system-{name}.toml").write_text(ASSEMBLY.format(name=name))
    return tmp_path / "*.toml"


def names(batch):
    return {job.name for job in batch.jobs}


def test_parts_are_the_whole_and_keep_together_what_belongs_together(several):
    parts = [names(plan_batch([str(several)], None, Shard(k, 2))) for k in (1, 2)]
    assert parts == [{"a", "system-a"}, {"b", "system-b"}]
    three = [names(plan_batch([str(several)], None, Shard(k, 3))) for k in (1, 2, 3)]
    assert three == [*parts, set()]


def test_shards_and_their_collection(project, tmp_path, capsys):
    """Each part has a manifest of its own; together they are the batch, with what failed and what has not run."""
    file, output = write_grid(project, tmp_path / "beam.toml", reduction__modes=[2, -1, 3]), tmp_path / "output"
    assert main(["batch", str(file), "--shard", "1/3"]) == 0
    assert main(["batch", str(file), "--shard", "2/3"]) == 1
    assert set(manifests(output)) == {"beam-modes=2"}
    assert not (output / "index.html").exists()
    capsys.readouterr()
    assert main(["batch", str(file), "--collect", "--json"]) == 1
    rows = json.loads(capsys.readouterr().out)["jobs"]
    assert [row["status"] for row in rows] == ["done", "failed", "waiting"]
    assert main(["batch", str(file), "--shard", "3/3"]) == 0
    (output / "beam-modes=-1").rename(tmp_path / "away")
    file.write_text(file.read_text().replace("[2, -1, 3]", "[2, 3]"))
    assert main(["batch", str(file), "--collect"]) == 0
    assert len((output / "study.csv").read_text().splitlines()) == 3
    assert (output / "index.html").exists()
    assert {path.name for path in output.glob("batch*.jsonl")} == {f"batch-{k}-of-3.jsonl" for k in (1, 2, 3)}


@pytest.mark.parametrize("text", ["0/3", "4/3", "3", "a/b", "1/0"])
def test_bad_shards(project, tmp_path, capsys, text):
    assert main(["batch", str(write_beam(project, tmp_path / "beam.toml")), "--shard", text]) == 2
    assert f"--shard {text}: give the number of the part and how many there are" in capsys.readouterr().err


def test_a_line_for_each_job_as_it_ends(project, tmp_path):
    """The first line is of the batch; the others are the rows of its manifest."""
    file = write_grid(project, tmp_path / "beam.toml", reduction__modes=[2, 3])
    assert main(["batch", str(file)]) == 0
    first, *lines = map(json.loads, (tmp_path / "output" / "batch.jsonl").read_text().splitlines())
    rows = json.loads((tmp_path / "output" / "batch.json").read_text())["jobs"]
    assert first["format"] == "modalprep batch lines"
    assert sorted(lines, key=lambda row: row["job"]) == rows
    assert "inputs" not in rows[0]  # hashes are in the manifest of the job, once


def test_a_worker_that_sees_another_file_fails(project, tmp_path, monkeypatch):
    """A file of the same name in the folder of a worker was once computed, and called done."""
    monkeypatch.setattr("modalprep.pipeline.batch.work.PATIENCE", 0.0)
    job = Job(write_beam(project, tmp_path / "beam.toml", modes=2), None)
    there = input_digests(load(job.file)) | {"beam.toml": "f00"}
    record = work(job.at_home(there), Setting(None, 1e9, program()))
    assert record["status"] == "failed"
    assert f"sees another {tmp_path / 'beam.toml'} than the client" in record["cause"]
    assert work(job.at_home(input_digests(load(job.file))), Setting(None, 1e9, program()))["status"] == "done"


def test_the_log_of_a_job_is_there_while_it_runs(project, tmp_path, monkeypatch):
    """It was renamed at the end of the job, and lost with an interrupted one."""
    job, seen = Job(write_beam(project, tmp_path / "beam.toml", modes=2), None), []

    def interrupted(file, output, reporter, cache):
        reporter.say("half of it")
        seen.append(job.log.read_text())
        raise KeyboardInterrupt

    monkeypatch.setattr("modalprep.pipeline.batch.work.run_pipeline", interrupted)
    with pytest.raises(KeyboardInterrupt):
        work(job, Setting(None, 1e9, program()))
    assert seen == ["half of it\n"]
    assert job.log.read_text() == seen[0]


def test_forecast():
    """Two finished jobs of 3 s and 5 s, three to go: 4 s each, in two processes 6 s."""
    from pathlib import Path

    jobs = tuple(Job(Path(f"{name}.toml"), None) for name in "abcde")
    before = {jobs[0].file: {"seconds": 3.0}, jobs[1].file: {"seconds": 5.0}}
    batch = Batch(jobs, before, Path(), {}, {})
    assert forecast(batch, Where(jobs=2)) == "the other 3 jobs take about 4 s each, 6 s with -j 2"
