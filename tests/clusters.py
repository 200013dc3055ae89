"""Dask clusters of this machine, as processes in folders of their own."""

import json
import os
import subprocess
import sys
import time
from contextlib import contextmanager


def until(condition, seconds):
    """Wait until a condition holds; fail when it takes too long."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def module(name, folder, *arguments, source=()):
    """Start a program of Dask in a folder, which is its home too; `source` holds another modalprep."""
    paths = [*map(str, source), *(path for path in sys.path if path)]
    options = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": folder}
    environment = os.environ | {"HOME": str(folder), "PYTHONPATH": os.pathsep.join(paths)}
    command = [sys.executable, "-m", f"distributed.cli.{name}", *map(str, arguments)]
    return subprocess.Popen(command, env=environment, **options)


@contextmanager
def scheduler_in(folder, port=0):
    """Yield a process of a scheduler and the file with its address."""
    file = folder / "scheduler.json"
    file.unlink(missing_ok=True)
    options = ["--host", "127.0.0.1", "--port", port, "--no-dashboard", "--scheduler-file", file]
    process = module("dask_scheduler", folder, *options)
    try:
        until(lambda: file.is_file() and file.read_text().rstrip().endswith("}"), 60)
        yield process, file
    finally:
        end([process])


def start_worker(folder, address, *options, source=()):
    """Start a worker of one thread without nanny, ended by a single signal."""
    own = ["--nthreads", 1, "--no-nanny", "--no-dashboard", "--local-directory", folder / "dask"]
    return module("dask_worker", folder, address, *own, *options, source=source)


def address_in(file):
    """Return the address in the file of a scheduler."""
    return json.loads(file.read_text())["address"]


def workers_of(address):
    """Return the addresses of the workers that a scheduler has."""
    from distributed import Client

    with Client(address, timeout="60s", set_as_default=False) as client:
        return list(client.nthreads())


def end(processes):
    """Kill processes."""
    for process in processes:
        process.kill()
        process.wait()
