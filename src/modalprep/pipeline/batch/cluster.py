"""How a Dask cluster is started or reached: the TOML file of ``batch --cluster``."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError, model_validator

from modalprep.errors import InputError
from modalprep.pipeline.schema.base import Table, first_message
from modalprep.suggest import suggestion
from modalprep.workers.scheduler import KINDS, Scheduler


class TlsTable(Table):
    """Files of an encrypted connection."""

    ca: str = Field(description="certificates of the authority, PEM")
    cert: str = Field(description="certificate of this user, PEM")
    key: str = Field(description="private key of this user, PEM")


class ClusterTable(Table):
    """A Dask cluster that is started for a batch, or one that runs."""

    kind: Literal["local", "slurm", "pbs", "sge", "lsf", "oar", "moab", "htcondor"] | None = Field(
        None, description="system of queues that starts the workers"
    )
    scheduler: str | None = Field(None, description="address of a scheduler that runs, or the file that it has written")
    jobs: Annotated[int, Field(ge=1)] | None = Field(None, description="jobs of the queue, as -j")
    minimum: Annotated[int, Field(ge=0)] = Field(0, description="jobs of the queue that are kept")
    maximum: Annotated[int, Field(ge=1)] | None = Field(
        None, description="most jobs of the queue, whose number then follows the work"
    )
    options: dict[str, Any] = Field(
        {}, description="of the class that starts the cluster, such as queue, cores, memory"
    )
    tls: TlsTable | None = Field(None, description="files of an encrypted connection; default as Dask is configured")
    resources: dict[str, float] = Field({}, description="what a job needs of its worker, as Dask counts it")

    @model_validator(mode="after")
    def _one_way(self) -> ClusterTable:
        if (self.kind is None) == (self.scheduler is None):
            raise ValueError("give either the 'kind' of a cluster to start, or the 'scheduler' of one that runs")
        if self.kind is None and (self.jobs or self.maximum or self.minimum or self.options):
            raise ValueError("'jobs', 'minimum', 'maximum' and 'options' have no effect with a 'scheduler' that runs")
        if self.jobs and self.maximum:
            raise ValueError("'jobs' and 'maximum' contradict each other; give one of them")
        if self.maximum is not None and self.minimum > self.maximum:
            raise ValueError(f"'minimum' is {self.minimum} and 'maximum' {self.maximum}; exchange them")
        return self


def named_cluster(name: str, jobs: int | None) -> Scheduler:
    """Return the cluster of a name such as ``slurm``, or of a TOML file.

    Parameters
    ----------
    name : str
    jobs : int or None
        Jobs of the queue, instead of what the file says.

    Raises
    ------
    InputError
        When there is neither such a system of queues nor such a file, or the file cannot be used.

    Examples
    --------
    >>> named_cluster("slurm", 4).jobs
    4
    """
    if name in KINDS:
        return Scheduler(kind=name, jobs=jobs or 1)
    file = Path(name)
    if not file.is_file():
        raise InputError(f"--cluster {name}: {suggestion(name, KINDS, 'known are')}, or give a TOML file with options")
    table = _read(file)
    if jobs is not None and table.scheduler:
        raise InputError(f"-j {jobs} has no effect with the scheduler of {file}; leave it out")
    many = jobs or table.jobs or ((table.minimum, table.maximum) if table.maximum else 1)
    tls = {key: file.parent / value for key, value in table.tls.model_dump().items()} if table.tls else {}
    where = table.scheduler or ""
    address = str((file.parent / where).absolute()) if where.endswith(".json") else where
    return Scheduler(address, table.kind or "", table.options, many, tls, table.resources)


def _read(file: Path) -> ClusterTable:
    try:
        return ClusterTable.model_validate(tomllib.loads(file.read_text(encoding="utf-8-sig")))
    except ValidationError as error:
        where = ".".join(str(part) for part in error.errors()[0]["loc"])
        raise InputError(f"{file}: {f'{where}: ' if where else ''}{first_message(error)}") from None
    except ValueError as error:
        raise InputError(f"{file} is not valid TOML: {error}") from None
