"""A batch that is killed at any moment goes on where it was; nothing outlives it.

It is killed some times, and twenty times at the full size (`MODALPREP_FULL=1`).
"""

import os
import random
import signal
import time

import pytest
from bad.forks import forks
from batches import manifests, outlived, same_body, started, write_grid
from outputs import all_whole, differing
from size import KILLS, some

from modalprep.pipeline.batch.plan import plan_batch
from modalprep.workers.shares import THREADS

JOBS = 4
ALONE = os.environ | dict.fromkeys(THREADS, "1")  # so that two workers and one do the same sums


@pytest.fixture(scope="module")
def grid(project, tmp_path_factory):
    folder = tmp_path_factory.mktemp("grid")
    return write_grid(project, folder / "beam.toml", reduction__modes=[2, 3], reduction__damping=[0.01, 0.02])


@pytest.fixture(scope="module")
def finish(grid, tmp_path_factory):
    """Return ``finish(output, *options)``, which runs what is left in a fork: workers would take longer to start."""

    def run(output, *options):
        code, error, _ = server.run("batch", grid, "-j", 1, "--output", output, *options)
        assert (code, error) == (0, "")
        return output

    with forks(tmp_path_factory.mktemp("forks")) as server:
        yield run


@pytest.fixture(scope="module")
def whole(grid, finish):
    """The outputs of a batch that nobody disturbed."""
    return finish(grid.parent / "whole", "--no-cache")


def gone(process, seconds=20.0):
    """Wait until no process of a batch is left."""
    end = time.monotonic() + seconds
    while outlived(process) and time.monotonic() < end:
        time.sleep(0.05)
    return not outlived(process)


def until_more_than(count, process, output):
    """Wait until more jobs have ended: from there on anything may be under way."""
    while process.poll() is None and len(manifests(output)) <= count:
        time.sleep(0.01)


def under_way(output):
    """The logs of jobs that have begun and not ended, in the order of their beginning."""
    logs = {(log, log.stat().st_mtime_ns) for log in output.glob("*/*.log")}
    return {(log, moment) for log, moment in logs if log.parent.name not in manifests(output)}


def killed(grid, output, options, moments, seconds):
    """Kill a batch some time after a job has begun, or has ended; return its code, and whether that hit one under way.

    What was finished before is whole and is not run again.
    """
    before, lost = manifests(output), under_way(output)
    begun, ended = (lambda: not under_way(output) <= lost), (lambda: len(manifests(output)) > len(before))
    happened = moments.choice([begun, ended])
    with started(grid, "-j", 2, "--output", output, *options, env=ALONE) as process:
        while process.poll() is None and not happened():
            time.sleep(0.01)
        time.sleep(moments.uniform(0, seconds))
        if process.poll() is None:  # itself, or its workers too
            moments.choice([os.kill, os.killpg])(process.pid, signal.SIGKILL)
        process.communicate()
        assert gone(process)
    after = manifests(output)
    assert all(after[name] == record for name, record in before.items())
    assert len(plan_batch([str(grid)], output).before) == len(after)
    assert all_whole(output)
    return process.returncode, process.returncode == -signal.SIGKILL and begun()


@pytest.mark.slow
@pytest.mark.parametrize("options", [["--no-cache"], []], ids=["computed", "cached"])
def test_killed_at_random_moments(grid, whole, finish, tmp_path, options):
    """Always into the same folder until all is done, then into another: in the end, what an undisturbed batch makes."""
    moments, outputs, kills = random.Random(3), [tmp_path / "0"], 0
    seconds = 2 * sum(record["seconds"] for record in manifests(whole).values()) / JOBS
    wanted = -(-KILLS // 2)
    for _ in range(5 * wanted):
        code, hit = killed(grid, outputs[-1], options, moments, seconds)
        kills += hit
        seconds *= 1 if code else 0.8  # it had ended before
        if kills == wanted:
            break
        if len(manifests(outputs[-1])) == JOBS:
            outputs.append(tmp_path / str(len(outputs)))
    assert kills == wanted
    for output in outputs:
        before = manifests(output)
        after = manifests(finish(output, *options))
        assert len(after) == JOBS
        assert all(after[name] == record for name, record in before.items())
        if options:
            assert differing(output, whole) == []
        for name in after:  # fewer modes may come from the cache
            pair = (folder / name / f"{name}.h5" for folder in (output, whole))
            assert same_body(*pair, tolerance=1e-9)


@pytest.mark.slow
def test_workers_end_with_the_batch(project, tmp_path):
    """In the middle of a job that would take minutes: its target cannot be met by less than hundreds of modes."""
    text = (project / "pipelines" / "bracket.toml").read_text().replace("../meshes", str(project / "meshes"))
    endless = text.replace("modes = 20\n", "modes = 20\nup_to = 1e5\ntarget_error = 1e-9\n")
    assert endless != text
    (tmp_path / "bracket.toml").write_text(endless)
    with started(tmp_path / "bracket.toml", "--no-cache") as process:
        log = tmp_path / "output" / "bracket" / "bracket.log"
        while process.poll() is None and not (log.exists() and "mesh to modal body" in log.read_text()):
            time.sleep(0.01)
        time.sleep(0.5)
        process.kill()
        process.wait()
        assert gone(process, 10.0)
    assert "mesh to modal body" in log.read_text()  # what it said until then can be read
    assert not (log.parent / "manifest.json").exists()


@pytest.mark.slow
@pytest.mark.parametrize("seconds", some([0.2, 0.5, 1.0], 2))
def test_interrupted_while_the_workers_start(grid, tmp_path, seconds):
    """They import for a second, and would say where they were."""
    with started(grid, "-j", 2, "--output", tmp_path, preexec_fn=heed_ctrl_c) as process:
        assert process.stdout.readline().startswith("4 jobs")
        time.sleep(seconds)
        os.killpg(process.pid, signal.SIGINT)
        _, error = process.communicate(timeout=30)
        assert (process.returncode, error) == (130, "modalprep: interrupted\n")
    assert manifests(tmp_path) == {}


@pytest.mark.slow
def test_interrupted_by_the_user(grid, tmp_path):
    """Ctrl-C, which a terminal sends to every process: one line, exit code 130, nobody and no temporary file left."""
    with started(grid, "-j", 2, "--output", tmp_path, preexec_fn=heed_ctrl_c) as process:
        until_more_than(0, process, tmp_path)
        os.killpg(process.pid, signal.SIGINT)
        _, error = process.communicate(timeout=30)
        assert (process.returncode, error) == (130, "modalprep: interrupted\n")
        assert gone(process)
    assert not list(tmp_path.rglob("*.part*"))
    assert len(plan_batch([str(grid)], tmp_path).before) == len(manifests(tmp_path)) >= 1


def heed_ctrl_c():
    """A shell that starts the tests in the background has them ignore it."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
