"""Batches: grids, the road of a single run, what is finished, what fails, and what is said."""

import errno
import io
import json
import multiprocessing
import os
import re
import tomllib
from pathlib import Path

import pytest
from batches import Inline, manifests, same_body, write_beam, write_grid
from rich.console import Console

import modalprep as mp
from modalprep.atomic import write_json
from modalprep.cli import main
from modalprep.errors import OutputError
from modalprep.pipeline.batch.console import Progress
from modalprep.pipeline.batch.grid import find_jobs
from modalprep.pipeline.batch.job import Job, Setting
from modalprep.pipeline.batch.manifest import input_digests
from modalprep.pipeline.batch.task import JobTask
from modalprep.pipeline.batch.work import work
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.load import load
from modalprep.program import program
from modalprep.workers.processes import Processes
from modalprep.workers.shares import THREADS, share_threads


@pytest.fixture
def job(project, tmp_path):
    return Job(write_beam(project, tmp_path / "beam.toml"), None)


@pytest.fixture
def setting():
    return Setting(None, 1e9, program())


@pytest.fixture
def inline(monkeypatch):
    monkeypatch.setattr("modalprep.pipeline.batch.dispatch.Processes", Inline)


def batch(capsys, *arguments):
    """Run a batch; return its exit code and manifest."""
    code = main(["batch", *map(str, arguments), "--json"])
    return code, json.loads(capsys.readouterr().out)


def ran(manifest):
    return [row["job"] for row in manifest["jobs"] if row["ran"]]


def test_a_resumed_batch_shares_the_processors_as_the_first(project, tmp_path, capsys, monkeypatch):
    """Linear algebra on other numbers of threads sums in another order: results would differ in the last bits."""
    sizes = []

    class Counted(Inline):
        def __init__(self, size, task, limits):
            super().__init__(size, task)
            sizes.append(size)

    monkeypatch.setattr("modalprep.pipeline.batch.dispatch.Processes", Counted)
    grid = write_grid(project, tmp_path / "beam.toml", reduction__modes=[1, 2])
    for _ in range(2):
        assert batch(capsys, grid, "-j", 4, "--output", tmp_path / "out")[0] == 0
        next((tmp_path / "out").glob("*/manifest.json")).unlink(missing_ok=True)
    assert sizes == [2, 2]


def test_grid(project, tmp_path, capsys):
    """Every combination runs once, by the road of `modalprep run`; one that cannot does not stop the others."""
    file = write_grid(project, tmp_path / "beam.toml", reduction__modes=[2, -1], materials__alloy__rho=[3e3, 3300.0])
    code, done = batch(capsys, file, "-j", 2)
    names = [f"beam-modes={modes}-rho={rho}" for modes in (2, -1) for rho in ("3000.0", "3300.0")]
    assert [row["job"] for row in done["jobs"]] == names
    assert (code, done["failed"]) == (1, 2)
    failed = {row["job"]: row["cause"] for row in done["jobs"] if row["status"] == "failed"}
    assert list(failed) == names[2:]
    assert all("[reduction.modes]: input should be greater than or equal to 0" in cause for cause in failed.values())
    for name, mass in zip(names[:2], (12.0, 13.2), strict=True):
        made, alone = tmp_path / "output" / name / f"{name}.h5", tmp_path / "alone" / name / f"{name}.h5"
        assert mp.read_body(made).m == pytest.approx(mass)
        assert mp.read_body(made).name == "beam"
        assert main(["run", str(made.with_suffix(".toml")), "--output", str(tmp_path / "alone")]) == 0
        assert same_body(made, alone, tolerance=1e-9)  # a worker's BLAS has fewer threads: other sums, same numbers
    assert json.loads((tmp_path / "output" / "batch.json").read_text()) == done


