"""Batches of small beams, shared by the tests of batches."""

import json
import os
import signal
import subprocess
import sys
from contextlib import contextmanager, suppress

import numpy as np
from bad.good import BEAM

import modalprep as mp

ENTRY = "from modalprep.cli import entry; entry()"


def write_beam(project, file, **options):
    """Write a pipeline file of the beam, with options of [reduction]."""
    text = BEAM.replace("beam.msh", str(project / "meshes" / "beam.msh"))
    lines = "".join(f"{key} = {value}\n" for key, value in options.items())
    file.write_text(text.replace("modes = 3\n", lines or "modes = 3\n"))
    return file


def write_grid(project, file, **grid):
    """Write a pipeline file of the beam with a grid; dots in its keys are written as two underscores."""
    lines = "".join(f'"{key.replace("__", ".")}" = {values}\n' for key, values in grid.items())
    write_beam(project, file)
    file.write_text(file.read_text() + f"[grid]\n{lines}")
    return file


@contextmanager
def started(*arguments, **options):
    """Start ``modalprep batch`` in a session of its own, so that what outlives it is found; in the end all is ended."""
    command = [sys.executable, "-c", ENTRY, "batch", *map(str, arguments)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, "start_new_session": True}
    with subprocess.Popen(command, **pipes | options) as process:
        try:
            yield process
        finally:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)


def manifests(output):
    """Return the manifest of each job by its name."""
    found = {file.parent.name: json.loads(file.read_text()) for file in output.glob("*/manifest.json")}
    return {name: record for name, record in found.items() if record["status"] == "done"}


def outlived(process):
    """Say whether any process of a session is left."""
    try:
        os.killpg(process.pid, 0)
    except ProcessLookupError:
        return False
    return True


def same_body(first, second, tolerance):
    """Compare the numbers of two modal files, relative to the largest of each array."""
    a, b = mp.read_body(first), mp.read_body(second)
    pairs = [(getattr(a, name), getattr(b, name)) for name in ("m", "frequency", "S", "P", "Kg_W", "D")]
    return all(np.shape(x) == np.shape(y) and np.max(np.abs(x - y)) <= tolerance * np.max(np.abs(y)) for x, y in pairs)


class Inline:
    """A team that works in this process: what does not need others is tested without waiting for their start."""

    free = 1

    def __init__(self, size, task, limits=None):
        self.size, self.task, self.done = size, task, []

    def submit(self, job):
        self.done.append((job, self.task.run(job)))

    def collect(self, seconds):
        done, self.done = self.done, []
        return done

    def news(self):
        return []

    def close(self):
        pass
