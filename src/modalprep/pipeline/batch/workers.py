"""Workers of a batch: local processes or a Dask cluster.

Light to import: a worker process sets its threads before numpy is loaded.
"""

from __future__ import annotations

import math
import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import contextmanager, suppress
from multiprocessing import connection, resource_tracker
from typing import Any, Protocol

from modalprep.atomic import remove_temporary
from modalprep.errors import InputError
from modalprep.pipeline.batch.job import Job, Record, Setting, failure

THREADS = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
ANSWER = "30s"  # s, timeout of a scheduler


class Team(Protocol):
    """Workers of a batch.

    Attributes
    ----------
    size : int
        Number of concurrent jobs.
    """

    size: int

    @property
    def free(self) -> int:
        """Jobs that may be submitted now."""

    def submit(self, job: Job) -> None:
        """Start a job, or queue it."""

    def collect(self, seconds: float) -> list[tuple[Job, Record]]:
        """Wait at most so long for a job to end; return those that did."""

    def close(self) -> None:
        """Release the workers and stop running jobs."""


class Processes:
    """Local worker processes, with the processors divided among them for linear algebra.

    A process that dies, for lack of memory or by a fault of a library, is replaced; only its own job fails.

    Parameters
    ----------
    size : int
    setting : Setting
    """

    def __init__(self, size: int, setting: Setting) -> None:
        self.size, self._setting = size, setting
        self._idle: list[_Process] = []
        self._busy: dict[_Process, Job] = {}

    @property
    def free(self) -> int:
        """Jobs that may be submitted now."""
        return self.size - len(self._busy)

    def submit(self, job: Job) -> None:
        """Give a job to an idle process, or to a new one."""
        process = self._idle.pop() if self._idle else _Process(max(1, processors() // self.size))
        self._busy[process] = job
        process.start(job, self._setting)

    def collect(self, seconds: float) -> list[tuple[Job, Record]]:
        """Wait at most so long for a job to end; return those that did."""
        ended = connection.wait([process.pipe for process in self._busy], seconds)
        return [self._end(process) for process in list(self._busy) if process.pipe in ended]

    def _end(self, process: _Process) -> tuple[Job, Record]:
        job = self._busy.pop(process)
        try:
            record = process.pipe.recv()
            self._idle.append(process)
        except (EOFError, OSError):
            record = failure(job, process.exit_report())
            self._tidy(process, job)
        return job, record

    def close(self) -> None:
        """Stop the processes."""
        for process in (*self._idle, *self._busy):
            process.stop()
        for process, job in self._busy.items():
            self._tidy(process, job)

    def _tidy(self, process: _Process, job: Job) -> None:
        for folder in {job.folder.parent, self._setting.cache} - {None}:
            remove_temporary(folder, process.pid)


class _Process:
    """A spawned process and the pipe to it: jobs go in, records come out."""

    def __init__(self, threads: int) -> None:
        context = multiprocessing.get_context("spawn")
        self.pipe, other = context.Pipe()
        self._process = context.Process(target=_serve, args=(other, threads), daemon=True)
        with _ignore_interrupts():
            self._process.start()
        other.close()  # so that the pipe closes with the process

    def start(self, job: Job, setting: Setting) -> None:
        with suppress(OSError):  # it died: `collect` finds the pipe closed
            self.pipe.send((job, setting))

    def exit_report(self) -> str:
        """Report how the process ended."""
        self._process.join()
        code = self._process.exitcode
        if code is not None and code < 0:
            return f"its process was ended by {signal.Signals(-code).name}{_reason(-code)}"
        return f"its process ended by itself with exit code {code}"

    @property
    def pid(self) -> int:
        return self._process.pid

    def stop(self) -> None:
        self._process.kill()
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


def processors() -> int:
    """Return the number of processors that this program may use.

    Examples
    --------
    >>> processors() >= 1
    True
    """
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _serve(pipe: connection.Connection, threads: int) -> None:
    """Run jobs until the pipe closes; the parent handles Ctrl-C and stops its workers."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    share_threads(threads)
    from modalprep.pipeline.batch.work import work

    with suppress(EOFError, OSError):
        while True:
            pipe.send(work(*pipe.recv()))


def share_threads(threads: int) -> None:
    """Let the linear algebra of this process use its share of the processors, before numpy is loaded.

    Examples
    --------
    >>> before = dict(os.environ)
    >>> share_threads(1)
    >>> os.environ["OMP_NUM_THREADS"]
    '1'
    >>> os.environ.update(before)
    """
    for name in THREADS:
        os.environ[name] = str(min(threads, _exported(name)))


def _exported(name: str) -> float:
    """Return the number of threads that the user's environment allows; a share of the processors may be less."""
    text = os.environ.get(name, "")
    return max(1, int(text)) if text.isdecimal() else math.inf


def _end_with_parent() -> None:
    """End this process as soon as its parent has ended."""
    connection.wait([multiprocessing.parent_process().sentinel])
    os._exit(1)


class Cluster:
    """The workers of a Dask cluster with the same file system and program.

    The scheduler gives a job of a lost worker to another one.

    Parameters
    ----------
    address : str
        Of the scheduler, such as ``tcp://host:8786``.
    setting : Setting

    Raises
    ------
    InputError
        When `distributed` is not installed, no scheduler answers, or it has no workers.
    """

    def __init__(self, address: str, setting: Setting) -> None:
        try:
            from distributed import Client
        except ImportError:
            raise InputError("--scheduler needs Dask: pip install 'modalprep[cluster]'") from None
        try:
            self._client = Client(address, timeout=ANSWER, set_as_default=False)
        except (OSError, TimeoutError, ValueError) as error:
            raise InputError(f"no Dask scheduler answers at {address}: {error}") from None
        self.size = len(self._client.nthreads())
        if not self.size:
            self._client.close()
            raise InputError(f"the Dask scheduler at {address} has no workers; start some with: dask worker {address}")
        self._setting = setting
        self._executor = self._client.get_executor(pure=False)
        self._running: dict[Future, Job] = {}

    @property
    def free(self) -> int:
        """Jobs that may be submitted now: any number, because the scheduler has a queue."""
        return 2**31

    def submit(self, job: Job) -> None:
        """Queue a job at the scheduler."""
        from modalprep.pipeline.batch.work import work

        self._running[self._executor.submit(work, job, self._setting)] = job

    def collect(self, seconds: float) -> list[tuple[Job, Record]]:
        """Wait at most so long for a job to end; return those that did."""
        done = wait(self._running, seconds, return_when=FIRST_COMPLETED).done
        ended = [(self._running.pop(future), future) for future in done]
        return [(job, _result(job, future)) for job, future in ended]

    def close(self) -> None:
        """Disconnect from the cluster; its workers keep running."""
        self._executor.shutdown(wait=False)
        self._client.close()


def _result(job: Job, future: Future) -> Record:
    error: Any = future.exception() if not future.cancelled() else "the scheduler has let go of it"
    if error is None:
        return future.result()
    return failure(job, f"lost by the cluster: {' '.join(str(error).split())}")
