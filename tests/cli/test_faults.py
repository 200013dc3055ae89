"""Killed at any time, disk full, folders that cannot be written: final files are whole or absent, and a run goes on.

A command is killed some times, and twenty times at the full size (`MODALPREP_FULL=1`).
"""

import json
import os
import random
import shutil
import signal
import tempfile
from pathlib import Path

import pytest
from bad import good
from bad.forks import forks
from outputs import all_whole, contents
from size import KILLS

NOBODY = 65534
JOB = good.BEAM + good.HINGE + '[[plots]]\ny = "hinge.angle"\n'
GRID = good.BEAM + '[grid]\n"reduction.modes" = [2, 3]\n'


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Three files to run; all may read them, also a user without rights."""
    folder = Path(tempfile.mkdtemp())
    folder.chmod(0o755)
    shutil.copy(good.MESHES / "beam.msh", folder)
    for name, text in (("job", JOB), ("grid", GRID)):
        (folder / f"{name}.toml").write_text(text)
    yield folder
    shutil.rmtree(folder)


@pytest.fixture(scope="module")
def warm(folder, tmp_path_factory):
    """The process that forks; the solver is compiled then, which is not what is to be killed."""
    with forks(tmp_path_factory.mktemp("forks")) as server:
        server.run("run", folder / "job.toml", "--output", folder / "warm")
        yield server


COMMANDS = {
    "run": ["run", "job.toml"],
    "simulate": ["simulate", "job.toml"],
    "batch": ["batch", "grid.toml", "--no-cache", "-j", "1"],
}
ALONE = ("run", "simulate")  # tests/pipeline/batch/test_fault_injection.py kills batches


def given(command, folder, output):
    name, file, *options = COMMANDS[command]
    return [name, folder / file, *options, "--output", output]


@pytest.fixture(scope="module")
def undisturbed(warm, folder):
    """What each command makes, and how long it takes."""
    found = {}
    for name in ALONE:
        code, error, seconds = warm.run(*given(name, folder, folder / f"whole-{name}"))
        assert (code, error) == (0, "")
        found[name] = contents(folder / f"whole-{name}"), seconds
    return found


@pytest.mark.slow
@pytest.mark.parametrize("command", ALONE)
def test_killed_at_random_times(warm, folder, undisturbed, command):
    """Always into the same folder: in the end, what an undisturbed run makes, to the last bit."""
    whole, seconds = undisturbed[command]
    output, moments, kills = folder / f"killed-{command}", random.Random(command), 0
    for _ in range(3 * KILLS):
        moment = moments.uniform(0, seconds)
        code, _, _ = warm.run(*given(command, folder, output), kill=moment)
        kills += code == -signal.SIGKILL
        seconds = seconds if code else moment  # it had ended before: a body that is there is not built again
        assert all_whole(output)
        if kills == KILLS:
            break
    assert kills == KILLS
    assert warm.run(*given(command, folder, output))[:2] == (0, "")
    assert contents(output) == whole


def test_the_same_input_gives_the_same_bytes(warm, folder, undisturbed):
    """In the process that has done it before, and in one that has not."""
    again = folder / "again"
    assert warm.run(*given("run", folder, again))[:2] == (0, "")
    assert contents(again) == undisturbed["run"][0]


@pytest.mark.parametrize("command", ALONE)
def test_full_disk(warm, folder, undisturbed, command):
    """Files may have so many bytes: one message, and what has its final name is whole."""
    sizes = sorted(len(data) for data in undisturbed[command][0].values() if isinstance(data, bytes))
    for limit in (1000, sizes[-1] - 1):
        output = folder / f"full-{command}-{limit}"
        code, error, _ = warm.run(*given(command, folder, output), limit=limit)
        assert all_whole(output)
        assert not [path for path in output.rglob("*") if ".part" in path.name]
        error = "".join(line for line in error.splitlines(True) if not line.startswith("OMP: "))  # wants a file too
        assert code == 2
        assert error.startswith("modalprep: cannot write ")
        assert "File too large" in error
        assert error.count("\n") == 1


def test_full_disk_of_a_batch(warm, folder):
    """The batch says in one message that it has no room; where one job has, it is done and the others say why not."""
    whole, output = folder / "whole-batch", folder / "full-batch"
    assert warm.run(*given("batch", folder, whole))[0] == 0
    largest = [max(path.stat().st_size for path in whole.glob(f"grid-modes={n}/*")) for n in (2, 3)]
    assert largest[0] < largest[1]
    for limit, words in ((1000, "batch.json"), (largest[0], "the files of 1 of 2 jobs")):
        code, error, _ = warm.run(*given("batch", folder, output), limit=limit)
        assert code == 2
        assert error.startswith("modalprep: cannot write ")
        assert words in error
        assert error.count("\n") == 1
        assert all_whole(output)
        assert not list(output.rglob("*.part*"))
    jobs = {row["job"]: row for row in json.loads((output / "batch.json").read_text())["jobs"]}
    assert jobs["grid-modes=2"]["status"] == "done"
    assert jobs["grid-modes=3"]["cause"].startswith("cannot write ")
    assert "File too large" in jobs["grid-modes=3"]["cause"]


@pytest.mark.parametrize("command", COMMANDS)
def test_folder_that_may_not_be_written(warm, folder, command):
    output = folder / f"closed-{command}"
    output.mkdir(mode=0o555)
    output = output if os.geteuid() else Path("/proc/closed")  # root may write everywhere but there
    code, error, _ = warm.run(*given(command, folder, output))
    assert code == 2
    assert error.startswith("modalprep: cannot write ")
    assert "choose another --output folder" in error
    assert error.count("\n") == 1


def test_file_that_may_not_be_read(warm, folder):
    (folder / "secret.toml").write_text(JOB)
    (folder / "secret.toml").chmod(0o000)
    user = NOBODY if os.geteuid() == 0 else None
    code, error, _ = warm.run("run", folder / "secret.toml", user=user)
    assert code == 2
    assert "secret.toml' is not readable" in error
    assert error.count("\n") == 1