def test_finished_jobs_are_not_run_again(inline, project, tmp_path, capsys):
    """A job runs again when an output is lost or changed, or when anything that went in is another."""
    mesh = tmp_path / "own.msh"
    mesh.write_text((project / "meshes" / "beam.msh").read_text())
    files = [write_beam(project, tmp_path / f"{name}.toml", modes=2) for name in ("a", "b", "c", "d", "e")]
    files[4].write_text(files[4].read_text().replace(str(project / "meshes" / "beam.msh"), "own.msh"))
    pattern = tmp_path / "*.toml"
    code, first = batch(capsys, pattern, "-j", 2)
    assert (code, ran(first)) == (0, ["a", "b", "c", "d", "e"])
    assert ran(batch(capsys, pattern)[1]) == []
    (tmp_path / "output" / "a" / "a.html").unlink()
    page = tmp_path / "output" / "b" / "b.html"
    page.write_text(page.read_text().replace("Hz", "hz"))
    files[2].write_text(files[2].read_text() + "# a comment\n")
    mesh.write_text(mesh.read_text().replace("10 0 0", "11 0 0"))
    code, second = batch(capsys, pattern, "-j", 2)
    assert (code, ran(second)) == (0, ["a", "b", "c", "e"])
    assert mp.read_body(tmp_path / "output" / "e" / "e.h5").m == pytest.approx(13.2)
    assert ran(batch(capsys, pattern)[1]) == []


def test_another_program_runs_them_again(job, setting, tmp_path, monkeypatch):
    from modalprep.pipeline.batch.plan import plan_batch

    assert work(job, setting)["status"] == "done"
    assert plan_batch([str(job.file)], None).waiting == []
    monkeypatch.setattr("modalprep.pipeline.batch.plan.program", lambda: program() | {"modalprep": "0.0.1"})
    assert plan_batch([str(job.file)], None).waiting == [job]


def test_manifest_of_a_job(job, setting):
    """It has the hashes of all that went in and came out, versions, times, and what the cache did."""
    record = work(job, setting)
    assert json.loads(job.manifest.read_text()) == {"format": "modalprep job", "version": 1, **record}
    assert {Path(name).name for name in record["inputs"]} == {"beam.toml", "beam.msh"}
    assert set(record["outputs"]) == {"beam.h5", "beam.html", "beam-effective-mass.png"}
    assert all(len(value) == 64 for value in (*record["inputs"].values(), *record["outputs"].values()))
    assert record["program"] == program()
    assert record["seconds"] > 0
    assert "Mode selection" in job.log.read_text()


def test_tables_of_points_are_inputs_of_a_job(project, tmp_path):
    """A job whose force follows another file is another job, though no mesh and no body changed."""
    system = '[bodies.bob]\nmass = 1.0\n[joints.way]\ntype = "prismatic"\nchild = "bob.root"\n'
    push = '[forces.push]\nat = "bob.root"\nforce = [0, { file = "push.csv" }, 0]\n'
    (tmp_path / "system.toml").write_text(f"{system}{push}[simulation]\nt_end = 0.01\n")
    (tmp_path / "push.csv").write_text("0, 0\n1, 2\n")
    before = input_digests(load(tmp_path / "system.toml"))
    (tmp_path / "push.csv").write_text("0, 0\n1, 3\n")
    after = input_digests(load(tmp_path / "system.toml"))
    assert before["system.toml"] == after["system.toml"]
    assert before["push.csv"] != after["push.csv"]


def test_a_body_is_made_before_the_system(inline, project, tmp_path, capsys):
    """The pipeline that makes a body goes first, and makes it once."""
    write_beam(project, tmp_path / "beam.toml", modes=2)
    system = '[bodies.arm]\npipeline = "beam.toml"\n[synthesis]\nmodes = 2\n[output]\npictures = "none"\n'
    (tmp_path / "a-system.toml").write_text(system + '[welds.wall]\nbetween = ["ground", "arm.root"]\n')
    code, done = batch(capsys, tmp_path / "*.toml")
    assert code == 0, done
    rows = {row["job"]: row for row in done["jobs"]}
    inputs = json.loads(Path(rows["a-system"]["manifest"]).read_text())["inputs"]
    assert {Path(name).name for name in inputs} == {"a-system.toml", "beam.toml", "beam.msh"}
    assert rows["a-system"]["started"] >= rows["beam"]["started"]
    assert "mesh to modal body" not in (tmp_path / "output" / "a-system" / "a-system.log").read_text()
    assert ran(batch(capsys, tmp_path / "*.toml")[1]) == []


def test_the_cache_lies_beside_the_outputs(inline, project, tmp_path, capsys):
    """It serves the second job; without it nothing is stored."""
    file = write_grid(project, tmp_path / "beam.toml", reduction__modes=[2, 3])
    assert batch(capsys, file, "--no-cache")[0] == 0
    assert not (tmp_path / "output" / ".cache").exists()
    code, done = batch(capsys, file, "--output", tmp_path / "other")
    rows = {row["job"]: row["cache"] for row in done["jobs"]}
    assert code == 0
    assert rows["beam-modes=3"]["found"] == 0  # the larger number goes first
    assert rows["beam-modes=2"]["found"] > 0
    assert list((tmp_path / "other" / ".cache").glob("*.stage"))
    for name in ("beam-modes=2", "beam-modes=3"):
        made = (tmp_path / place / name / f"{name}.h5" for place in ("output", "other"))
        assert same_body(*made, tolerance=1e-9)


