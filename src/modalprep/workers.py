"""Workers that run the jobs of a task: threads, local processes or a Dask cluster.

Light to import: a worker process sets its threads before numpy is loaded.
"""

from __future__ import annotations

import math
import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager, suppress
from multiprocessing import connection, resource_tracker
from typing import Any, Protocol

from modalprep.errors import InputError
from modalprep.extras import need

THREADS = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
ANSWER = "30s"  # s, timeout of a scheduler


class Task(Protocol):
    """What workers do with a job; it is sent to processes and clusters, and must be light to import."""

    def run(self, job: Any) -> Any:
        """Return the outcome of a job; nothing is raised."""

    def lost(self, job: Any, cause: str) -> Any:
        """Return the outcome of a job whose worker has died."""

    def tidy(self, job: Any, process: int) -> None:
        """Remove what a process that was stopped has left of a job."""


class Team(Protocol):
    """Workers of a task.

    Attributes
    ----------
    size : int
        Number of concurrent jobs.
    """

    size: int

    @property
    def free(self) -> int:
        """Jobs that may be submitted now."""

    def submit(self, job: Any) -> None:
        """Start a job, or queue it."""

    def collect(self, seconds: float) -> list[tuple[Any, Any]]:
        """Wait at most so long for a job to end; return those that did."""

    def close(self) -> None:
        """Release the workers and stop running jobs."""


class Threads:
    """Threads of this process, for jobs that spend most of their time in compiled code.

    Parameters
    ----------
    size : int
    task : Task
    """

    def __init__(self, size: int, task: Task) -> None:
        self.size, self._task = size, task
        self._executor, self._running = ThreadPoolExecutor(size), {}

    @property
    def free(self) -> int:
        """Jobs that may be submitted now: each thread has the next one waiting."""
        return 2 * self.size - len(self._running)

    def submit(self, job: Any) -> None:
        """Queue a job."""
        self._running[self._executor.submit(self._task.run, job)] = job

    def collect(self, seconds: float) -> list[tuple[Any, Any]]:
        """Wait at most so long for a job to end; return those that did."""
        done = wait(self._running, seconds, return_when=FIRST_COMPLETED).done
        return [(self._running.pop(future), future.result()) for future in done]

    def close(self) -> None:
        """Wait for the jobs that run; those that have not begun are left out."""
        self._executor.shutdown(cancel_futures=True)


class Processes:
    """Local worker processes, with the processors divided among them for linear algebra.

    A process that dies, for lack of memory or by a fault of a library, is replaced; only its own job fails.

    Parameters
    ----------
    size : int
    task : Task
    """

    def __init__(self, size: int, task: Task) -> None:
        self.size, self._task = size, task
        self._idle: list[_Process] = []
        self._busy: dict[_Process, Any] = {}

    @property
    def free(self) -> int:
        """Jobs that may be submitted now."""
        return self.size - len(self._busy)

    def submit(self, job: Any) -> None:
        """Give a job to an idle process, or to a new one."""
        process = self._idle.pop() if self._idle else _Process(max(1, processors() // self.size), self._task)
        self._busy[process] = job
        process.send(job)

    def collect(self, seconds: float) -> list[tuple[Any, Any]]:
        """Wait at most so long for a job to end; return those that did."""
        ended = connection.wait([process.pipe for process in self._busy], seconds)
        return [self._end(process) for process in list(self._busy) if process.pipe in ended]

    def _end(self, process: _Process) -> tuple[Any, Any]:
        job = self._busy.pop(process)
        try:
            outcome = process.pipe.recv()
            self._idle.append(process)
        except (EOFError, OSError):
            outcome = self._task.lost(job, process.exit_report())
            self._task.tidy(job, process.pid)
        return job, outcome

    def close(self) -> None:
        """Stop the processes."""
        for process in (*self._idle, *self._busy):
            process.stop()
        for process, job in self._busy.items():
            self._task.tidy(job, process.pid)


class _Process:
    """A spawned process and the pipe to it: the task and then jobs go in, outcomes come out."""

    def __init__(self, threads: int, task: Task) -> None:
        context = multiprocessing.get_context("spawn")
        self.pipe, other = context.Pipe()
        self._process = context.Process(target=_serve, args=(other, threads), daemon=True)
        with _ignore_interrupts():
            self._process.start()
        other.close()  # so that the pipe closes with the process
        self.send(task)

    def send(self, what: Any) -> None:
        with suppress(OSError):  # it died: `collect` finds the pipe closed
            self.pipe.send(what)

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
    with suppress(EOFError, OSError):
        task = pipe.recv()
        while True:
            pipe.send(task.run(pipe.recv()))


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
        os.environ[name] = str(min(threads, exported_threads(name)))


def exported_threads(name: str) -> float:
    """Return the number of threads that the user's environment allows; a share of the processors may be less.

    Examples
    --------
    >>> exported_threads("NO_SUCH_NAME")
    inf
    """
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
    task : Task

    Raises
    ------
    InputError
        When `distributed` is not installed, no scheduler answers, or it has no workers.
    """

    def __init__(self, address: str, task: Task) -> None:
        need("distributed", "a scheduler")
        from distributed import Client

        try:
            self._client = Client(address, timeout=ANSWER, set_as_default=False)
        except (OSError, TimeoutError, ValueError) as error:
            raise InputError(f"no Dask scheduler answers at {address}: {error}") from None
        self.size = len(self._client.nthreads())
        if not self.size:
            self._client.close()
            raise InputError(f"the Dask scheduler at {address} has no workers; start some with: dask worker {address}")
        self._task = task
        self._executor = self._client.get_executor(pure=False)
        self._running: dict[Future, Any] = {}

    @property
    def free(self) -> int:
        """Jobs that may be submitted now: any number, because the scheduler has a queue."""
        return 2**31

    def submit(self, job: Any) -> None:
        """Queue a job at the scheduler."""
        self._running[self._executor.submit(self._task.run, job)] = job

    def collect(self, seconds: float) -> list[tuple[Any, Any]]:
        """Wait at most so long for a job to end; return those that did."""
        done = wait(self._running, seconds, return_when=FIRST_COMPLETED).done
        ended = [(self._running.pop(future), future) for future in done]
        return [(job, self._outcome(job, future)) for job, future in ended]

    def _outcome(self, job: Any, future: Future) -> Any:
        error: Any = future.exception() if not future.cancelled() else "the scheduler has let go of it"
        if error is None:
            return future.result()
        return self._task.lost(job, f"lost by the cluster: {' '.join(str(error).split())}")

    def close(self) -> None:
        """Disconnect from the cluster; its workers keep running."""
        self._executor.shutdown(wait=False)
        self._client.close()
