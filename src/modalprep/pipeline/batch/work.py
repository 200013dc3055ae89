"""One job of a batch in its worker: `modalprep run` with its text in a log and its record in a manifest."""

from __future__ import annotations

import errno
import os
import platform
import threading
import time
import traceback
from contextlib import redirect_stderr, redirect_stdout
from datetime import UTC, datetime

from modalprep.atomic import atomic_path
from modalprep.errors import ModalprepError, OutputError
from modalprep.pipeline.batch.job import DONE, Job, Record, Setting, failure
from modalprep.pipeline.batch.manifest import finished, input_digests, output_digests, write_manifest
from modalprep.pipeline.build.cache import Cache
from modalprep.pipeline.build.program import program
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.run import run_pipeline
from modalprep.verdicts.notes import silent
from modalprep.verdicts.verdict import FAILED

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
ONE_AT_A_TIME = threading.Lock()  # drawing and standard output belong to the process, which may have several threads


def work(job: Job, setting: Setting) -> Record:
    """Run a job and return its record, also written to its manifest; a failed job has a record with its cause.

    Parameters
    ----------
    job : Job
    setting : Setting
        Includes the program of the batch; a worker with another program refuses.
    """
    if program() != setting.program:
        differing = [name for name, value in setting.program.items() if program().get(name) != value]
        return failure(job, f"its worker has a different {', '.join(differing)}; install the same there")
    before = finished(job, setting.program)  # a cluster that lost a worker with its record runs the job again
    if before is not None:
        return before
    cache = Cache(setting.cache, setting.limit) if setting.cache else None
    with ONE_AT_A_TIME, silent():
        start, began = time.perf_counter(), datetime.now(UTC)
        record = _attempt(job, cache)
    record |= {
        "started": began.isoformat(timespec="seconds"),
        "seconds": round(time.perf_counter() - start, 3),
        "values": job.values,
        "worker": f"{platform.node()}:{os.getpid()}",
        "program": program(),
        "cache": cache.use.summary() if cache else None,
    }
    try:
        write_manifest(job, record)
    except OutputError as error:
        if record["status"] == DONE:  # otherwise the folder is already the cause
            record |= failure(job, _message(error), error) | {"seconds": record["seconds"]}
    return record


def _attempt(job: Job, cache: Cache | None) -> Record:
    try:
        with atomic_path(job.log) as temporary, temporary.open("w", encoding="utf-8") as file:
            with redirect_stdout(file), redirect_stderr(file):
                return _logged(job, cache)
    except OutputError as error:  # of the log itself
        return failure(job, _message(error), error)


def _logged(job: Job, cache: Cache | None) -> Record:
    try:
        inputs, reporter = input_digests(job.file), Reporter()
        outcome = run_pipeline(job.file, job.output, reporter, cache)
        record = {"job": job.name, "pipeline": str(job.file), "status": DONE, "cause": "", "inputs": inputs}
        record |= {"outputs": output_digests(job, reporter.files), "notes": outcome.notes}
        record["verdict"] = outcome.verdict.summary()
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


def _message(error: BaseException) -> str:
    return " ".join(str(error).split())
