"""The command that runs many pipeline files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from modalprep.cli.common import Json, Output, Quiet, app, print_json
from modalprep.verdicts.verdict import FAIL

if TYPE_CHECKING:
    from modalprep.pipeline.batch.dispatch import Where
    from modalprep.pipeline.batch.job import Job
    from modalprep.pipeline.batch.plan import Batch
    from modalprep.workers.scheduler import Scheduler

GIB = 2**30  # bytes


@app.command()
def batch(
    files: Annotated[list[str], typer.Argument(help="Pipeline files or patterns, such as 'pipelines/*.toml'.")],
    jobs: Annotated[
        int | None,
        typer.Option("-j", "--jobs", help="Number of processes on this machine, or of jobs in a queue; default 1."),
    ] = None,
    output: Output = None,
    cache: Annotated[
        Path | None, typer.Option("--cache", help="Folder of the cache; the default is .cache among the outputs.")
    ] = None,
    cache_size: Annotated[float, typer.Option("--cache-size", help="Largest size of the cache in GiB.")] = 5.0,
    no_cache: Annotated[bool, typer.Option("--no-cache", help="Use no cache and compute everything.")] = False,
    scheduler: Annotated[
        str | None,
        typer.Option("--scheduler", help="Dask scheduler that runs the jobs instead, such as tcp://host:8786."),
    ] = None,
    scheduler_file: Annotated[
        Path | None, typer.Option("--scheduler-file", help="File that a Dask scheduler has written, instead.")
    ] = None,
    cluster: Annotated[
        str | None,
        typer.Option("--cluster", help="Start the workers by a queue: slurm, pbs, ..., or a TOML file with options."),
    ] = None,
    job_time: Annotated[float | None, typer.Option("--job-time", help="Longest time of a job in seconds.")] = None,
    job_memory: Annotated[float | None, typer.Option("--job-memory", help="Largest memory of a job in GiB.")] = None,
    retries: Annotated[
        int, typer.Option("--retries", help="How often a job is run again whose process has ended.")
    ] = 0,
    shard: Annotated[
        str | None, typer.Option("--shard", help="Run one part of the jobs, such as 3/8 in a job array.")
    ] = None,
    collect: Annotated[
        bool, typer.Option("--collect", help="Run nothing; write the results of what has ended, of all parts.")
    ] = False,
    track: Annotated[
        str | None,
        typer.Option(
            "--track", help="Follow the modes over each [grid] by their shapes: clamped at the root, or free."
        ),
    ] = None,
    listing: Annotated[bool, typer.Option("--list", help="Print the jobs and run none.")] = False,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Run many pipeline files, and every combination of a [grid].

    Finished jobs are not run again. When one job fails, it is reported and the others go on. The exit code is 1 when a
    job failed or its verdict is FAIL, and 2 when files could not be written.
    """
    from modalprep.pipeline.batch.batch import collect_batch, list_batch, run_batch
    from modalprep.pipeline.batch.plan import Shard, plan_batch
    from modalprep.pipeline.console import Reporter

    _refuse_contradictions(cache, cache_size, no_cache, collect=collect, shard=shard)
    where = _where(jobs, _scheduler(scheduler, scheduler_file, cluster, jobs), job_time, job_memory, retries)
    reporter = Reporter(quiet=as_json or quiet)
    planned = plan_batch(files, output, Shard.read(shard) if shard else None, ended=collect)
    tracked = _tracked(planned, track)
    if listing:
        done = list_batch(planned, reporter, where)
    elif collect:
        done = collect_batch(planned, reporter)
    else:
        folder = None if no_cache else cache or planned.folder / ".cache"
        done = run_batch(planned, reporter, where, cache=folder, limit=cache_size * GIB)
    if tracked and track and not listing:
        from modalprep.pipeline.batch.tracks import write_tracks

        done["tracked"] = [write_tracks(grid, track, reporter) for grid in tracked]
    if as_json:
        print_json(done)
    if not listing:
        _end(done)


def _refuse_contradictions(
    cache: Path | None, cache_size: float, no_cache: bool, *, collect: bool, shard: str | None
) -> None:
    from modalprep.errors import InputError

    if not cache_size > 0:
        raise InputError(f"--cache-size {cache_size:g} must be positive; use --no-cache for none")
    if no_cache and cache:
        raise InputError("--no-cache and --cache contradict each other; give one of them")
    if collect and shard:
        raise InputError("--collect takes the results of all parts; leave --shard out")


def _end(done: dict[str, Any]) -> None:
    """End with the exit code of what has failed."""
    from modalprep.errors import OutputError

    unwritten = sum(row.get("error") == OutputError.__name__ for row in done["jobs"])
    if unwritten:
        jobs_lost = f"{unwritten} of {len(done['jobs'])} jobs"
        raise OutputError(f"cannot write the files of {jobs_lost}; make room, or choose another --output folder")
    if done["failed"] or any(row.get("verdict", {}).get("word") == FAIL for row in done["jobs"]):
        raise typer.Exit(1)


def _scheduler(address: str | None, file: Path | None, cluster: str | None, jobs: int | None) -> Scheduler | None:
    from modalprep.errors import InputError
    from modalprep.pipeline.batch.cluster import named_cluster
    from modalprep.workers.scheduler import Scheduler

    given = [
        name for name, value in (("--scheduler", address), ("--scheduler-file", file), ("--cluster", cluster)) if value
    ]
    if len(given) > 1:
        raise InputError(f"{' and '.join(given)} contradict each other; give one of them")
    if cluster:
        return named_cluster(cluster, jobs)
    if given and jobs is not None:
        raise InputError(
            f"-j {jobs}: the workers of a scheduler are as many as there are; leave it out with {given[0]}"
        )
    if file:
        return Scheduler(str(file.absolute()))
    return Scheduler(address) if address else None


def _where(
    jobs: int | None, scheduler: Scheduler | None, seconds: float | None, memory: float | None, retries: int
) -> Where:
    from modalprep.errors import InputError
    from modalprep.pipeline.batch.dispatch import Where
    from modalprep.workers.team import Limits

    if jobs is not None and jobs < 1:
        raise InputError(f"-j {jobs}: give the number of processes, at least 1")
    for name, value in (("--job-time", seconds), ("--job-memory", memory)):
        if value is not None and not value > 0:
            raise InputError(f"{name} {value:g} must be positive; leave it out for no limit")
    if retries < 0:
        raise InputError(f"--retries {retries}: give a number of times, 0 or more")
    return Where(jobs or 1, scheduler, Limits(seconds, None if memory is None else memory * GIB, retries))


def _tracked(planned: Batch, track: str | None) -> list[list[Job]]:
    if track is None:
        return []
    from modalprep.pipeline.batch.tracks import grids

    return grids(planned, track)
