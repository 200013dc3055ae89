"""Workers that a system of queues starts: a queue of this machine stands for Slurm."""

import gc
import os
import re
import sys
import tomllib

import pytest
from batches import manifests, write_grid

from modalprep.cli import main
from modalprep.pipeline.batch.cluster import ClusterTable, TlsTable
from modalprep.workers.scheduler import KINDS

pytest.importorskip("dask_jobqueue")
pytestmark = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # half a cluster of Dask
SBATCH = """#!{python}
import subprocess, sys
script = [line for line in open(sys.argv[-1]) if not line.startswith("#")]
process = subprocess.Popen(["sh", "-c", "".join(script)], cwd="{home}", stdout=open("{home}/log", "a"),
                           stderr=subprocess.STDOUT, start_new_session=True)
open("{home}/submitted", "a").write(str(process.pid) + "\\n")
print("Submitted batch job", process.pid)
"""
SCANCEL = """#!{python}
import os, signal, sys
for job in sys.argv[1:]:
    open("{home}/cancelled", "a").write(job + "\\n")
    os.killpg(int(job), signal.SIGKILL)
"""
FILE = """
kind = "slurm"
{jobs}

[options]
cores = 1
processes = 1
memory = "2 GiB"
walltime = "00:10:00"
interface = "lo"
python = "{python}"
"""


@pytest.fixture(autouse=True)
def collected():
    """What is left of clusters that could not start is removed here, where it may warn."""
    yield
    gc.collect()


@pytest.fixture
def queue(tmp_path, monkeypatch):
    """A folder with the programs of Slurm, which start each job at once."""
    home = tmp_path / "queue"
    home.mkdir()
    for name, text in (("sbatch", SBATCH), ("scancel", SCANCEL)):
        (home / name).write_text(text.format(python=sys.executable, home=home))
        (home / name).chmod(0o755)
    monkeypatch.setenv("PATH", f"{home}:{os.environ['PATH']}")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(path for path in sys.path if path))
    return home


@pytest.mark.slow
@pytest.mark.parametrize("jobs", ["jobs = 2", "maximum = 2"])
def test_a_queue_starts_the_workers_and_they_end(project, tmp_path, queue, capsys, jobs):
    file = write_grid(project, tmp_path / "beam.toml", reduction__modes=[2, 3])
    (tmp_path / "cluster.toml").write_text(FILE.format(jobs=jobs, python=sys.executable))
    assert main(["batch", str(file), "--cluster", str(tmp_path / "cluster.toml")]) == 0
    printed = capsys.readouterr().out
    assert "no worker has come yet; the jobs wait for one" in printed
    assert set(manifests(tmp_path / "output")) == {"beam-modes=2", "beam-modes=3"}
    submitted, cancelled = ((queue / name).read_text().split() for name in ("submitted", "cancelled"))
    assert set(submitted) == set(cancelled)


def test_a_queue_that_refuses_says_why(project, tmp_path, queue, capsys):
    """The batch waited for workers that never came."""
    (queue / "sbatch").write_text("#!/bin/sh\necho 'sbatch: error: invalid partition' >&2\nexit 1\n")
    file = write_grid(project, tmp_path / "beam.toml", reduction__modes=[2])
    (tmp_path / "cluster.toml").write_text(FILE.format(jobs="jobs = 2", python=sys.executable))
    assert main(["batch", str(file), "--cluster", str(tmp_path / "cluster.toml")]) == 2
    error = capsys.readouterr().err
    assert "the slurm cluster cannot be started: " in error
    assert "invalid partition" in error
    assert error.count("\n") == 1


def test_no_queue_here(project, tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    file = write_grid(project, tmp_path / "beam.toml", reduction__modes=[2])
    assert main(["batch", str(file), "--cluster", "slurm", "-j", "2"]) == 2
    assert "--cluster slurm: this machine has no sbatch" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("kind = 'slurm'\nscheduler = 'tcp://a:1'", "give either the 'kind' of a cluster to start, or the 'scheduler'"),
        ("jobs = 2", "give either the 'kind'"),
        ("kind = 'slurm'\njobs = 2\nmaximum = 3", "'jobs' and 'maximum' contradict each other"),
        ("kind = 'slurm'\nminimum = 4\nmaximum = 3", "exchange them"),
        ("kind = 'slurm'\nquota = 4", "unknown key 'quota'"),
        ("kind = 'slurm'\n[options]\nquota = 4", "the slurm cluster cannot be started"),
        ("kind = slurm", "is not valid TOML"),
        ("scheduler = 'tcp://a:1'\njobs = 2", "have no effect with a 'scheduler'"),
        ("scheduler = 'tls://a:1'\n[tls]\nca = 'a'\ncert = 'b'\nkey = 'c'", "ca of the TLS connection"),
        ("scheduler = 'scheduler.json'", "scheduler file"),
    ],
)
def test_bad_files(project, tmp_path, queue, capsys, text, said):
    file = write_grid(project, tmp_path / "beam.toml", reduction__modes=[2])
    (tmp_path / "cluster.toml").write_text(text)
    assert main(["batch", str(file), "--cluster", str(tmp_path / "cluster.toml")]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1


def test_no_such_queue(project, tmp_path, capsys):
    file = write_grid(project, tmp_path / "beam.toml", reduction__modes=[2])
    assert main(["batch", str(file), "--cluster", "slrum"]) == 2
    assert "did you mean 'slurm'" in capsys.readouterr().err


def test_docs_of_the_file(project):
    """Every key of the file is on its page, and its examples can be read."""
    page = (project / "docs" / "how-to" / "clusters.md").read_text()
    for name in (*ClusterTable.model_fields, *TlsTable.model_fields, *KINDS):
        assert re.search(rf"\b{name}\b", page), name
    blocks = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    assert [ClusterTable.model_validate(tomllib.loads(block)).kind for block in blocks] == ["slurm", None]
