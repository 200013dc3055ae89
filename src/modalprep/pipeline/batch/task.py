"""What workers do with the jobs of a batch; light to import, like `modalprep.workers`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

from modalprep.atomic import remove_temporary
from modalprep.pipeline.batch.job import Job, Record, Setting, failure
from modalprep.workers.team import never


@dataclass(frozen=True)
class JobTask:
    """The jobs of a batch, as workers run them."""

    setting: Setting
    own_process: ClassVar[bool] = True

    def run(self, job: Job, stopped: Callable[[], bool] = never) -> Record:
        """Run a job; return its record."""
        from modalprep.pipeline.batch.work import work

        return work(job, self.setting)

    def lost(self, job: Job, cause: str) -> Record:
        """Return the record of a job whose worker has died."""
        began = f" (see what it said until then: {job.log})" if job.log.is_file() else ""
        return failure(job, f"{cause}{began}")

    def tidy(self, job: Job, process: int) -> None:
        """Remove the incomplete files of a process."""
        for folder in {job.folder.parent, self.setting.cache} - {None}:
            remove_temporary(folder, process)
