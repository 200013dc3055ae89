"""What a batch runs, and the record that each job leaves.

Light to import, like `workers`: a worker process sets its threads before numpy is loaded.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

Record = dict[str, Any]
DONE, FAILED = "done", "failed"


@dataclass(frozen=True)
class Job:
    """One pipeline file to run.

    Attributes
    ----------
    file : Path
    output : Path or None
        Folder of outputs, as `run_pipeline` takes it.
    values : {key: text}
        What a grid chose.
    """

    file: Path
    output: Path | None
    values: dict[str, str] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """The name of the file, and of the folder with its outputs."""
        return self.file.stem

    @property
    def folder(self) -> Path:
        """Folder of its own outputs."""
        return (self.output or self.file.parent / "output") / self.name

    @property
    def log(self) -> Path:
        """What its run says."""
        return self.folder / f"{self.name}.log"

    @property
    def manifest(self) -> Path:
        """The record of its last run."""
        return self.folder / "manifest.json"


@dataclass(frozen=True)
class Setting:
    """What every job of a batch shares.

    Attributes
    ----------
    cache : Path or None
    limit : float
        Size of the cache, bytes.
    program : dict of str
        That of the batch, which a worker must have too.
    """

    cache: Path | None
    limit: float
    program: dict[str, str]


def failure(job: Job, cause: str, error: BaseException | None = None) -> Record:
    """Return the record of a job that could not be run to its end, with the kind of its error if it ended by one.

    Examples
    --------
    >>> failure(Job(Path("a.toml"), None), "its mesh is missing")["cause"]
    'its mesh is missing'
    """
    kind = type(error).__name__ if error else ""
    return {"job": job.name, "pipeline": str(job.file), "status": FAILED, "cause": cause, "error": kind, "seconds": 0.0}


def relative(file: Path, folder: Path) -> str:
    """Return a file as seen from a folder, so that both may be moved together.

    Examples
    --------
    >>> relative(Path("meshes/a.msh"), Path("pipelines"))
    '../meshes/a.msh'
    """
    try:
        return Path(os.path.relpath(file.resolve(), folder.resolve())).as_posix()
    except ValueError:  # another drive
        return file.resolve().as_posix()