def test_list(project, tmp_path, capsys):
    """The jobs and their values, and nothing is run."""
    file = write_grid(project, tmp_path / "beam.toml", reduction__modes=[2, 3])
    assert main(["batch", str(file), "--list"]) == 0
    printed = capsys.readouterr().out
    assert "beam-modes=2" in printed
    assert "reduction.modes" in printed
    assert "waiting" in printed
    assert manifests(tmp_path / "output") == {}


@pytest.mark.parametrize(("exported", "threads"), [(None, "3"), ("8", "3"), ("1", "1"), ("many", "3")])
def test_exported_threads_do_not_overrule_the_share_of_a_job(monkeypatch, exported, threads):
    """Eight jobs of eight threads each would share eight processors; fewer than the share are respected."""
    for name in THREADS:
        monkeypatch.setenv(name, "")  # so that all are as before in the end
    if exported:
        monkeypatch.setenv("OMP_NUM_THREADS", exported)
    share_threads(3)
    assert os.environ["OMP_NUM_THREADS"] == threads


def test_a_process_that_dies_fails_its_own_job_only(job, setting):
    """As when the machine runs out of memory: the cause is told, and another process takes the next job."""
    team = Processes(1, JobTask(setting))
    try:
        team.submit(job)
        assert team.free == 0
        for process in multiprocessing.active_children():
            process.kill()
        ((ended, record),) = team.collect(30.0)
        assert ended is job
        assert record["status"] == "failed"
        assert "SIGKILL" in record["cause"]
        team.submit(job)
        ((_, record),) = team.collect(60.0)
        assert record["status"] == "done", record
    finally:
        team.close()
    assert multiprocessing.active_children() == []


def test_a_fault_of_the_program_fails_its_own_job_only(job, setting, monkeypatch):
    def fault(*args):
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr("modalprep.pipeline.batch.work.run_pipeline", fault)
    record = work(job, setting)
    assert record["cause"].startswith("ZeroDivisionError: division by zero (see its log: ")
    assert "Traceback" in job.log.read_text()
    monkeypatch.setattr("modalprep.pipeline.batch.work.run_pipeline", lambda *args: exit(3))  # as meshio does
    assert work(job, setting)["cause"].startswith("SystemExit: 3")


def test_a_finished_job_is_not_worked_on_again(job, setting, monkeypatch):
    """As when a worker of a cluster is lost after its job was done, and before it was told."""
    record = work(job, setting)
    monkeypatch.setattr("modalprep.pipeline.batch.work.run_pipeline", None)
    assert work(job, setting) == record


def test_a_worker_with_another_program_refuses(job):
    record = work(job, Setting(None, 1e9, program() | {"numpy": "1.0"}))
    assert record["cause"] == "its worker has a different numpy; install the same there"


def test_a_closed_folder_fails_its_own_job_only(inline, project, tmp_path, capsys):
    """A file where its folder should be: the others are done; in the end one message, and exit code 2."""
    for name in ("a", "b"):
        write_beam(project, tmp_path / f"{name}.toml")
    (tmp_path / "output").mkdir()
    (tmp_path / "output" / "a").touch()
    assert main(["batch", str(tmp_path / "*.toml")]) == 2
    out, error = capsys.readouterr()
    cause = f"cannot write {tmp_path / 'output' / 'a' / 'a.log'}: "
    assert f"a failed: {cause}" in out
    assert error.startswith("modalprep: cannot write the files of 1 of 2 jobs; make room")
    rows = json.loads((tmp_path / "output" / "batch.json").read_text())["jobs"]
    assert [row["status"] for row in rows] == ["failed", "done"]


def no_room(path, *args):
    raise OutputError(f"cannot write {path}: No space left on device; choose another --output folder")


def test_no_room_for_the_manifest_of_a_job(job, setting, monkeypatch):
    """The job would not be known for finished."""
    monkeypatch.setattr("modalprep.pipeline.batch.manifest.atomic_path", no_room)
    record = work(job, setting)
    assert (record["status"], record["error"]) == ("failed", "OutputError")
    assert record["cause"].startswith(f"cannot write {job.manifest}: No space")


