"""The order in which the jobs of a batch start: those that others need first, and the largest before small ones."""

from __future__ import annotations

import heapq
from collections.abc import Mapping, Sequence, Set
from pathlib import Path

from modalprep.pipeline.batch.grid import Planned
from modalprep.pipeline.batch.job import Job


class Order:
    """Jobs that wait for their turn.

    Parameters
    ----------
    jobs : sequence of Job
    needs : {Path: set of Path}
        The jobs that each one waits for, by their files.
    modes : {Path: int}
        Modes of each job: the most first, since the others take theirs from the cache.

    Examples
    --------
    >>> one, two = (Job(Path(name), None) for name in ("one.toml", "two.toml"))
    >>> order = Order([one, two], {one.file: {two.file}, two.file: set()}, {one.file: 3, two.file: 2})
    >>> order.next() is two, order.next()
    (True, None)
    >>> order.ended(two)
    >>> order.next() is one, len(order)
    (True, 0)
    """

    def __init__(self, jobs: Sequence[Job], needs: Mapping[Path, Set[Path]], modes: Mapping[Path, int]) -> None:
        here = {job.file for job in jobs}
        self._jobs = list(jobs)
        self._modes = modes
        self._place = {job.file: k for k, job in enumerate(jobs)}
        self._open = {job.file: set(needs[job.file]) & here for job in jobs}
        self._after: dict[Path, list[Path]] = {}
        for file, others in self._open.items():
            for other in others:
                self._after.setdefault(other, []).append(file)
        self._ready: list[tuple[int, int]] = []
        for file in [file for file, others in self._open.items() if not others]:
            self._release(file)
        self._running = 0

    def __len__(self) -> int:
        """Return the number of jobs that have not started."""
        return len(self._ready) + len(self._open)

    def next(self) -> Job | None:
        """Return the job that starts next; None where the others wait for some that run."""
        if not self._ready and self._open and not self._running:  # they wait for each other
            self._release(next(iter(self._open)))
        if not self._ready:
            return None
        self._running += 1
        return self._jobs[heapq.heappop(self._ready)[1]]

    def ended(self, job: Job) -> None:
        """Let the jobs go that have waited for this one."""
        self._running -= 1
        for file in self._after.pop(job.file, ()):
            if file in self._open:
                self._open[file].discard(job.file)
                if not self._open[file]:
                    self._release(file)

    def _release(self, file: Path) -> None:
        del self._open[file]
        place = self._place[file]
        heapq.heappush(self._ready, (-self._modes[file], place))


def needs_of(planned: Planned) -> dict[Path, set[Path]]:
    """Return the jobs that each one waits for, which make its bodies."""
    file = {job.file.resolve(): job.file for job, _ in planned}
    folder = {job.folder.resolve(): job.file for job, _ in planned}
    needs = {}
    for job, named in planned:
        made = {file.get(path) for path in named.pipelines} | {folder.get(path.parent) for path in named.files}
        needs[job.file] = made - {None, job.file}
    return needs


def components(jobs: Sequence[Job], needs: Mapping[Path, Set[Path]]) -> list[list[Job]]:
    """Return the jobs in groups that do not wait for each other.

    Examples
    --------
    >>> one, two, three = (Job(Path(name), None) for name in ("1.toml", "2.toml", "3.toml"))
    >>> found = components([one, two, three], {one.file: set(), two.file: set(), three.file: {one.file}})
    >>> [[job.name for job in group] for group in found]
    [['1', '3'], ['2']]
    """
    first: dict[Path, Path] = {}

    def root(file: Path) -> Path:
        while first.get(file, file) != file:
            file = first[file]
        return file

    for job in jobs:
        for other in needs[job.file]:
            first[root(job.file)] = root(other)
    groups: dict[Path, list[Job]] = {}
    for job in jobs:
        groups.setdefault(root(job.file), []).append(job)
    return list(groups.values())
