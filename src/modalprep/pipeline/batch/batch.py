"""Many pipeline files in parallel: finished jobs are skipped, and a failed job does not stop the others."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from modalprep.pipeline.batch.console import Progress, jobs_table
from modalprep.pipeline.batch.dispatch import HERE, Where, dispatch, team_of
from modalprep.pipeline.batch.job import Setting
from modalprep.pipeline.batch.keep import Keeper
from modalprep.pipeline.batch.plan import Batch
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.study.write import write_study
from modalprep.program import program
from modalprep.report.terminal import clock


def run_batch(
    batch: Batch, reporter: Reporter, where: Where = HERE, *, cache: Path | None, limit: float
) -> dict[str, Any]:
    """Run the unfinished jobs; return the manifest of the batch, also written to ``<folder>/batch.json``.

    Parameters
    ----------
    batch : Batch
    reporter : Reporter
    where : Where
        Processes or a cluster, and the limits of jobs.
    cache : Path or None
        Folder of the cache; None for none.
    limit : float
        Maximum cache size, bytes.

    Raises
    ------
    InputError
        When the scheduler does not answer.
    ClusterError
        When it has gone, or no worker can run the jobs.
    OutputError
        When the manifest cannot be written: before the first job, or after the last one.
    """
    setting = Setting(cache and cache.absolute(), limit, program())
    reporter.say(f"{len(batch.jobs)} jobs, {len(batch.before)} of them finished before")
    keeper = Keeper(batch)
    order = batch.order()
    if len(order):
        # as many as for the whole batch: a job that is resumed alone has the same share of the processors, and sums
        where = replace(where, jobs=min(where.jobs, len(batch.jobs)))
        with keeper.open(), team_of(where, setting, (keeper.lines, keeper.first)) as team:
            progress = Progress(reporter, len(order), team)
            dispatch(order, team, keeper, progress, far=where.scheduler is not None)
    return _end(batch, keeper, reporter)


def collect_batch(batch: Batch, reporter: Reporter) -> dict[str, Any]:
    """Write the manifest of a batch from those of its jobs, as after parts of it have run elsewhere; return it.

    Raises
    ------
    OutputError
        When it cannot be written.
    """
    reporter.say(f"{len(batch.before)} of {len(batch.jobs)} jobs have ended")
    return _end(batch, Keeper(batch), reporter)


def _end(batch: Batch, keeper: Keeper, reporter: Reporter) -> dict[str, Any]:
    manifest = keeper.manifest()
    jobs_table(manifest["jobs"], reporter.console)
    reporter.wrote(keeper.write(manifest))
    if batch.is_whole:
        files, notes = write_study(manifest["jobs"], batch.folder)
        reporter.notes(notes)
        for file in files:
            reporter.wrote(file)
    return manifest


def list_batch(batch: Batch, reporter: Reporter, where: Where = HERE) -> dict[str, Any]:
    """Print the jobs and which of them are finished; return the same in the form of the manifest."""
    manifest = Keeper(batch).manifest()
    jobs_table(manifest["jobs"], reporter.console)
    if batch.before and batch.waiting:
        reporter.say(forecast(batch, where))
    return manifest


def forecast(batch: Batch, where: Where) -> str:
    """Return how long the unfinished jobs would take at the mean time of the finished ones."""
    mean = sum(record["seconds"] for record in batch.before.values()) / len(batch.before)
    count = len(batch.waiting)
    each = f"the other {count} jobs take about {clock(mean)} each"
    if where.scheduler is not None:
        return f"{each}, {clock(count * mean)} in all, divided among the workers"
    return f"{each}, {clock(count * mean / min(where.jobs, count))} with -j {where.jobs}"