def test_no_room_for_the_log(job, setting, monkeypatch):
    """Where the run wants to say something."""

    def full(*args):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("modalprep.pipeline.batch.work.run_pipeline", full)
    assert work(job, setting)["cause"].startswith(f"cannot write {job.log}: No space")


def test_no_room_for_the_manifest_of_the_batch(inline, project, tmp_path, capsys, monkeypatch):
    """From its second time on: the jobs go on, and in the end it is told."""
    left = [write_json]
    monkeypatch.setattr(
        "modalprep.pipeline.batch.keep.write_json", lambda data, path: (left or [no_room]).pop()(data, path)
    )
    for name in ("a", "b"):
        write_beam(project, tmp_path / f"{name}.toml")
    assert main(["batch", str(tmp_path / "*.toml")]) == 2
    assert set(manifests(tmp_path / "output")) == {"a", "b"}
    assert capsys.readouterr().err.startswith("modalprep: cannot write ")


def test_a_damaged_file_is_one_failed_job(inline, project, tmp_path, capsys):
    write_beam(project, tmp_path / "good.toml")
    (tmp_path / "damaged.toml").write_text("[mesh\n")
    write_beam(project, tmp_path / "lost.toml").write_text('[mesh]\nfile = "no.msh"\n[properties]\n')
    code, done = batch(capsys, tmp_path / "*.toml")
    causes = {row["job"]: row["cause"] for row in done["jobs"]}
    assert code == 1
    assert "is not valid TOML" in causes["damaged"]
    assert "no.msh" in causes["lost"]
    assert causes["good"] == ""


GRIDS = {
    "grid = 3": "[grid] is empty",
    "[grid]": "[grid] is empty",
    "[grid]\nreduction.modes = [1]": "in quotes",
    '[grid]\n"reduction.modes" = 3': "needs a list of values",
    '[grid]\n"reduction.modes" = []': "needs a list of values",
    '[grid]\n"reduction.modes" = [3, 3]': "lists a value twice",
    '[grid]\n"reduction.modez" = [3, 4]': "unknown key 'modez'",
    '[grid]\n"reduction.modes.x" = [3]': "which is not a table",
}


