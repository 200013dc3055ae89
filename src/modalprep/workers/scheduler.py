"""How a Dask cluster is reached, or started."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from shutil import which
from typing import TYPE_CHECKING, Any

from modalprep.errors import InputError
from modalprep.extras import need
from modalprep.suggest import refuse_missing

if TYPE_CHECKING:
    from distributed import Client
    from distributed.deploy.cluster import Cluster

ANSWER = 30.0  # s, timeout of a scheduler
KINDS = {  # by which class a cluster is started
    "local": "distributed.LocalCluster",
    "slurm": "dask_jobqueue.SLURMCluster",
    "pbs": "dask_jobqueue.PBSCluster",
    "sge": "dask_jobqueue.SGECluster",
    "lsf": "dask_jobqueue.LSFCluster",
    "oar": "dask_jobqueue.OARCluster",
    "moab": "dask_jobqueue.MoabCluster",
    "htcondor": "dask_jobqueue.HTCondorCluster",
}


@dataclass(frozen=True)
class Scheduler:
    """A Dask cluster that runs, or one to be started by a system of queues.

    Attributes
    ----------
    address : str
        Of a scheduler that runs, such as ``tcp://host:8786``, or the file that it has written.
    kind : str
        Of a cluster to be started: one of `KINDS`.
    options : dict
        Of the class that starts it, such as ``{"queue": "normal", "cores": 8, "memory": "32 GB"}``.
    jobs : int or (int, int)
        Jobs of the queue; least and most, where their number follows the work.
    tls : {"ca", "cert", "key": Path}
        Files of an encrypted connection; none: as Dask is configured.
    resources : {str: float}
        What a job needs of its worker, as Dask counts it.

    Examples
    --------
    >>> print(Scheduler("tcp://host:8786"))
    the Dask scheduler at tcp://host:8786
    """

    address: str = ""
    kind: str = ""
    options: Mapping[str, Any] = field(default_factory=dict)
    jobs: int | tuple[int, int] = 1
    tls: Mapping[str, Path] = field(default_factory=dict)
    resources: Mapping[str, float] = field(default_factory=dict)

    def __str__(self) -> str:
        """Name it in a sentence."""
        return f"the Dask scheduler at {self.address}" if self.address else f"the {self.kind} cluster"


def connect(scheduler: Scheduler) -> tuple[Client, Cluster | None]:
    """Return a client of a cluster, and the cluster where it is started here.

    Raises
    ------
    InputError
        When a library is not installed, a file is missing, or no scheduler answers.
    """
    from distributed import Client

    cluster = _started(scheduler) if scheduler.kind else None
    options = {"timeout": ANSWER, "set_as_default": False, "name": "modalprep"} | _security(scheduler)
    try:
        return Client(_where(scheduler) if cluster is None else cluster, **options), cluster
    except (OSError, TimeoutError, ValueError) as error:
        if cluster is not None:
            cluster.close()
        said = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"no Dask scheduler answers at {scheduler.address or scheduler.kind}: {said}") from None


def _where(scheduler: Scheduler) -> str | dict[str, str]:
    if not scheduler.address.endswith(".json"):
        return scheduler.address
    import json

    refuse_missing(Path(scheduler.address), "scheduler file")
    try:
        return json.loads(Path(scheduler.address).read_text(encoding="utf-8"))["address"]
    except (ValueError, LookupError, TypeError):
        raise InputError(
            f"scheduler file {scheduler.address} does not hold an address; give the file that dask scheduler writes"
        ) from None


def _security(scheduler: Scheduler) -> dict[str, Any]:
    if not scheduler.tls:
        return {}
    from distributed.security import Security

    for name, file in scheduler.tls.items():
        refuse_missing(file, f"{name} of the TLS connection")
    names = {"ca": "tls_ca_file", "cert": "tls_client_cert", "key": "tls_client_key"}
    files = {names[name]: str(file) for name, file in scheduler.tls.items()}
    return {"security": Security(require_encryption=True, **files)}


def _started(scheduler: Scheduler) -> Cluster:
    package, name = KINDS[scheduler.kind].split(".")
    need(package, f"a {scheduler.kind} cluster")
    kind = getattr(import_module(package), name)
    _refuse_missing_queue(scheduler.kind, getattr(kind, "job_cls", None))
    cluster = None
    try:
        with warnings.catch_warnings(action="ignore"):  # as of another port for the dashboard, which is printed
            cluster = kind(**scheduler.options)
        _scale(cluster, scheduler)
    except (TypeError, ValueError, OSError, RuntimeError) as error:
        if cluster is not None:
            cluster.close()
        raise InputError(f"the {scheduler.kind} cluster cannot be started: {' '.join(str(error).split())}") from None
    return cluster


def _refuse_missing_queue(kind: str, job: Any) -> None:
    command = getattr(job, "submit_command", None)
    if command and which(command.split()[0]) is None:
        raise InputError(f"--cluster {kind}: this machine has no {command.split()[0]}; run it where jobs are submitted")


def _scale(cluster: Cluster, scheduler: Scheduler) -> None:
    """Ask for workers; what the system of queues refuses is raised."""
    unit = "" if scheduler.kind == "local" else "_jobs"
    if isinstance(scheduler.jobs, tuple):
        least, most = scheduler.jobs
        limits: dict[str, Any] = {f"minimum{unit}": least, f"maximum{unit}": most}
        cluster.adapt(**limits)
        return
    cluster.scale(**{"jobs" if unit else "n": scheduler.jobs})
    cluster.sync(_submitted, cluster)


async def _submitted(cluster: Any) -> None:
    from distributed.core import Status

    await cluster
    workers = list(cluster.workers.values())
    try:
        for worker in workers:
            await worker
    except BaseException:
        for worker in workers:
            worker.status = Status.failed if worker.status == Status.created else worker.status
        raise  # the cluster can be closed now
