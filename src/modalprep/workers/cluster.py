"""The workers of a Dask cluster."""

from __future__ import annotations

import logging
import queue
import uuid
from concurrent.futures import CancelledError
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from time import monotonic, sleep
from typing import TYPE_CHECKING, Any

from modalprep.errors import ClusterError
from modalprep.extras import need
from modalprep.program import program
from modalprep.workers.on_worker import LostJobError, UnfitWorkerError, end_processes, itself, run, unfit
from modalprep.workers.scheduler import Scheduler, connect
from modalprep.workers.team import UNLIMITED, Limits, Task

if TYPE_CHECKING:
    from distributed import Future

LOOK = 2.0  # s between two looks at which workers there are
LOST = 30.0  # s after which a scheduler that does not answer has gone
PATIENCE = 20.0  # s in which workers that cannot run the jobs may become able to
LOGS = "distributed", "tornado", "asyncio"
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
        self._scheduler, self._task, self._limits, self._mark = scheduler, task, limits, mark
        need("distributed", "a scheduler")
        self._levels = _quiet()
        self._client, self._started = connect(scheduler)
        self.dashboard, self._name = self._client.dashboard_link or "", uuid.uuid4().hex
        self._ended: queue.SimpleQueue[Future] = queue.SimpleQueue()
        self._running: dict[Future, Any] = {}
        self._waiting: list[Any] = []  # for a worker that can run them
        self._threads: dict[str, int] = {}
        self.refused: dict[str, str] = {}
        self._said: list[str] = []
        self._looked, self._usable = -LOOK, monotonic()
        self._hold()
        self._look()

    def _hold(self) -> None:
        """Give the task to the cluster once, for all jobs."""
        self._held = self._client.submit(itself, self._task, pure=False)

    @property
    def size(self) -> int:
        """Number of jobs that run at the same time: threads of the workers that can run them."""
        return max(1, sum(self._threads.values()))

    @property
    def free(self) -> int:
        """Jobs that may be submitted now."""
        return AHEAD + self.size - len(self._running) - len(self._waiting)

    def submit(self, job: Any) -> None:
        """Queue a job at the scheduler, or here as long as no worker can run it."""
        if self.refused and not self._threads:
            self._waiting.append(job)
            return
        only = {"workers": list(self._threads)} if self.refused and self._threads else {}
        future = self._client.submit(
            run, self._held, job, self._name, self._limits, program(), pure=False, retries=self._limits.retries,
            resources=self._scheduler.resources or None, **only,
        )  # fmt: skip
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
        self._refuse_unfit()
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
            return dict(zip(futures, self._client.gather(futures), strict=True))
        except (OSError, TimeoutError, CancelledError, LostJobError, UnfitWorkerError):
            return {}

    def _end(self, future: Future, results: dict[Future, Any]) -> tuple[Any, Any] | None:
        """Return a job and its outcome; None where it is given to the cluster again."""
        if future.status == "cancelled" and self._client.status != "running":
            return None  # it is submitted again with the connection
        job = self._running.pop(future)
        if future in results:
            return job, results[future]
        if future.status in ("finished", "pending"):  # its result was lost on the way
            return self.submit(job)
        error = future.exception() if future.status == "error" else "the scheduler has let go of it"
        if isinstance(error, UnfitWorkerError):
            self._look()
            return self.submit(job)
        lost = str(error) if isinstance(error, LostJobError) else f"lost by the cluster: {' '.join(str(error).split())}"
        return job, self._task.lost(job, lost)

    def _look(self) -> None:
        """Find the workers that can run the jobs, and why others cannot."""
        self._looked = monotonic()
        try:
            threads = self._client.nthreads()
            new = [address for address in threads if address not in self._threads]
            found = self._ask(new) if new else {}
        except (OSError, TimeoutError, ValueError):
            return  # the connection says it
        self.refused = {address: cause for address, cause in found.items() if cause}
        self._threads = {address: count for address, count in threads.items() if address not in self.refused}
        if self._threads or not self.refused:
            self._usable = monotonic()
            waiting, self._waiting = self._waiting, []
            for job in waiting:
                self.submit(job)

    def _refuse_unfit(self) -> None:
        if self.refused and not self._threads and monotonic() - self._usable > PATIENCE:
            address, cause = next(iter(self.refused.items()))
            raise ClusterError(f"no worker of {self._scheduler} can run the jobs: the one at {address} {cause}")

    def _ask(self, workers: list[str]) -> dict[str, str]:
        answers = self._client.run(unfit, program(), self._mark, workers=workers, on_error="return")
        return {address: _cause(answer) for address, answer in answers.items()}

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
                raise ClusterError(
                    f"{self._scheduler} has gone; what had ended is kept, and the same command goes on from there"
                )
            sleep(LOOK / 10)
        jobs, self._running, self._threads = list(self._running.values()), {}, {}
        self._hold()
        self._look()
        for job in jobs:
            self.submit(job)

    def news(self) -> list[str]:
        """Return what is new about the workers, in sentences."""
        said = [f"what the workers do is shown at {self.dashboard}"] if self.dashboard else []
        said += [f"the worker at {address} gets no jobs: it {cause}" for address, cause in self.refused.items()]
        if self._threads:
            said.append(f"{len(self._threads)} workers run {self.size} jobs at a time")
        elif not self.refused:
            said.append("no worker has come yet; the jobs wait for one")
        new = [line for line in said if line not in self._said]
        self._said = said
        return new

    def close(self) -> None:
        """Stop the jobs that run, and disconnect; a cluster that was started here ends."""
        there = self._client.status == "running"
        with suppress(OSError, TimeoutError, ValueError):
            if there:
                self._end_jobs()
            self._client.close(timeout=LOST if there else 0.1)
        if self._started is not None:
            with suppress(OSError, TimeoutError, ValueError):
                self._started.close()
        for log, level in self._levels.items() if there else ():  # a lost connection is told for some time
            log.setLevel(level)

    def _end_jobs(self) -> None:
        self._client.cancel([*self._running, self._held], force=True)
        if self._threads and self._task.own_process:
            workers = list(self._threads)
            self._client.run(end_processes, self._name, workers=workers, wait=False, on_error="ignore")


def _quiet() -> dict[logging.Logger, int]:
    """Silence the logs of Dask, since what matters is said in sentences here; return their levels."""
    import_module("distributed")
    names = [name for name in logging.root.manager.loggerDict if name.split(".")[0] in LOGS]
    levels = {log: log.level for log in map(logging.getLogger, names)}
    for log in levels:
        log.setLevel(logging.CRITICAL)
    return levels


def _cause(answer: Any) -> str:
    """Return why a worker cannot run the jobs, from its answer or its error."""
    if isinstance(answer, str):
        return answer
    if isinstance(answer, ModuleNotFoundError):
        return f"has no {answer.name}: install the same program there as here"
    return f"does not answer: {' '.join(str(answer).split())}"
