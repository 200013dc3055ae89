"""Workers of a Dask cluster: what is lost, killed, refused or stopped ends with its sentence, and the others finish."""

import os
import shutil
import time
from pathlib import Path

import psutil
import pytest
from clusters import address_in, end, scheduler_in, start_worker, until, workers_of
from tasks import Counted, Odd, Shared

import modalprep as mp
from modalprep.errors import ClusterError
from modalprep.examples import uniform_beam
from modalprep.program import program
from modalprep.workers.cluster import Cluster
from modalprep.workers.on_worker import IDLE, unfit
from modalprep.workers.scheduler import Scheduler
from modalprep.workers.team import UNLIMITED, Limits

pytest.importorskip("distributed")
GIB = 2**30
ROOT = Path(mp.__file__).parent


@pytest.fixture(scope="module")
def local(tmp_path_factory):
    """Address of a cluster of two workers of one thread and 0.5 GiB."""
    with scheduler_in(tmp_path_factory.mktemp("scheduler")) as (_, file):
        address = address_in(file)
        folders = [tmp_path_factory.mktemp("worker") for _ in range(2)]
        processes = [start_worker(folder, address, "--memory-limit", "0.5GiB") for folder in folders]
        until(lambda: len(workers_of(address)) == 2, 60)
        yield address
        end(processes)


@pytest.fixture
def team(local):
    """Return ``team(task, limits)``."""
    made = []

    def make(task, limits=UNLIMITED):
        made.append(Cluster(Scheduler(local), task, limits))
        return made[-1]

    yield make
    for each in made:
        each.close()


def outcomes(team, jobs, seconds=60.0):
    """Submit jobs, and return the outcome of each by its job."""
    for job in jobs:
        team.submit(job)
    latest, found = time.monotonic() + seconds, {}
    while len(found) < len(jobs):
        assert time.monotonic() < latest, f"only {found}"
        found |= dict(team.collect(0.5))
    return found


def test_jobs_run_in_processes_of_their_own(team, local):
    """Each worker keeps one process for the jobs of a client, and is not that process."""
    from distributed import Client

    found = outcomes(team(Odd()), [("pid", k) for k in range(20)])
    with Client(local, set_as_default=False) as client:
        workers = set(client.run(os.getpid).values())
    pids = {pid for _, pid in found.values()}
    assert 1 <= len(pids) <= 2
    assert not pids & workers


def test_the_task_is_sent_once(team):
    """A system of 4 MB once went with every block of an ensemble."""
    found = outcomes(team(counted := Counted()), [("ok", k) for k in range(20)])
    assert len(found) == 20
    assert counted.sent == 1


def test_a_job_that_the_scheduler_lets_go_of_is_given_to_it_again(team):
    """As it does with what a worker held that has just gone."""
    cluster = team(Odd())
    cluster.submit(("ok", 1))
    cluster._client.cancel([cluster._held, *cluster._running], force=True)
    found = {}
    until(lambda: found.update(cluster.collect(0.5)) or found, 60)
    assert found[("ok", 1)][0] == "ok"


def test_a_job_that_takes_too_much_memory_fails_alone(team, local):
    """Four workers were once killed by one such job; now each worker goes on, and the cause names the limit."""
    before = workers_of(local)
    found = outcomes(team(Odd()), [("take", GIB), *(("ok", k) for k in range(6))])
    said, cause = found.pop(("take", GIB))
    assert said == "lost"
    assert "more than 0.5 GiB of memory" in cause
    assert {what for what, _ in found.values()} == {"ok"}
    assert workers_of(local) == before


def test_a_job_that_never_ends(team):
    found = outcomes(team(Odd(), Limits(seconds=4.0)), [("sleep", 1000.0), *(("ok", k) for k in range(6))])
    assert "ended after 4 s, the limit of a job" in found.pop(("sleep", 1000.0))[1]
    assert {what for what, _ in found.values()} == {"ok"}


def test_a_process_that_dies_is_tried_again(team):
    """Twice more with two retries; its worker goes on."""
    found = outcomes(team(Odd(), Limits(retries=2)), [("kill", 0), ("ok", 0)])
    assert "SIGKILL" in found["kill", 0][1]
    assert found["ok", 0][0] == "ok"


@pytest.mark.parametrize("task", [Odd, Shared])
def test_what_nobody_waits_for_is_stopped(team, task):
    """As after Ctrl-C: the workers are free for others at once."""
    first = team(task())
    for k in range(4):
        first.submit(("sleep", 1000.0 + k))
    until(lambda: sum(map(len, first._client.processing().values())) >= 2, 30)
    first.close()
    assert set(outcomes(team(task()), [("ok", 0), ("ok", 1)], 20.0)) == {("ok", 0), ("ok", 1)}


@pytest.mark.slow
def test_processes_end_when_they_have_nothing_to_do(team):
    ((_, pid),) = outcomes(one := team(Odd()), [("pid", 0)]).values()
    assert psutil.pid_exists(pid)
    one.close()
    until(lambda: not psutil.pid_exists(pid), 2 * IDLE)


