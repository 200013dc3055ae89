"""The workers of a Dask cluster."""

from __future__ import annotations

import logging
import math
import queue
import uuid
from collections import Counter
from concurrent.futures import CancelledError
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from time import monotonic, sleep
from typing import TYPE_CHECKING, Any

from modalprep.errors import ClusterError
from modalprep.extras import need
from modalprep.program import program
from modalprep.workers.on_worker import LostJobError, UnfitWorkerError, itself, run
from modalprep.workers.scheduler import Scheduler, connect
from modalprep.workers.team import UNLIMITED, Limits, Task

if TYPE_CHECKING:
    from distributed import Future

LOOK = 2.0  # s between two looks at which workers there are
LOST = 30.0  # s after which a scheduler that does not answer has gone
AGAIN = 5.0  # s after which a worker that could not run a job is tried again, as a shared folder may need some time
PATIENCE = 20.0  # s in which one of the workers should be able to run a job
KEPT = "what had ended is kept, and the same command goes on from there"
LOGS = "distributed", "tornado", "asyncio"
AGAIN = 3  # times that a job is given to the cluster after the scheduler has let go of it
AHEAD = 200  # jobs that wait at the scheduler, from whose number a queue's system sees how many workers pay


class Cluster:
    """The workers of a Dask cluster that have the same program, and see the same files.

    The scheduler gives a job of a lost worker to another one. Workers may come and go; where there is none yet, jobs
    wait.

    Parameters
    ----------
    scheduler : Scheduler
    task : Task
    limits : Limits
    mark : (Path, str) or None
        A file that the workers must see, and its first line.

    Attributes
    ----------
    refused : dict of str
        Why workers run no jobs, by their address.
    dashboard : str
        Address of the scheduler's page; empty without one.

    Raises
    ------
    InputError
        When `distributed` is not installed, or no scheduler answers.
    """

    def __init__(
        self, scheduler: Scheduler, task: Task, limits: Limits = UNLIMITED, mark: tuple[Path, str] | None = None
    ) -> None:
        self._scheduler = scheduler
        self._task = task
        self._limits = limits
        self._mark = mark
        need("distributed", "a scheduler")
        self._levels = _quiet()
        self._client, self._started = connect(scheduler)
        self.dashboard = self._client.dashboard_link or ""
        self._name = uuid.uuid4().hex
        self._ended: queue.SimpleQueue[Future] = queue.SimpleQueue()
        self._running: dict[Future, Any] = {}
        self._waiting: list[Any] = []  # for a worker that can run them
        self._again: Counter[int] = Counter()  # how often jobs were given to the cluster again, by id
        self._workers: dict[str, int] = {}  # threads by address
        self._unfit: dict[str, float] = {}  # when workers could not run a job
        self.refused: dict[str, str] = {}
        self._said: list[str] = []
        self._looked = -LOOK
        self._answered = monotonic()
        self._useless = math.inf
        self._hold()
        self._look()

    def _hold(self) -> None:
        """Give the task to the cluster once, for all jobs."""
        self._held = self._client.submit(itself, self._task, pure=False)

    @property
    def _usable(self) -> dict[str, int]:
        return {address: threads for address, threads in self._workers.items() if address not in self._unfit}

    @property
    def size(self) -> int:
        """Number of jobs that run at the same time: threads of the workers that can run them."""
        return max(1, sum(self._usable.values()))

    @property
    def free(self) -> int:
        """Jobs that may be submitted now."""
        return AHEAD + self.size - len(self._running) - len(self._waiting)

    def submit(self, job: Any) -> None:
        """Queue a job at the scheduler, or here as long as no worker can run it."""
        if self._unfit and not self._usable:
            self._waiting.append(job)
            return
        only: dict[str, Any] = {"workers": list(self._usable)} if self._unfit else {}
        future = self._client.submit(
            run,
            self._held,
            job,
            self._name,
            self._limits,
            program(),
            self._mark,
            pure=False,
            retries=self._limits.retries,
            resources=self._scheduler.resources or None,
            **only,
        )
        self._running[future] = job
        future.add_done_callback(self._ended.put)

    def collect(self, seconds: float) -> list[tuple[Any, Any]]:
        """Wait at most so long for a job to end; return those that did.

        Raises
        ------
        ClusterError
            When the scheduler has gone, or all workers are unfit.
        """
        if self._client.status != "running":
            self._connect_again()
        if monotonic() - self._looked > LOOK:
            self._look()
        ended = [future for future in self._wait(seconds) if future in self._running]
        done = [future for future in ended if future.status == "finished"]
        results = self._gather(done) if done else {}
        return [each for future in ended if (each := self._end(future, results)) is not None]

    def _wait(self, seconds: float) -> list[Future]:
        found = []
        with suppress(queue.Empty):
            found.append(self._ended.get(timeout=seconds))
            while True:
                found.append(self._ended.get_nowait())
        return found

    def _gather(self, futures: list[Future]) -> dict[Future, Any]:
        """Return the results of jobs; where one is lost with its worker, those of none."""
        try:
            results: Any = self._client.gather(futures)
            return dict(zip(futures, results, strict=True))
        except (OSError, TimeoutError, CancelledError, LostJobError, UnfitWorkerError):
            return {}

    def _end(self, future: Future, results: dict[Future, Any]) -> tuple[Any, Any] | None:
        """Return a job and its outcome; None where it is given to the cluster again."""
        if future.status == "cancelled" and self._client.status != "running":
            return None  # it is submitted again with the connection
        job = self._running.pop(future)
        error = future.exception() if future.status == "error" else None
        if isinstance(error, UnfitWorkerError):
            self._refuse(*error.args)
            return self.submit(job)
        self._useless = math.inf
        if future in results:
            return job, results[future]
        if future.status in ("finished", "pending"):  # its result was lost on the way
            return self.submit(job)
        if error is None and self._again[id(job)] < AGAIN:  # the scheduler let go of it, with a worker that has gone
            self._again[id(job)] += 1
            if self._held.status in ("cancelled", "lost", "error"):
                self._hold()
            return self.submit(job)
        said = " ".join(str(error or "the scheduler has let go of it").split())
        return job, self._task.lost(job, said if isinstance(error, LostJobError) else f"lost by the cluster: {said}")

    def _refuse(self, address: str, cause: str) -> None:
        """Give no more jobs to a worker, for some time."""
        self.refused[address] = cause
        self._unfit[address] = monotonic()
        self._useless = min(self._useless, monotonic())

    def _look(self) -> None:
        """Find which workers there are.

        Raises
        ------
        ClusterError
            When the scheduler does not answer, or none of its workers can run a job.
        """
        self._looked = monotonic()
        with suppress(OSError, TimeoutError, ValueError):
            client: Any = self._client
            self._workers = client.sync(client.scheduler.ncores, workers=None, callback_timeout=LOST / 3)
            self._answered = monotonic()
        if monotonic() - self._answered > LOST:
            raise ClusterError(f"{self._scheduler} does not answer; {KEPT}")
        if self._workers and not self._usable and monotonic() - self._useless > PATIENCE:
            address, cause = next(iter(self.refused.items()))
            raise ClusterError(f"no worker of {self._scheduler} can run the jobs: the one at {address} {cause}")
        self._unfit = {address: since for address, since in self._unfit.items() if monotonic() - since < AGAIN}
        waiting = self._waiting
        self._waiting = []
        for job in waiting:
            self.submit(job)

    def _connect_again(self) -> None:
        """Wait for the scheduler to come back, and give it the jobs again.

        Raises
        ------
        ClusterError
            When it does not.
        """
        end = monotonic() + LOST
        while self._client.status != "running":
            if monotonic() > end or self._client.status == "closed":
                raise ClusterError(f"{self._scheduler} has gone; {KEPT}")
            sleep(LOOK / 10)
        jobs = list(self._running.values())
        self._running = {}
        self._answered = monotonic()
        self._hold()
        self._look()
        for job in jobs:
            self.submit(job)

    def news(self) -> list[str]:
        """Return what is new about the workers, in sentences."""
        said = [f"what the workers do is shown at {self.dashboard}"] if self.dashboard else []
        said += [f"the worker at {address} gets no jobs: it {cause}" for address, cause in self.refused.items()]
        if self._usable:
            said.append(f"workers: {len(self._usable)}, which run {self.size} jobs at a time")
        elif not self._workers:
            said.append("no worker has come yet; the jobs wait for one")
        new = [line for line in said if line not in self._said]
        self._said = said
        return new

    def close(self) -> None:
        """Stop the jobs that run, and disconnect; a cluster that was started here ends."""
        there = self._client.status == "running" and monotonic() - self._answered < LOST
        with suppress(OSError, TimeoutError, ValueError):
            if there:
                self._client.cancel([*self._running, self._held], force=True)
            self._client.close(timeout=LOST if there else 0.1)
        if self._started is not None:
            with suppress(OSError, TimeoutError, ValueError):
                self._started.close()
        for log, level in self._levels.items() if there else ():  # a lost connection is told for some time
            log.setLevel(level)


def _quiet() -> dict[logging.Logger, int]:
    """Silence the logs of Dask, since what matters is said in sentences here; return their levels."""
    import_module("distributed")
    names = [name for name in logging.root.manager.loggerDict if name.split(".")[0] in LOGS]
    levels = {log: log.level for log in map(logging.getLogger, names)}
    for log in levels:
        log.setLevel(logging.CRITICAL)
    return levels
