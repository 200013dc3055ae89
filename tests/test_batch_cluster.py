"""Batches on a Dask cluster: a scheduler and workers of this machine, one of them killed midway."""

import json
import os
import subprocess
import sys
import time
from contextlib import ExitStack

import pytest
from batches import manifests, started, write_grid

from modalprep.cli import main

distributed = pytest.importorskip("distributed")
MODES = [2, 3, 4, 5, 6, 7, 8, 9]


def module(name, *arguments):
    command = [sys.executable, "-m", f"distributed.cli.{name}", *map(str, arguments)]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


@pytest.fixture
def scheduler(tmp_path):
    """Address of a scheduler without workers."""
    file = tmp_path / "scheduler.json"
    process = module("dask_scheduler", "--host", "127.0.0.1", "--port", 0, "--no-dashboard", "--scheduler-file", file)
    try:
        until(lambda: file.is_file() and file.read_text().rstrip().endswith("}"), 60)
        yield json.loads(file.read_text())["address"]
    finally:
        process.kill()
        process.wait()


@pytest.fixture
def workers(scheduler, tmp_path):
    """Two workers of one thread, each killed by a single signal (no nanny)."""
    own = ["--nthreads", 1, "--no-nanny", "--no-dashboard", "--local-directory", tmp_path / "dask"]
    with ExitStack() as stack:
        found = [module("dask_worker", scheduler, *own) for _ in range(2)]
        for process in found:
            stack.callback(process.wait)
            stack.callback(process.kill)
        with distributed.Client(scheduler, timeout="60s", set_as_default=False) as client:
            client.wait_for_workers(2, timeout=60)
        yield found


def until(condition, seconds):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


@pytest.mark.slow
def test_a_worker_killed_midway(project, tmp_path, scheduler, workers):
    """Its jobs go to the other one, and all of them are done."""
    file, output = write_grid(project, tmp_path / "beam.toml", reduction__modes=MODES), tmp_path / "output"
    with started(file, "--scheduler", scheduler, "--json") as process:
        until(lambda: len({record["worker"] for record in manifests(output).values()}) == 2, 120)
        with distributed.Client(scheduler, timeout="60s", set_as_default=False) as client:
            pids = client.run(os.getpid)
            held = {pids[address]: jobs for address, jobs in client.processing().items()}
        assert held[workers[0].pid]  # it has something to lose
        workers[0].kill()
        printed, error = process.communicate(timeout=120)
        assert process.returncode == 0, printed + error
    rows = json.loads(printed)["jobs"]
    assert [row["status"] for row in rows] == ["done"] * len(MODES)
    pids = [int(row["worker"].rpartition(":")[2]) for row in rows]
    assert set(pids) == {process.pid for process in workers}


def test_no_scheduler(project, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("modalprep.pipeline.workers.ANSWER", "1s")
    file = write_grid(project, tmp_path / "beam.toml", reduction__modes=[2])
    assert main(["batch", str(file), "--scheduler", "tcp://127.0.0.1:9"]) == 2
    error = capsys.readouterr().err
    assert "no Dask scheduler answers at tcp://127.0.0.1:9" in error
    assert error.count("\n") == 1


def test_no_workers(project, tmp_path, capsys, scheduler):
    file = write_grid(project, tmp_path / "beam.toml", reduction__modes=[2])
    assert main(["batch", str(file), "--scheduler", scheduler]) == 2
    assert "has no workers; start some with: dask worker" in capsys.readouterr().err
