"""A process that runs one job after the other, and can be ended."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing import connection, resource_tracker
from time import monotonic
from typing import Any

from modalprep.workers.shares import share_threads
from modalprep.workers.team import Limits, Task

GIB = 2**30  # bytes


class Process:
    """A spawned process and the pipe to it: the task and then jobs go in, outcomes come out.

    Parameters
    ----------
    threads : int
        Of its linear algebra.
    task : Task

    Attributes
    ----------
    pipe : Connection
        It has an outcome to read, or is closed when the process has ended.
    """

    def __init__(self, threads: int, task: Task) -> None:
        context = multiprocessing.get_context("spawn")
        multiprocessing.current_process().daemon = False  # as a worker of Dask it is, and could start no process
        self.pipe, other = context.Pipe()
        self._process = context.Process(target=_serve, args=(other, threads), daemon=True)
        with _ignore_interrupts():
            self._process.start()
        other.close()  # so that the pipe closes with the process
        self._began, self._excess = 0.0, ""
        self._send(task)

    def begin(self, job: Any) -> None:
        """Give it a job."""
        self._began = monotonic()
        self._send(job)

    def _send(self, what: Any) -> None:
        with suppress(OSError):  # it died: the pipe is found closed
            self.pipe.send(what)

    def hold(self, limits: Limits) -> None:
        """Kill the process when its job exceeds a limit."""
        self._excess = self._excess or self._exceeded(limits)
        if self._excess:
            self.kill()

    def _exceeded(self, limits: Limits) -> str:
        if limits.seconds is not None and monotonic() - self._began > limits.seconds:
            return f"it was ended after {limits.seconds:g} s, the limit of a job; allow more by --job-time"
        if limits.memory is not None and self._memory() > limits.memory:
            allowed = f"{limits.memory / GIB:.3g} GiB"
            return (
                f"it was ended when it took more than {allowed} of memory, the limit of a job; allow more by "
                "--job-memory, run fewer jobs on a worker, or take a coarser mesh"
            )
        return ""

    def _memory(self) -> int:
        import psutil

        try:
            return psutil.Process(self.pid).memory_info().rss
        except psutil.Error:
            return 0

    def exit_report(self) -> str:
        """Report how the process ended."""
        self._process.join()
        code = self._process.exitcode
        if self._excess:
            return self._excess
        if code is not None and code < 0:
            return f"its process was ended by {signal.Signals(-code).name}{_reason(-code)}"
        return f"its process ended by itself with exit code {code}"

    @property
    def pid(self) -> int:
        """Number of the process."""
        return self._process.pid or 0

    def kill(self) -> None:
        """End the process at once."""
        self._process.kill()

    def stop(self) -> None:
        """End the process, and close its pipe."""
        self.kill()
        self._process.join()
        self.pipe.close()


@contextmanager
def _ignore_interrupts() -> Iterator[None]:
    """Start processes that ignore Ctrl-C; in this process it is deferred until they have started."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    resource_tracker.ensure_running()  # starting it later would reset the mask
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _reason(number: int) -> str:
    reasons = {"SIGKILL": ", as happens when memory runs out", "SIGSEGV": ", a fault inside a library"}
    return reasons.get(signal.Signals(number).name, "")


def _serve(pipe: connection.Connection, threads: int) -> None:
    """Run jobs until the pipe closes; the parent handles Ctrl-C and stops its workers."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    share_threads(threads)
    with suppress(EOFError, OSError):
        task = pipe.recv()
        while True:
            pipe.send(task.run(pipe.recv()))


def _end_with_parent() -> None:
    """End this process as soon as its parent has ended."""
    if parent := multiprocessing.parent_process():
        connection.wait([parent.sentinel])
    os._exit(1)
