"""A batch that is killed at any moment goes on where it was; nothing outlives it."""

import os
import random
import signal
import time

import pytest
from batches import manifests, outlived, same_body, started, write_grid

from modalprep.pipeline.batch import plan_batch

KILLS = 3  # each costs the start of the processes again


@pytest.fixture(scope="module")
def grid(project, tmp_path_factory):
    folder = tmp_path_factory.mktemp("grid")
    return write_grid(project, folder / "beam.toml", reduction__modes=[2, 3, 4, 5], reduction__damping=[0.01, 0.02])


def finish(grid, output, *options):
    with started(grid, "-j", 2, "--output", output, *options) as process:
        printed, error = process.communicate()
        assert process.returncode == 0, printed + error
    return output


@pytest.fixture(scope="module")
def whole(grid):
    """The outputs of a batch that nobody disturbed."""
    return finish(grid, grid.parent / "whole", "--no-cache")


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


@pytest.mark.slow
def test_killed_at_random_moments(grid, whole, tmp_path):
    """What was finished is whole and is not run again; in the end the bodies are those of an undisturbed batch."""
    moments, before, kills = random.Random(3), {}, 0
    for _ in range(KILLS):
        with started(grid, "-j", 2, "--output", tmp_path) as process:
            until_more_than(len(before), process, tmp_path)
            time.sleep(moments.uniform(0, 0.7))
            process.kill()
            process.communicate()
            kills += process.returncode == -signal.SIGKILL
            assert gone(process)
        after = manifests(tmp_path)
        assert all(after[name] == record for name, record in before.items())  # neither lost nor run again
        assert len(plan_batch([str(grid)], tmp_path).before) == len(after)  # and each is whole
        before = after
    assert kills >= 2
    after = manifests(finish(grid, tmp_path))
    assert len(after) == 8
    assert all(after[name] == record for name, record in before.items())
    for name in after:
        pair = (folder / name / f"{name}.h5" for folder in (tmp_path, whole))
        assert same_body(*pair, tolerance=1e-9)  # fewer modes may come from the cache


@pytest.mark.slow
def test_workers_end_with_the_batch(project, tmp_path):
    """In the middle of a job that would take minutes: its target cannot be met by less than hundreds of modes."""
    text = (project / "pipelines" / "bracket.toml").read_text().replace("../meshes", str(project / "meshes"))
    endless = text.replace("modes = 20\n", "modes = 20\nup_to = 1e5\ntarget_error = 1e-9\n")
    assert endless != text
    (tmp_path / "bracket.toml").write_text(endless)
    with started(tmp_path / "bracket.toml", "--no-cache") as process:
        log = tmp_path / "output" / "bracket"
        while process.poll() is None and not list(log.glob(".*.part.log")):
            time.sleep(0.01)
        time.sleep(2)
        process.kill()
        process.wait()
        assert gone(process, 10.0)
    assert list(log.glob(".*.part.log"))  # it was under way, and has not ended by itself


@pytest.mark.slow
def test_interrupted_by_the_user(grid, tmp_path):
    """Ctrl-C, which a terminal sends to every process: one line, exit code 130, nobody left."""
    with started(grid, "-j", 2, "--output", tmp_path, preexec_fn=heed_ctrl_c) as process:
        until_more_than(0, process, tmp_path)
        os.killpg(process.pid, signal.SIGINT)
        _, error = process.communicate(timeout=30)
        assert (process.returncode, error) == (130, "modalprep: interrupted\n")
        assert gone(process)
    assert len(plan_batch([str(grid)], tmp_path).before) == len(manifests(tmp_path)) >= 1


def heed_ctrl_c():
    """A shell that starts the tests in the background has them ignore it."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
