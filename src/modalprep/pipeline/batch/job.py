"""Jobs of a batch and their records.

Light to import, like `modalprep.workers`: a worker process sets its threads before numpy is loaded.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

Record = dict[str, Any]
DONE, FAILED = "done", "failed"


class Cell(NamedTuple):
    """A combination of a grid.

    Attributes
    ----------
    file : Path
        The pipeline file with the grid.
    keys : tuple of str
        Short names of the parameters.
    values : tuple
        As in the file.
    """

    file: Path
    keys: tuple[str, ...]
    values: tuple[Any, ...]


@dataclass(frozen=True)
class Job:
    """One pipeline file to run.

    Attributes
    ----------
    file : Path
    output : Path or None
        Folder of outputs, as `run_pipeline` takes it.
    values : {key: text}
        Values chosen by a grid.
    cell : Cell or None
        The combination of the grid.
    inputs : dict of str or None
        Hashes of the files that it reads, where its worker must see the same.
    """

    file: Path
    output: Path | None
    values: dict[str, str] = field(default_factory=dict)
    cell: Cell | None = None
    inputs: dict[str, str] | None = None

    def at_home(self, inputs: dict[str, str] | None) -> Job:
        """Return the job for a worker with another working folder, and the hashes of its inputs.

        Examples
        --------
        >>> Job(Path("a.toml"), None).at_home({}).file == Path.cwd() / "a.toml"
        True
        """
        output = None if self.output is None else self.output.absolute()
        return replace(self, file=self.file.absolute(), output=output, inputs=inputs)

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
        """Log file of its run."""
        return self.folder / f"{self.name}.log"

    @property
    def manifest(self) -> Path:
        """The record of its last run."""
        return self.folder / "manifest.json"


@dataclass(frozen=True)
class Setting:
    """Settings shared by all jobs of a batch.

    Attributes
    ----------
    cache : Path or None
    limit : float
        Size of the cache, bytes.
    program : dict of str
        Program of the batch; workers must have the same.
    """

    cache: Path | None
    limit: float
    program: dict[str, str]


def failure(job: Job, cause: str, error: BaseException | None = None) -> Record:
    """Return the record of a failed job, with the type of its error if there was one.

    Examples
    --------
    >>> failure(Job(Path("a.toml"), None), "its mesh is missing")["cause"]
    'its mesh is missing'
    """
    kind = type(error).__name__ if error else ""
    return {"job": job.name, "pipeline": str(job.file), "status": FAILED, "cause": cause, "error": kind, "seconds": 0.0}
