"""Pictures of a body by a process of its own, beside the reduction and the page."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from threading import Timer

from modalprep.body.flexible_body import FlexibleBody
from modalprep.report.pictures import render

PAINT = "import modalprep.cli, modalprep.report.charts; from modalprep.report.painter import paint; paint()"
READY, DRAWN = "ready\n", "drawn\n"
GRACE = 5.0  # s, in which a process that is asked to end does so


class Painter:
    """A process that loads VTK and tries it while there is no body yet, then draws the mesh and modes of one.

    Whatever goes wrong there, `drawn` says that not all is drawn, and the caller draws, or finds out why it cannot.
    """

    def __init__(self) -> None:
        pipe = subprocess.PIPE
        command = [sys.executable, "-c", PAINT]
        environment = render.environment(render.EGL)
        self._process = subprocess.Popen(command, env=environment, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL)
        assert self._process.stdin is not None  # as it is a pipe
        assert self._process.stdout is not None
        self._input = self._process.stdin
        self._output = self._process.stdout
        self._count = 0  # of pictures

    def begin(self, body: FlexibleBody, mesh_picture: Path, pictures: Mapping[int, Path]) -> None:
        """Let it draw the mesh and the modes (counted from 1) of a body, each into its file."""
        late = Timer(render.PATIENCE, self._process.kill)
        late.start()
        ready = self._output.readline().decode() == READY
        late.cancel()
        if ready:
            render.trust()
            with suppress(OSError):
                pickle.dump((body, mesh_picture, dict(pictures)), self._input)
                self._input.flush()
                self._count = 1 + len(pictures)

    def drawn(self) -> Iterator[int]:
        """Yield the number of modes that are drawn, from 0 for the mesh; returns whether all are."""
        for count in range(self._count):
            if self._output.readline().decode() != DRAWN:
                return False
            yield count
        return self._count > 0

    def close(self) -> None:
        """End the process; a picture that is half drawn leaves no file."""
        with suppress(OSError):
            self._input.close()
        if self._process.poll() is None:
            self._process.terminate()
        self._output.close()
        try:
            self._process.wait(GRACE)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


def paint() -> None:
    """Be the process of a `Painter`."""
    import gc
    import signal

    signal.signal(signal.SIGTERM, signal.default_int_handler)  # which removes what is half written
    gc.set_threshold(500_000, 10, 10)
    try:
        exec(render.PROBE, {})
    except SystemExit as tried:
        if tried.code:
            os._exit(1)
    render.trust()
    render.refuse_drawing()
    import pyvista.plotting
    import vtkmodules.vtkFiltersGeometry
    import vtkmodules.vtkViewsContext2D

    from modalprep.report.pictures import sheet, surface

    del pyvista, vtkmodules, surface  # here to be loaded while there is no body

    _say(READY)
    body, mesh_picture, pictures = pickle.load(sys.stdin.buffer)
    render.render_mesh(body, mesh_picture)
    _say(DRAWN)
    for _ in sheet.render_modes(body, pictures):
        _say(DRAWN)
    os._exit(0)  # VTK takes long to end


def _say(word: str) -> None:
    print(word, end="", flush=True)