@pytest.mark.parametrize("grid", GRIDS)
def test_bad_grids(project, tmp_path, capsys, grid):
    file = write_beam(project, tmp_path / "beam.toml")
    file.write_text(f"{grid}\n{file.read_text()}" if grid == "grid = 3" else f"{file.read_text()}{grid}\n")
    assert main(["batch", str(file)]) == 2
    error = capsys.readouterr().err
    assert GRIDS[grid] in error
    assert error.count("\n") == 1
    assert not (tmp_path / "output").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["{folder}/no-*.toml"], "no pipeline file matches"),
        (["{folder}"], "is a folder; name the pipeline files in it"),
        (["{folder}/a.toml", "-j", "0"], "at least 1"),
        (["{folder}/a.toml", "-j", "2", "--scheduler", "tcp://127.0.0.1:1"], "leave it out with --scheduler"),
        (["{folder}/a.toml", "--cache", "x", "--no-cache"], "contradict"),
        (["{folder}/a.toml", "--cache-size", "0"], "must be positive"),
        (["{folder}/a.toml", "{folder}/b/a.toml", "--output", "{folder}/out"], "would both write into"),
        (["{folder}/a.toml", "--output", "{folder}/a.toml/out"], "cannot write"),
        ([], "Missing argument"),
    ],
)
def test_bad_batches(project, tmp_path, capsys, arguments, message):
    (tmp_path / "b").mkdir()
    for name in ("a.toml", "b/a.toml"):
        write_beam(project, tmp_path / name)
    assert main(["batch", *(text.format(folder=tmp_path) for text in arguments)]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert {path.name for path in tmp_path.iterdir()} == {"a.toml", "b"}


def test_other_commands_say_what_runs_a_grid(project, tmp_path, capsys):
    file = write_grid(project, tmp_path / "beam.toml", reduction__modes=[2, 3])
    assert main(["run", str(file)]) == 2
    assert f"write modalprep batch {file}" in capsys.readouterr().err


def test_folders_are_named_by_the_values(project, tmp_path):
    """Unique and good for every file system; files are found from the new place."""
    (tmp_path / "own.msh").write_text((project / "meshes" / "beam.msh").read_text())
    keep = ["all", "frequency < 5 Hz", "frequency > 5 Hz"]
    file = write_grid(project, tmp_path / "beam.toml", reduction__keep=keep, mesh__file=["own.msh", "../x y.msh"])
    jobs = find_jobs([str(file)], tmp_path / "far" / "out")
    assert [job.name for job in jobs][:3] == [
        "beam-keep=all_1-file=own.msh",
        "beam-keep=all_1-file=x_y.msh",
        "beam-keep=frequency_5_Hz_2-file=own.msh",
    ]
    data = [tomllib.loads(job.file.read_text()) for job in jobs]
    assert [d["reduction"]["keep"] for d in data[::2]] == keep
    assert (jobs[0].folder / data[0]["mesh"]["file"]).resolve() == tmp_path / "own.msh"
    assert (jobs[1].folder / data[1]["mesh"]["file"]).resolve() == tmp_path.parent / "x y.msh"
    both = write_grid(project, tmp_path / "two.toml", materials__alloy__E=[7e10], properties__beam__A=[4e-4])
    assert find_jobs([str(both)], None)[0].name == "two-E=70000000000.0-A=0.0004"
    alike = write_grid(project, tmp_path / "two.toml", plate__h=[1], beam__h=[2])
    with pytest.raises(mp.InputError, match="no combination"):
        find_jobs([str(alike)], None)


def test_time_left(monkeypatch):
    """Two of six jobs took 4 s in the mean, two workers: eight seconds, less what runs already."""
    now = [0.0]
    monkeypatch.setattr("modalprep.pipeline.batch.console.time.perf_counter", lambda: now[0])
    reporter = Reporter()
    reporter.console = Console(file=io.StringIO(), width=120)
    jobs = [Job(Path(f"{name}.toml"), None) for name in ("a", "[b]", *"cdef")]
    with Progress(reporter, 6, Inline(2, None)) as progress:
        for job, seconds in zip(jobs, (3.0, 5.0), strict=False):
            progress.started(job)
            progress.ended(job, {"status": "done", "seconds": seconds, "cause": ""})
        assert progress.seconds_left() == pytest.approx(8.0)
        progress.started(jobs[2])
        now[0] = 3.0
        assert progress.seconds_left() == pytest.approx(6.5)
        now[0] = 30.0  # a slow one: no more than its mean is known
        assert progress.seconds_left() == pytest.approx(6.0)
        progress.ended(jobs[2], {"status": "failed", "seconds": 30.0, "cause": "no mesh"})
    lines = reporter.console.file.getvalue().splitlines()
    assert lines[0] == "[1/6] a done in 3.0 s; about 8 s left"
    assert lines[2].startswith("[3/6] c failed in 30.0 s; about ")
    assert lines[2].endswith(": no mesh")


def test_bar_on_a_terminal():
    """The bar names what runs, counts, and says what is left."""
    reporter = Reporter()
    reporter.console = Console(file=io.StringIO(), width=100, force_terminal=True, color_system=None)
    jobs = [Job(Path(f"{name}.toml"), None) for name in ("a", "[b]", *"cdef")]
    with Progress(reporter, 6, Inline(5, None)) as progress:
        for job in jobs[:5]:
            progress.started(job)
        progress.tick()
        progress.ended(jobs[0], {"status": "done", "seconds": 10.0, "cause": ""})
        progress.tick()
    shown = reporter.console.file.getvalue()
    assert "[b], c, d and 1 more" in shown
    assert "1/6" in shown
    assert "about 10 s left" in shown


def test_page(project, tmp_path):
    """The grid of its page makes four valid jobs of the bracket, and its command is known."""
    page = (project / "docs" / "how-to" / "batch.md").read_text()
    (block,) = (text for text in re.findall(r"```toml\n(.*?)```", page, re.DOTALL) if "[grid]" in text)
    (tmp_path / "pipelines").mkdir()
    (tmp_path / "meshes").symlink_to(project / "meshes")
    file = tmp_path / "pipelines" / "bracket.toml"
    file.write_text((project / "pipelines" / "bracket.toml").read_text() + block)
    jobs = find_jobs([str(file)], None)
    assert [load(job.file).pipeline.reduction.modes for job in jobs] == [10, 10, 20, 20]
    named = set(re.findall(r"`(bracket-\w+=[\w=.-]+)`", page))
    assert named
    assert named <= {job.name for job in jobs}
