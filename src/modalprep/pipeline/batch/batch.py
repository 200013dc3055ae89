"""Many pipeline files in parallel: finished jobs are skipped, and a failed job does not stop the others."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from modalprep.atomic import write_json
from modalprep.errors import InputError, OutputError
from modalprep.pipeline.batch.console import Progress, jobs_table
from modalprep.pipeline.batch.grid import find_jobs
from modalprep.pipeline.batch.job import DONE, Job, Record, Setting
from modalprep.pipeline.batch.manifest import finished
from modalprep.pipeline.batch.task import JobTask
from modalprep.pipeline.build.program import program
from modalprep.pipeline.build.sources import body_pipelines, source_files
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.load import load_pipeline
from modalprep.workers import Cluster, Processes, Team

TICK = 0.5  # s, refresh interval of the progress bar


@dataclass(frozen=True)
class Batch:
    """The jobs of a batch in the given order, and the records of those already finished.

    Attributes
    ----------
    jobs : tuple of Job
    before : {Job: Record}
    folder : Path
        Folder of the batch manifest and, by default, of the cache.
    """

    jobs: tuple[Job, ...]
    before: dict[Path, Record]
    folder: Path

    @property
    def waiting(self) -> list[Job]:
        """The unfinished jobs."""
        return [job for job in self.jobs if job.file not in self.before]


def plan_batch(patterns: Sequence[str], output: Path | None) -> Batch:
    """Find the jobs of pipeline files, patterns and grids, and which of them are finished.

    Raises
    ------
    InputError
        When nothing fits a pattern, a grid cannot be read, or two jobs would share a folder.
    """
    jobs, now = find_jobs(patterns, output), program()
    records = {job.file: finished(job, now) for job in jobs}
    before = {file: record for file, record in records.items() if record is not None}
    return Batch(tuple(jobs), before, jobs[0].folder.parent)


def run_batch(
    batch: Batch, reporter: Reporter, *, jobs: int = 1, scheduler: str | None = None, cache: Path | None, limit: float
) -> dict[str, Any]:
    """Run the unfinished jobs; return the manifest of the batch, also written to ``<folder>/batch.json``.

    Parameters
    ----------
    batch : Batch
    reporter : Reporter
    jobs : int
        Number of local processes.
    scheduler : str or None
        Address of a Dask scheduler to use instead.
    cache : Path or None
        Folder of the cache; None for none.
    limit : float
        Maximum cache size, bytes.

    Raises
    ------
    InputError
        When the scheduler does not answer.
    OutputError
        When the manifest cannot be written: before the first job, or after the last one.
    """
    setting = Setting(cache and cache.resolve(), limit, program())
    records, start, began = dict(batch.before), time.perf_counter(), datetime.now(UTC)
    reporter.say(f"{len(batch.jobs)} jobs, {len(batch.before)} of them finished before")
    manifest: dict[str, Any] = {}

    def write() -> Path:
        manifest.update(_manifest(batch, records, began, time.perf_counter() - start))
        return write_json(manifest, batch.folder / "batch.json")

    def ended(job: Job, record: Record) -> None:
        records[job.file] = record
        with suppress(OutputError):  # the other jobs continue; the last record is refused below
            write()

    write()
    if batch.waiting:
        # as many as for the whole batch: a job that is resumed alone has the same share of the processors, and sums
        with _team(min(jobs, len(batch.jobs)), scheduler, setting) as team:
            _dispatch(batch, team, Progress(reporter, len(batch.waiting), team.size), ended)
    jobs_table(manifest["jobs"], reporter.console)
    reporter.wrote(write())
    return manifest


def list_batch(batch: Batch, reporter: Reporter) -> dict[str, Any]:
    """Print the jobs and which of them are finished; return the same in the form of the manifest."""
    manifest = _manifest(batch, batch.before, datetime.now(UTC), 0.0)
    jobs_table(manifest["jobs"], reporter.console)
    return manifest


@contextmanager
def _team(jobs: int, scheduler: str | None, setting: Setting) -> Iterator[Team]:
    task = JobTask(setting)
    team = Cluster(scheduler, task) if scheduler else Processes(jobs, task)
    try:
        yield team
    finally:
        team.close()


def _dispatch(batch: Batch, team: Team, progress: Progress, ended: Callable[[Job, Record], None]) -> None:
    """Submit jobs until every one has ended; a job waits for those that build its bodies."""
    needs = _needs(batch.waiting)
    waiting, running = sorted(batch.waiting, key=_modes, reverse=True), set()
    with progress:
        while waiting or running:
            open_files = {job.file for job in waiting} | running
            ready = [job for job in waiting if not needs[job.file] & open_files]
            for job in (ready or (waiting if not running else []))[: team.free]:
                waiting.remove(job)
                running.add(job.file)
                team.submit(job)
                progress.started(job)
            for job, record in team.collect(TICK):
                running.discard(job.file)
                ended(job, record)
                progress.ended(job, record)
            progress.tick()


def _needs(jobs: Sequence[Job]) -> dict[Path, set[Path]]:
    """Return the jobs that each one depends on: those of its bodies' pipelines and modal files."""
    file = {job.file.resolve(): job.file for job in jobs}
    folder = {job.folder.resolve(): job.file for job in jobs}
    found: dict[Path, set[Path]] = {}
    for job in jobs:
        try:
            pipeline = load_pipeline(job.file)
        except InputError:
            found[job.file] = set()
            continue
        made = {file.get(path.resolve()) for path in body_pipelines(job.file, pipeline)}
        made |= {folder.get(path.resolve().parent) for path in source_files(job.file, pipeline)}
        found[job.file] = made - {None, job.file}
    return found


def _modes(job: Job) -> int:
    """Return the number of modes of a job: the largest runs first, since the others reuse its modes from the cache."""
    try:
        return load_pipeline(job.file).reduction.modes
    except InputError:
        return 0


def _manifest(batch: Batch, records: dict[Path, Record], began: datetime, seconds: float) -> dict[str, Any]:
    rows = []
    for job in batch.jobs:
        record = records.get(job.file, {"job": job.name, "pipeline": str(job.file), "status": "waiting", "cause": ""})
        row = {"folder": str(job.folder), "ran": job.file not in batch.before, "values": job.values, **record}
        rows.append(row | {"manifest": str(job.manifest)})
    return {
        "format": "modalprep batch",
        "version": 1,
        "program": program(),
        "started": began.isoformat(timespec="seconds"),
        "seconds": round(seconds, 3),
        "failed": sum(row["status"] != DONE for row in rows),
        "jobs": rows,
    }
