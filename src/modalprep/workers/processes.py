"""Local processes as workers."""

from __future__ import annotations

from multiprocessing import connection
from time import monotonic
from typing import Any

from modalprep.workers.process import Process
from modalprep.workers.shares import processors
from modalprep.workers.team import UNLIMITED, Limits, Task

LOOK = 0.2  # s between two looks at the limits of jobs


class Processes:
    """Local worker processes, with the processors divided among them for linear algebra.

    A process that dies, for lack of memory or by a fault of a library, is replaced; only its own job fails.

    Parameters
    ----------
    size : int
    task : Task
    limits : Limits
    """

    def __init__(self, size: int, task: Task, limits: Limits = UNLIMITED) -> None:
        self.size, self._task, self._limits = size, task, limits
        self._idle: list[Process] = []
        self._busy: dict[Process, tuple[Any, int]] = {}

    @property
    def free(self) -> int:
        """Jobs that may be submitted now."""
        return self.size - len(self._busy)

    def submit(self, job: Any) -> None:
        """Give a job to an idle process, or to a new one."""
        self._start(job, self._limits.retries)

    def _start(self, job: Any, retries: int) -> None:
        process = self._idle.pop() if self._idle else Process(max(1, processors() // self.size), self._task)
        self._busy[process] = job, retries
        process.begin(job)

    def collect(self, seconds: float) -> list[tuple[Any, Any]]:
        """Wait at most so long for a job to end; return those that did."""
        end = monotonic() + seconds
        found = []
        while not found and self._busy and (left := end - monotonic()) > 0:
            ended = connection.wait([process.pipe for process in self._busy], min(left, LOOK))
            found = [self._end(process) for process in list(self._busy) if process.pipe in ended]
            for process in self._busy:
                process.hold(self._limits)
        return [each for each in found if each is not None]

    def _end(self, process: Process) -> tuple[Any, Any] | None:
        """Return a job and its outcome; None where it is run again."""
        job, retries = self._busy.pop(process)
        try:
            outcome = process.pipe.recv()
        except (EOFError, OSError):
            cause = process.exit_report()
            self._task.tidy(job, process.pid)
            if retries:
                return self._start(job, retries - 1)
            return job, self._task.lost(job, cause)
        self._idle.append(process)
        return job, outcome

    def news(self) -> list[str]:
        """Return nothing: these workers are there from the beginning."""
        return []

    def close(self) -> None:
        """Stop the processes."""
        for process in (*self._idle, *self._busy):
            process.stop()
        for process, (job, _) in self._busy.items():
            self._task.tidy(job, process.pid)
