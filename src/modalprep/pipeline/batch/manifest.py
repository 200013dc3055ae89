"""The manifest of a job: hashes of its inputs and outputs, which identify a finished job."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from pathlib import Path

from modalprep.atomic import atomic_path
from modalprep.errors import InputError
from modalprep.fe.readers.digest import mesh_digest
from modalprep.pipeline.batch.job import DONE, Job, Record
from modalprep.pipeline.building.sources import relative, source_files
from modalprep.pipeline.schema.base import DeckName, named_files
from modalprep.pipeline.schema.load import Loaded, load
from modalprep.program import file_digest

HEAD = {"format": "modalprep job", "version": 1}


def input_digests(source: Loaded) -> dict[str, str]:
    """Return the hash of each file that a pipeline file needs, itself and the pipelines of its bodies included.

    Files are named relative to the pipeline file's folder. The hash of a deck is that of the files that it includes,
    too; that of a missing file is empty.

    Raises
    ------
    InputError
        When one of the pipeline files cannot be read.
    """
    found: dict[str, str] = {}
    for each in source.files:
        found[relative(each.path, source.folder)] = file_digest(each.path)
        decks = {each.folder / name for _, name in named_files(each.pipeline) if isinstance(name, DeckName)}
        for file in source_files(each):
            digest = mesh_digest if file in decks else file_digest
            found[relative(file, source.folder)] = digest(file)
    return found


def output_digests(job: Job, files: Iterable[Path]) -> dict[str, str]:
    """Return the hash of each file inside the job's own folder."""
    inside = [file for file in files if file.resolve().is_relative_to(job.folder.resolve())]
    return {relative(file, job.folder): file_digest(file) for file in inside}


def write_manifest(job: Job, record: Record) -> None:
    """Write the record of a job; the file is written completely or not at all."""
    with atomic_path(job.manifest) as temporary:
        temporary.write_text(json.dumps(HEAD | record, indent=1))


def finished(job: Job, program: dict[str, str], read: Callable[[], Loaded] | None = None) -> Record | None:
    """Return the record of a job finished with these inputs by this program and with intact outputs, else None.

    Parameters
    ----------
    read : callable, optional
        Returns its pipeline file.
    """
    try:
        record = json.loads(job.manifest.read_text())
        good = record["format"] == HEAD["format"] and record["status"] == DONE and record["program"] == program
        good = good and record["inputs"] == input_digests(read() if read else load(job.file))
        outputs = {name: file_digest(job.folder / name) for name in record["outputs"]} if good else {}
        whole = good and outputs == record["outputs"]
        return {key: value for key, value in record.items() if key not in HEAD} if whole else None
    except (OSError, ValueError, LookupError, TypeError, AttributeError, InputError):
        return None


def any_record(job: Job) -> Record | None:
    """Return the record of a job that is finished, or has failed; None where there is none."""
    try:
        record = json.loads(job.manifest.read_text())
    except (OSError, ValueError):
        return None
    if record.get("status") == DONE:
        return finished(job, record.get("program", {}))
    return {key: value for key, value in record.items() if key not in HEAD} if "status" in record else None
