"""The jobs of a batch are given to workers until every one has ended."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from modalprep.errors import InputError
from modalprep.pipeline.batch.console import Progress
from modalprep.pipeline.batch.job import Job, Setting
from modalprep.pipeline.batch.keep import Keeper
from modalprep.pipeline.batch.manifest import input_digests
from modalprep.pipeline.batch.order import Order
from modalprep.pipeline.batch.task import JobTask
from modalprep.pipeline.schema.load import load
from modalprep.workers.cluster import Cluster
from modalprep.workers.processes import Processes
from modalprep.workers.scheduler import Scheduler
from modalprep.workers.team import UNLIMITED, Limits, Team

TICK = 0.5  # s, refresh interval of the progress bar


@dataclass(frozen=True)
class Where:
    """Where the jobs of a batch run.

    Attributes
    ----------
    jobs : int
        Number of local processes.
    scheduler : Scheduler or None
        A Dask cluster instead.
    limits : Limits
        Of each job.
    """

    jobs: int = 1
    scheduler: Scheduler | None = None
    limits: Limits = UNLIMITED


HERE = Where()


@contextmanager
def team_of(where: Where, setting: Setting, mark: tuple[Path, str]) -> Iterator[Team]:
    """Yield the workers, which are released in the end."""
    task = JobTask(setting)
    if where.scheduler is None:
        team: Team = Processes(where.jobs, task, where.limits)
    else:
        team = Cluster(where.scheduler, task, where.limits, (mark[0].absolute(), mark[1]))
    try:
        yield team
    finally:
        team.close()


def dispatch(order: Order, team: Team, keeper: Keeper, progress: Progress, *, far: bool) -> None:
    """Submit jobs until every one has ended; a job waits for those that build its bodies.

    Parameters
    ----------
    order : Order
    team : Team
    keeper : Keeper
    progress : Progress
    far : bool
        Whether the workers may be on other machines, and must see the same files.
    """
    running: dict[Path, Job] = {}
    with progress:
        while len(order) or running:
            while team.free > 0 and (job := order.next()) is not None:
                sent = job.at_home(_inputs(job)) if far else job
                running[sent.file] = job
                team.submit(sent)
                progress.started(job)
            for sent, record in team.collect(TICK):
                job = running.pop(sent.file)
                order.ended(job)
                keeper.ended(job, record)
                progress.ended(job, record)
            progress.tick()


def _inputs(job: Job) -> dict[str, str] | None:
    """Return the hashes of the files that a job reads; None where its pipeline file cannot be read, which it says."""
    try:
        return input_digests(load(job.file))
    except InputError:
        return None
