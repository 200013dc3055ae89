"""What workers do with the jobs of a batch; light to import, like `modalprep.workers`."""

from __future__ import annotations

from dataclasses import dataclass

from modalprep.atomic import remove_temporary
from modalprep.pipeline.batch.job import Job, Record, Setting, failure


@dataclass(frozen=True)
class JobTask:
    """The jobs of a batch, as workers run them."""

    setting: Setting

    def run(self, job: Job) -> Record:
        """Run a job; return its record."""
        from modalprep.pipeline.batch.work import work

        return work(job, self.setting)

    def lost(self, job: Job, cause: str) -> Record:
        """Return the record of a job whose worker has died."""
        return failure(job, cause)

    def tidy(self, job: Job, process: int) -> None:
        """Remove the incomplete files of a process."""
        for folder in {job.folder.parent, self.setting.cache} - {None}:
            remove_temporary(folder, process)
