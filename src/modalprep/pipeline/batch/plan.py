"""The jobs of a batch, and what is known of them before any starts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from modalprep.errors import InputError
from modalprep.pipeline.batch.grid import plan_jobs
from modalprep.pipeline.batch.job import Job, Record
from modalprep.pipeline.batch.manifest import any_record, finished
from modalprep.pipeline.batch.order import Order, components, needs_of
from modalprep.program import program

WHOLE = "batch"  # name of the manifest of a whole batch


@dataclass(frozen=True)
class Shard:
    """One of the parts of a batch that run without knowing of each other.

    Attributes
    ----------
    number, count : int
        From 1 to `count`.

    Examples
    --------
    >>> Shard.read("2/8")
    Shard(number=2, count=8)
    """

    number: int
    count: int

    @classmethod
    def read(cls, text: str) -> Shard:
        """Return the part that a text such as ``2/8`` names.

        Raises
        ------
        InputError
            When it names none.
        """
        number, _, count = text.partition("/")
        if not (number.isdecimal() and count.isdecimal() and 1 <= int(number) <= int(count)):
            raise InputError(f"--shard {text}: give the number of the part and how many there are, such as 1/8")
        return cls(int(number), int(count))


@dataclass(frozen=True)
class Batch:
    """The jobs of a batch in the given order, and the records of those already finished.

    Attributes
    ----------
    jobs : tuple of Job
    before : {Job: Record}
    folder : Path
        Folder of the batch manifest and, by default, of the cache.
    needs : {Path: set of Path}
        The jobs that each one waits for.
    modes : {Path: int}
        Modes of each job.
    stem : str
        Name of the batch manifest.
    """

    jobs: tuple[Job, ...]
    before: dict[Path, Record]
    folder: Path
    needs: dict[Path, set[Path]]
    modes: dict[Path, int]
    stem: str = WHOLE

    @property
    def is_whole(self) -> bool:
        """Whether this is no part of a batch."""
        return self.stem == WHOLE

    @property
    def waiting(self) -> list[Job]:
        """The unfinished jobs."""
        return [job for job in self.jobs if job.file not in self.before]

    def order(self) -> Order:
        """Return the unfinished jobs in the order in which they start."""
        return Order(self.waiting, self.needs, self.modes)


def plan_batch(
    patterns: Sequence[str], output: Path | None, shard: Shard | None = None, *, ended: bool = False
) -> Batch:
    """Find the jobs of pipeline files, patterns and grids, and which of them are finished.

    Parameters
    ----------
    patterns : sequence of str
    output : Path or None
        Folder of the outputs.
    shard : Shard or None
        Only a part of the jobs; those that need each other are in one part.
    ended : bool
        Also jobs that have failed count as finished.

    Raises
    ------
    InputError
        When nothing fits a pattern, a grid cannot be read, or two jobs would share a folder.
    """
    planned = plan_jobs(patterns, output)
    jobs = [job for job, _ in planned]
    folder = jobs[0].folder.parent
    now = program()
    needs = needs_of(planned)
    modes = {job.file: named.modes for job, named in planned}
    stem = WHOLE
    if shard is not None:
        groups = components(jobs, needs)[shard.number - 1 :: shard.count]
        chosen = {job.file for group in groups for job in group}
        jobs = [job for job in jobs if job.file in chosen]
        stem = f"batch-{shard.number}-of-{shard.count}"
    records = {job.file: any_record(job) if ended else finished(job, now) for job in jobs}
    before = {file: record for file, record in records.items() if record is not None}
    return Batch(tuple(jobs), before, folder, needs, modes, stem)
