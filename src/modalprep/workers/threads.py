"""Threads of this process as workers."""

from __future__ import annotations

from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from threading import Event
from typing import Any

from modalprep.workers.team import Task


class Threads:
    """Threads of this process, for jobs that spend most of their time in compiled code.

    Parameters
    ----------
    size : int
    task : Task
    """

    def __init__(self, size: int, task: Task) -> None:
        self.size = size
        self._task = task
        self._closed = Event()
        self._executor = ThreadPoolExecutor(size)
        self._running = {}

    @property
    def free(self) -> int:
        """Jobs that may be submitted now: each thread has the next one waiting."""
        return 2 * self.size - len(self._running)

    def submit(self, job: Any) -> None:
        """Queue a job."""
        self._running[self._executor.submit(self._task.run, job, self._closed.is_set)] = job

    def collect(self, seconds: float) -> list[tuple[Any, Any]]:
        """Wait at most so long for a job to end; return those that did."""
        done = wait(self._running, seconds, return_when=FIRST_COMPLETED).done
        return [(self._running.pop(future), future.result()) for future in done]

    def news(self) -> list[str]:
        """Return nothing: these workers are there from the beginning."""
        return []

    def close(self) -> None:
        """Ask the jobs that run to stop, and wait for them; those that have not begun are left out."""
        self._closed.set()
        self._executor.shutdown(cancel_futures=True)
