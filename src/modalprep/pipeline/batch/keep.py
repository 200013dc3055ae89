"""What is kept of a batch: a line as each job ends, and all of them in one file in the end."""

from __future__ import annotations

import json
import time
import uuid
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from modalprep.atomic import not_written, write_json
from modalprep.errors import OutputError
from modalprep.pipeline.batch.job import DONE, Job, Record
from modalprep.pipeline.batch.plan import Batch
from modalprep.pipeline.study.write import write_study
from modalprep.program import program

EVERY, SHARE = 10.0, 20.0  # s between two writings of the table, and times what one takes
IN_MANIFEST = "inputs", "outputs", "program"  # of a record: they stay in the job's own manifest


class Keeper:
    """The records of a batch, and its files ``batch.jsonl`` and ``batch.json``.

    Parameters
    ----------
    batch : Batch

    Attributes
    ----------
    records : {Path: Record}
        Of the jobs that have ended, by their files.
    lines : Path
        The file with a line for each job.
    first : str
        Its first line, which no other batch has.
    """

    def __init__(self, batch: Batch) -> None:
        self._batch = batch
        self.records = dict(batch.before)
        self._began = datetime.now(UTC)
        self._start = time.perf_counter()
        self._due = time.monotonic() + EVERY
        self.lines = batch.folder / f"{batch.stem}.jsonl"
        self.first = json.dumps({"format": "modalprep batch lines", "version": 1, "batch": uuid.uuid4().hex})

    @contextmanager
    def open(self) -> Iterator[None]:
        """Begin the files; an interrupted batch leaves there what has ended.

        Raises
        ------
        OutputError
            When they cannot be written.
        """
        self.write()
        self._append(self.first, "w")
        try:
            yield
        except BaseException:
            with suppress(OutputError):
                self.write()
            raise

    def ended(self, job: Job, record: Record) -> None:
        """Take the record of a job, and append a line; where it cannot be written, the other jobs go on."""
        self.records[job.file] = lean(record)
        with suppress(OutputError):
            self._append(json.dumps(self._row(job)), "a")
            self._write_study_when_due()

    def _write_study_when_due(self) -> None:
        begin = time.monotonic()
        if begin > self._due and self._batch.is_whole:
            write_study(self._rows(), self._batch.folder)
            self._due = begin + max(EVERY, SHARE * (time.monotonic() - begin))

    def _append(self, line: str, mode: str) -> None:
        try:
            with self.lines.open(mode, encoding="utf-8") as file:
                file.write(f"{line}\n")
        except OSError as error:
            raise not_written(self.lines, error) from error

    def write(self, manifest: Mapping[str, Any] | None = None) -> Path:
        """Write ``batch.json``, with what it holds now by default.

        Raises
        ------
        OutputError
            When it cannot be written.
        """
        return write_json(dict(manifest or self.manifest()), self._batch.folder / f"{self._batch.stem}.json")

    def manifest(self) -> dict[str, Any]:
        """Return what ``batch.json`` holds."""
        rows = self._rows()
        return {
            "format": "modalprep batch",
            "version": 1,
            "program": program(),
            "started": self._began.isoformat(timespec="seconds"),
            "seconds": round(time.perf_counter() - self._start, 3),
            "failed": sum(row["status"] != DONE for row in rows),
            "jobs": rows,
        }

    def _rows(self) -> list[dict[str, Any]]:
        return [self._row(job) for job in self._batch.jobs]

    def _row(self, job: Job) -> dict[str, Any]:
        waiting = {"job": job.name, "pipeline": str(job.file), "status": "waiting", "cause": ""}
        row = {"folder": str(job.folder), "ran": job.file not in self._batch.before, "values": job.values}
        row |= {"parameters": dict(zip(job.values, job.cell.values, strict=True)) if job.cell else {}}
        return row | self.records.get(job.file, waiting) | {"manifest": str(job.manifest)}


def lean(record: Mapping[str, Any]) -> Record:
    """Return a record without the hashes, which are in the job's own manifest.

    Examples
    --------
    >>> lean({"job": "a", "inputs": {"a.toml": "9f3"}})
    {'job': 'a'}
    """
    return {key: value for key, value in record.items() if key not in IN_MANIFEST}
