"""What a team of workers is, and what it does."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol


def never() -> bool:
    """Return False: nobody asks a job to stop.

    Examples
    --------
    >>> never()
    False
    """
    return False


class Task(Protocol):
    """What workers do with a job; it is sent to processes and clusters, and must be light to import.

    Attributes
    ----------
    own_process : bool
        Whether each job of a cluster runs in a process of its own, which can be limited and ended.
    """

    own_process: ClassVar[bool]

    def run(self, job: Any, stopped: Callable[[], bool] = never) -> Any:
        """Return the outcome of a job; nothing is raised. A job may end early once `stopped` returns True."""

    def lost(self, job: Any, cause: str) -> Any:
        """Return the outcome of a job whose worker has died."""

    def tidy(self, job: Any, process: int) -> None:
        """Remove what a process that was stopped has left of a job."""


class Team(Protocol):
    """Workers of a task.

    Attributes
    ----------
    size : int
        Number of concurrent jobs; on a cluster it changes.
    """

    @property
    def size(self) -> int:
        """Number of jobs that run at the same time."""
        ...

    @property
    def free(self) -> int:
        """Jobs that may be submitted now."""
        ...

    def submit(self, job: Any) -> None:
        """Start a job, or queue it."""

    def collect(self, seconds: float) -> list[tuple[Any, Any]]:
        """Wait at most so long for a job to end; return those that did."""
        ...

    def news(self) -> list[str]:
        """Return what is new about the workers, in sentences."""
        ...

    def close(self) -> None:
        """Release the workers and stop running jobs."""


@dataclass(frozen=True)
class Limits:
    """Limits of each job.

    Attributes
    ----------
    seconds : float or None
        Longest time of a job, with the start of its process.
    memory : float or None
        Largest memory of its process, bytes; on a cluster by default the share of its worker.
    retries : int
        How often a job whose process has ended is run again.
    """

    seconds: float | None = None
    memory: float | None = None
    retries: int = 0


UNLIMITED = Limits()
