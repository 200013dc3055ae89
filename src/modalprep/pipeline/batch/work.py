"""One job of a batch in its worker: `modalprep run` with its text in a log and its record in a manifest."""

from __future__ import annotations

import errno
import os
import platform
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from datetime import UTC, datetime
from functools import cache, partial
from pathlib import Path
from typing import TextIO

from modalprep.atomic import not_written
from modalprep.errors import InputError, ModalprepError, OutputError
from modalprep.pipeline.batch.job import DONE, Job, Record, Setting, failure
from modalprep.pipeline.batch.manifest import finished, input_digests, output_digests, write_manifest
from modalprep.pipeline.building.cache import Cache
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.run import run_pipeline
from modalprep.pipeline.schema.load import Loaded, load
from modalprep.pipeline.study.quantities import quantities
from modalprep.program import program
from modalprep.verdicts.notes import silent
from modalprep.verdicts.verdict import FAILED
from modalprep.workers.on_worker import unfit

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
PATIENCE, PAUSE = 5.0, 0.5  # s, in which a shared folder shows what another machine has just written


def work(job: Job, setting: Setting) -> Record:
    """Run a job and return its record, also written to its manifest; a failed job has a record with its cause.

    Parameters
    ----------
    job : Job
    setting : Setting
        Includes the program of the batch; a worker with another program refuses.
    """
    if cause := unfit(setting.program, None):
        return failure(job, f"its worker {cause}")
    read = cache(partial(load, job.file))  # once, unless it changes
    before = finished(job, setting.program, read)  # a cluster that lost a worker with its record runs the job again
    if before is not None:
        return before
    store = Cache(setting.cache, setting.limit) if setting.cache else None
    start = time.perf_counter()
    began = datetime.now(UTC)
    with silent():
        record = _attempt(job, read, store)
    record |= {
        "started": began.isoformat(timespec="seconds"),
        "seconds": round(time.perf_counter() - start, 3),
        "values": job.values,
        "worker": f"{platform.node()}:{os.getpid()}",
        "program": program(),
        "cache": store.use.summary() if store else None,
    }
    try:
        write_manifest(job, record)
    except OutputError as error:
        if record["status"] == DONE:  # otherwise the folder is already the cause
            record |= failure(job, _message(error), error) | {"seconds": record["seconds"]}
    return record


def _attempt(job: Job, read: Callable[[], Loaded], store: Cache | None) -> Record:
    try:
        with _writing(job.log) as file, redirect_stdout(file), redirect_stderr(file):
            return _logged(job, read, store)
    except OutputError as error:  # of the log itself
        return failure(job, _message(error), error)


@contextmanager
def _writing(log: Path) -> Iterator[TextIO]:
    """Open the log of a job; it can be read while the job runs, and stays when the job is killed.

    Raises
    ------
    OutputError
        When it cannot be written.
    """
    try:
        log.parent.mkdir(parents=True, exist_ok=True)
        with log.open("w", encoding="utf-8", buffering=1) as file:
            yield file
    except OSError as error:
        raise not_written(log, error) from error


def _logged(job: Job, read: Callable[[], Loaded], store: Cache | None) -> Record:
    try:
        source, inputs = _seen(job, read)
        reporter = Reporter()
        outcome = run_pipeline(source, job.output, reporter, store)
        record = {"job": job.name, "pipeline": str(job.file), "status": DONE, "cause": "", "inputs": inputs}
        record |= {"outputs": output_digests(job, reporter.files), "notes": outcome.notes}
        record |= {"verdict": outcome.verdict.summary(), "quantities": quantities(outcome)}
        failed = [audit.says for audit in outcome.audits if audit.result == FAILED]
        return record | failure(job, "; ".join(failed)) if failed else record
    except ModalprepError as error:
        print(_message(error))
        return failure(job, _message(error), error)
    except MemoryError as error:
        return failure(job, "not enough memory; run fewer jobs at a time, or a coarser mesh", error)
    except (Exception, SystemExit) as error:  # a fault of the program or of a library fails this job only
        if isinstance(error, OSError) and error.errno in FULL:  # the log cannot be written either
            raise
        traceback.print_exc()
        return failure(job, f"{type(error).__name__}: {_message(error)} (see its log: {job.log})", error)


def _seen(job: Job, read: Callable[[], Loaded]) -> tuple[Loaded, dict[str, str]]:
    """Return the pipeline file of a job, and the hashes of the files that it reads.

    Raises
    ------
    InputError
        When this worker sees another file than the machine that gave the job.
    """
    end = time.monotonic() + PATIENCE
    source = read()
    while (found := input_digests(source)) != (wanted := job.inputs or found):
        if time.monotonic() > end:
            names = [name for name in {**wanted, **found} if found.get(name) != wanted.get(name)]
            raise InputError(
                f"its worker {platform.node()} sees another {job.file.parent / names[0]} than the client; "
                "put it into a folder that both share"
            )
        time.sleep(PAUSE)
        source = load(job.file)
    return source, found


def _message(error: BaseException) -> str:
    return " ".join(str(error).split())
