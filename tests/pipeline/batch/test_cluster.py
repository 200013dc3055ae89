"""Batches on a Dask cluster: a scheduler and workers of this machine, one of them killed midway."""

import json
import os

import numpy as np
import pytest
from batches import manifests, started, write_grid
from clusters import address_in, end, scheduler_in, start_worker, until, workers_of

import modalprep as mp
from modalprep.cli import main
from modalprep.examples import beam_mesh, spinup_section

ASSEMBLY = """
[bodies.inner]
pipeline = "inner.toml"

[bodies.outer]
pipeline = "outer.toml"

[welds.wall]
between = ["ground", "inner.root"]

[welds.middle]
between = ["inner.tip", "outer.root"]

[synthesis]
modes = 10

[output]
pictures = "none"
"""
MODES = [2, 3, 4, 5, 6, 7, 8, 9]


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory):
    """Address of a scheduler, without workers but those of a test."""
    pytest.importorskip("distributed")
    with scheduler_in(tmp_path_factory.mktemp("scheduler")) as (_, file):
        yield address_in(file)


@pytest.fixture(scope="module")
def started_workers(scheduler):
    """All worker processes so far, ended with the last test."""
    processes = []
    yield processes
    end(processes)


@pytest.fixture
def workers(scheduler, started_workers, tmp_path_factory):
    """Two workers in folders of their own; those that still run are used again."""
    alive = [process for process in started_workers if process.poll() is None]
    started_workers += [start_worker(tmp_path_factory.mktemp("worker"), scheduler) for _ in range(2 - len(alive))]
    until(lambda: len(workers_of(scheduler)) == 2, 60)
    return [process for process in started_workers if process.poll() is None]


@pytest.mark.slow
def test_an_assembly_in_components(project, tmp_path, scheduler, workers):
    """Each half of a beam is reduced on a worker of its own, then both are joined: the frequencies of the uncut beam.

    The 12 modes of each half leave 1e-6, as in tests/pipeline/building/test_synthesis.py.
    """
    for name in ("inner", "outer"):
        half = (project / "pipelines" / "half-beam.toml").read_text().replace("../meshes", str(project / "meshes"))
        (tmp_path / f"{name}.toml").write_text(half)
    (tmp_path / "assembly.toml").write_text(ASSEMBLY)
    with started(*tmp_path.glob("*.toml"), "--scheduler", scheduler, "--json") as process:
        printed, error = process.communicate(timeout=120)
    assert process.returncode == 0, printed + error
    rows = {row["job"]: row for row in json.loads(printed)["jobs"]}
    assert rows["inner"]["worker"] != rows["outer"]["worker"]
    folder = tmp_path / "output" / "assembly"
    assert "mesh to modal body" not in (folder / "assembly.log").read_text()  # they were there
    root = {"root": mp.Interface(group="root", kind="node")}
    uncut = mp.assemble(beam_mesh(80, 20.0), {"beam": spinup_section()}, root)
    exact = mp.craig_bampton(uncut, modes=10, truncation=()).frequency
    found = json.loads((folder / "assembly-synthesis.json").read_text())["frequency_Hz"]
    np.testing.assert_allclose(found, exact, rtol=1e-6)


@pytest.mark.slow
def test_a_worker_killed_midway(project, tmp_path, scheduler, workers):
    """Its jobs go to the other one, and all of them are done; relative paths are those of the client."""
    from distributed import Client

    file, output = write_grid(project, tmp_path / "beam.toml", reduction__modes=MODES), tmp_path / "output"
    with started(file.name, "--scheduler", scheduler, "--json", "--output", "output", cwd=tmp_path) as process:
        until(lambda: len({record["worker"] for record in manifests(output).values()}) == 2, 120)
        with Client(scheduler, timeout="60s", set_as_default=False) as client:
            pids = client.run(os.getpid)
            held = {pids[address]: jobs for address, jobs in client.processing().items()}
        assert held[workers[0].pid]  # it has something to lose
        workers[0].kill()
        printed, error = process.communicate(timeout=120)
        assert process.returncode == 0, printed + error
    rows = json.loads(printed)["jobs"]
    assert [row["status"] for row in rows] == ["done"] * len(MODES)
    assert len({row["worker"] for row in rows}) == 2


def test_no_scheduler(project, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("modalprep.workers.scheduler.ANSWER", 1.0)
    file = write_grid(project, tmp_path / "beam.toml", reduction__modes=[2])
    assert main(["batch", str(file), "--scheduler", "tcp://127.0.0.1:9"]) == 2
    error = capsys.readouterr().err
    assert "no Dask scheduler answers at tcp://127.0.0.1:9" in error
    assert error.count("\n") == 1
