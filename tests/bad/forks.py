"""A process with all modules loaded that forks for each run: killed, short of disk space, or as another user.

It computes nothing itself: libraries that have do not outlive a fork.
"""

import json
import os
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

from size import FULL

SERVER = """
import glob, json, os, resource, signal, sys, time
import matplotlib.pyplot, meshio, modalprep.pipeline.batch.batch, modalprep.pipeline.building.build
import modalprep.pipeline.systems.systems
import modalprep.report.page, modalprep.report.charts.plots, pyvista
from modalprep.cli import main
sys.path.insert(0, {tests!r})
from batches import Inline
modalprep.pipeline.batch.dispatch.Processes = Inline  # others would import all that again
if not {full}:
    from PIL import Image
    from modalprep.report.charts import figures
    figures._drawn = lambda _: Image.new("P", (1, 1))  # charts take half the time of a short run
if {draws}:
    from modalprep.report.pictures.render import drawing_problem
    drawing_problem()  # tried in a process of its own
    pyvista.Plotter.enable_anti_aliasing = lambda *_, **__: None  # smooth edges take twice the time

def child(order):
    for number, name in ((1, os.devnull), (2, order["error"])):
        os.dup2(os.open(name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), number)
    if order["limit"] is not None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (order["limit"],) * 2)
    if order["user"] is not None:
        os.setuid(order["user"])
    try:
        code = main(order["arguments"])
        sys.stderr.flush()
    except BaseException:
        import traceback
        traceback.print_exc()
        code = 99
    os._exit(code)

for line in sys.stdin:
    order, start = json.loads(line), time.monotonic()
    process = os.fork()
    if not process:
        child(order)
    ended = 0
    while order["moment"] is not None and not ended:
        if any(order["moment"] in name for _, _, names in os.walk(order["folder"]) for name in names):
            order["kill"] = 0.0
            break
        time.sleep(0.001)
        ended, status = os.waitpid(process, os.WNOHANG)
    if order["kill"] is not None:
        time.sleep(order["kill"])
        os.kill(process, signal.SIGKILL)
    if not ended:
        _, status = os.waitpid(process, 0)
    for left in glob.glob(f"/dev/shm/__KMP_REGISTERED_LIB_{process}_*"):  # of OpenMP in a process that was killed
        os.unlink(left)
    print("DONE", os.waitstatus_to_exitcode(status), time.monotonic() - start, flush=True)
"""
TESTS = str(Path(__file__).parents[1])
THREADS = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "MKL", "OPENBLAS")}


class Forks:
    """Orders to the process that forks, and what became of them."""

    def __init__(self, process, folder):
        self._process, self._error = process, folder / "error.txt"

    def run(self, *arguments, kill=None, moment=None, folder=None, limit=None, user=None):
        """Return exit code, standard error and seconds of a run.

        It is killed after `kill` seconds, or as soon as there is a file in `folder` whose name contains `moment`.
        """
        order = {"arguments": [str(a) for a in arguments], "error": str(self._error)}
        order |= {"kill": kill, "moment": moment, "folder": str(folder), "limit": limit, "user": user}
        print(json.dumps(order), file=self._process.stdin, flush=True)
        while not (line := self._process.stdout.readline()).startswith("DONE"):
            assert line, "the process that forks has died"
        _, code, seconds = line.split()
        return int(code), self._error.read_text(), float(seconds)


@contextmanager
def forks(folder, *, draws=False):
    """Start the process that forks; what it writes about itself goes into a folder. `draws`: pictures of meshes too."""
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    code = SERVER.replace("{draws}", str(draws)).replace("{full}", str(bool(FULL))).replace("{tests!r}", repr(TESTS))
    command = [sys.executable, "-c", code]
    with subprocess.Popen(command, env=os.environ | THREADS, **pipes) as process:
        try:
            yield Forks(process, folder)
        finally:
            process.stdin.close()