@pytest.fixture
def impatient(monkeypatch):
    """Look and give up soon."""
    for name, value in {"PATIENCE": 0.0, "LOOK": 0.1, "AGAIN": 0.2}.items():
        monkeypatch.setattr(f"modalprep.workers.cluster.{name}", value)


def test_another_program_gets_no_jobs(team, monkeypatch, impatient):
    """All workers are of another version: nothing is computed, and the error says which."""
    monkeypatch.setattr("modalprep.workers.cluster.program", lambda: program() | {"sources_sha256": "of yesterday"})
    with pytest.raises(ClusterError, match="has a different modalprep .its source files.; install the same there"):
        outcomes(team(Odd()), [("ok", 0)])


def test_one_worker_with_another_program(local, tmp_path):
    """One line of its elements differs: it gets no jobs, the others run them all, and it is said."""
    copy = shutil.copytree(ROOT, tmp_path / "modalprep", ignore=shutil.ignore_patterns("__pycache__"))
    with (copy / "fe" / "elements" / "truss.py").open("a") as file:
        file.write("# changed\n")
    known = workers_of(local)
    other = start_worker(tmp_path, local, source=[tmp_path])
    until(lambda: len(workers_of(local)) == 3, 60)
    team = Cluster(Scheduler(local), Odd())
    try:
        found = outcomes(team, [("ok", k) for k in range(40)])
        assert {what for what, _ in found.values()} == {"ok"}
        assert not set(team.refused) & set(known)
        assert any("gets no jobs: it has a different modalprep" in line for line in team.news())
    finally:
        team.close()
        end([other])
        until(lambda: len(workers_of(local)) == 2, 60)


def test_a_folder_that_workers_do_not_see(local, impatient, monkeypatch, tmp_path):
    mark = tmp_path / "batch.jsonl", "the batch"
    team = Cluster(Scheduler(local), Odd(), Limits(), mark)
    try:
        with pytest.raises(ClusterError, match="does not see .*batch.jsonl; the folder must be shared"):
            outcomes(team, [("ok", 0)])
        mark[0].write_text("the batch\nmore\n")
        monkeypatch.setattr("modalprep.workers.cluster.PATIENCE", 60.0)
        assert outcomes(team, [("ok", 1)])  # tried again, and able now
    finally:
        team.close()
    assert unfit(program(), mark) == ""


def test_an_ensemble_refuses_another_program(local, monkeypatch, impatient):
    monkeypatch.setattr("modalprep.workers.cluster.program", lambda: program() | {"numpy": "1.0"})
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="beam")
    system = mp.System(bodies={"beam": uniform_beam(modes=1)}, joints=(hinge,))
    with pytest.raises(ClusterError, match="different numpy"):
        mp.simulate_many(system, {"hinge.angle": [0.0, 1.0]}, 0.1, scheduler=local)


def test_a_scheduler_that_dies(tmp_path, monkeypatch):
    """The jobs that wait end with a sentence; `simulate_many` once waited for ever."""
    import dask

    monkeypatch.setattr("modalprep.workers.cluster.LOST", 1.0)
    quick = dask.config.set({"distributed.comm.timeouts.connect": "1s"})
    with quick, scheduler_in(tmp_path) as (process, file):
        worker = start_worker(tmp_path, address_in(file))
        team = Cluster(Scheduler(str(file)), Shared())
        try:
            assert outcomes(team, [("ok", 0)]) == {("ok", 0): ("ok", worker.pid)}
            team.submit(("sleep", 1000.0))
            process.kill()
            with pytest.raises(ClusterError, match="scheduler.json has gone; what had ended is kept"):
                outcomes(team, [("ok", 1)])
        finally:
            team.close()
            end([worker])


def test_a_scheduler_that_comes_back(tmp_path):
    """It knows nothing of the jobs, and gets them again."""
    with scheduler_in(tmp_path) as (process, file):
        address, worker = address_in(file), []
        team = Cluster(Scheduler(address), Odd())
        team.submit(("ok", 0))
        end([process])
        with scheduler_in(tmp_path, address.rpartition(":")[2]):
            worker.append(start_worker(tmp_path, address))
            found = {}
            until(lambda: found.update(team.collect(0.5)) or found, 60)
            assert set(found) == {("ok", 0)}
            team.close()
            end(worker)


def test_workers_that_come_later_are_counted(tmp_path):
    """With none at first, the jobs wait and it is said; "no workers yet" was refused."""
    with scheduler_in(tmp_path) as (_, file):
        team = Cluster(Scheduler(address_in(file)), Odd())
        assert (team.size, team.news()[-1]) == (1, "no worker has come yet; the jobs wait for one")
        worker = start_worker(tmp_path, address_in(file), "--nthreads", 3)
        assert outcomes(team, [("ok", 0)])["ok", 0][0] == "ok"
        until(lambda: not team.collect(0.1) and team.size == 3, 30)
        assert team.news() == ["workers: 1, which run 3 jobs at a time"]
        team.close()
        end([worker])
