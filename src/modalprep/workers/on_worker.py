"""What a worker of a Dask cluster does: it says which program it has, and runs jobs."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from time import monotonic, sleep
from typing import Any

from modalprep.program import program
from modalprep.workers.process import Process
from modalprep.workers.shares import processors
from modalprep.workers.team import Limits, Task

LOOK = 0.2  # s between two looks at a job that runs
IDLE = 10.0  # s after which a process without a job is ended


class LostJobError(Exception):
    """The process of a job has ended; the text is the cause."""


class UnfitWorkerError(Exception):
    """A worker cannot run the jobs; its address, and why."""


def itself(task: Task) -> Task:
    """Return a task: as the result of a job it stays on the workers, and the scheduler can make it again.

    Examples
    --------
    >>> itself(3)
    3
    """
    return task


def unfit(wanted: dict[str, str], mark: tuple[Path, str] | None) -> str:
    """Return why this worker cannot run the jobs of a client; empty when it can.

    Parameters
    ----------
    wanted : dict of str
        Program of the client.
    mark : (Path, str) or None
        A file of the folder that clients and workers share, and its first line.

    Returns
    -------
    str
        The predicate of a sentence.

    Examples
    --------
    >>> unfit(program() | {"numpy": "1.0"}, None)
    'has a different numpy; install the same there'
    >>> unfit(program(), (Path("no/such/file"), ""))
    'does not see no/such/file; the folder must be shared with the workers, under the same path'
    """
    own = program()
    differing = [name for name in {**wanted, **own} if own.get(name) != wanted.get(name)]
    if differing:
        names = ", ".join(differing).replace("sources_sha256", "modalprep (its source files)")
        return f"has a different {names}; install the same there"
    if mark is not None and _first_line(mark[0]) != mark[1]:
        return f"does not see {mark[0]}; the folder must be shared with the workers, under the same path"
    return ""


def _first_line(file: Path) -> str | None:
    try:
        with file.open(encoding="utf-8") as lines:
            return lines.readline().rstrip("\n")
    except (OSError, ValueError):
        return None


def run(
    task: Task, job: Any, client: str, limits: Limits, wanted: dict[str, str], mark: tuple[Path, str] | None
) -> Any:
    """Run a job in a thread of a worker, until nobody waits for it.

    Parameters
    ----------
    task : Task
    job : object
    client : str
        Whose jobs share a process.
    limits : Limits
    wanted : dict of str
        Program of the client.
    mark : (Path, str) or None
        A file that the worker must see, and its first line.

    Raises
    ------
    UnfitWorkerError
        When the worker has another program, or does not see the file.
    LostJobError
        When the process of the job has ended.
    """
    from distributed import get_worker

    worker = get_worker()
    key = worker.get_current_task()
    if cause := unfit(wanted, mark):
        raise UnfitWorkerError(worker.address, cause)

    def stopped() -> bool:
        state = worker.state.tasks.get(key)
        return state is None or state.state != "executing" or worker.status.name not in ("running", "paused")

    if not task.own_process:
        outcome = task.run(job, stopped)
        if stopped():
            raise LostJobError("it was stopped")
        return outcome
    return _separately(task, job, client, _with_default(limits, worker), stopped, worker.state.nthreads)


def _with_default(limits: Limits, worker: Any) -> Limits:
    """Return the limits, of memory by default the share of the worker that a job has."""
    whole = worker.memory_manager.memory_limit
    if limits.memory is not None or not whole:
        return limits
    return replace(limits, memory=whole / worker.state.nthreads)


def _separately(task: Task, job: Any, client: str, limits: Limits, stopped: Callable[[], bool], threads: int) -> Any:
    process = ROOM.take(client, task, max(1, processors() // threads))
    process.begin(job)
    while not process.pipe.poll(LOOK):
        process.hold(limits)
        if stopped():
            process.kill()
    try:
        outcome = process.pipe.recv()
    except (EOFError, OSError):
        cause = process.exit_report()
        task.tidy(job, process.pid)
        raise LostJobError(cause) from None
    ROOM.put(client, process)
    return outcome


class Room:
    """The processes of a worker that wait for their next job; one without a job for long is ended."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._idle = []
        self._watched = False

    def take(self, client: str, task: Task, threads: int) -> Process:
        """Return a process of a client that has no job, or a new one."""
        with self._lock:
            for k, (whose, process, _) in enumerate(self._idle):
                if whose == client:
                    del self._idle[k]
                    return process
        return Process(threads, task)

    def put(self, client: str, process: Process) -> None:
        """Keep a process for the next job."""
        with self._lock:
            self._idle.append((client, process, monotonic()))
            if not self._watched:
                self._watched = True
                threading.Thread(target=self._watch, daemon=True).start()

    def _watch(self) -> None:
        while self._watched:
            sleep(IDLE / 10)
            with self._lock:
                for entry in [entry for entry in self._idle if monotonic() - entry[2] > IDLE]:
                    self._idle.remove(entry)
                    entry[1].stop()
                self._watched = bool(self._idle)


ROOM = Room()
