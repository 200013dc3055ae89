"""The session of gmsh, which is imported only here, and limits of the meshes that it makes."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

from modalprep.errors import InputError
from modalprep.extras import need

ADVICE = (  # what libgmsh links to, also without a display
    "as root: apt-get install libgl1 libglu1-mesa libgomp1 libfontconfig1 libx11-6 libxcursor1 libxext6 libxfixes3 "
    "libxft2 libxinerama1 libxrender1"
)
OPTIONS = {  # the same input gives the same bytes
    "General.Terminal": 0,
    "General.NumThreads": 1,
    "Mesh.MshFileVersion": 4.1,
    "Mesh.Binary": 0,
    "Mesh.SecondOrderIncomplete": 1,  # 20 nodes in a hexahedron, not 27
}

LIMIT = 500_000  # elements: gmsh makes as many in half a minute
TETRAHEDRA = 8.5  # in a cube whose edge is the element size: 6 sqrt(2)
SEGMENTS = 16  # elements around a circle, at least


@contextmanager
def gmsh_session() -> Iterator[Any]:
    """Open gmsh, silent and with its own defaults, and close it whatever happens.

    Raises
    ------
    InputError
        When gmsh is not installed, cannot be imported, or is open already.
    """
    need("gmsh", "a mesh of a CAD file or of a shape")
    try:
        import gmsh
    except (ImportError, OSError) as error:
        raise InputError(f"gmsh cannot be imported: {error} ({ADVICE})") from None
    if gmsh.isInitialized():
        raise InputError("gmsh is open in this program, with a model of its own; call gmsh.finalize() first")
    gmsh.initialize(readConfigFiles=False, interruptible=False)  # Ctrl-C stays Python's
    _raise_at_broken_pipes()
    try:
        for option, value in OPTIONS.items():
            gmsh.option.setNumber(option, value)
        yield gmsh
    finally:
        gmsh.finalize()


def _raise_at_broken_pipes() -> None:
    """Let a pipe that nobody reads raise BrokenPipeError again: gmsh has it end the program without a word."""
    if hasattr(signal, "SIGPIPE"):
        with suppress(ValueError):  # only the main thread may say so
            signal.signal(signal.SIGPIPE, signal.getsignal(signal.SIGPIPE))


def refuse_too_many(count: float, remedy: str) -> None:
    """Raise InputError when a mesh would have more than `LIMIT` elements."""
    if count > LIMIT:
        raise InputError(f"the mesh would have about {count:.2g} elements, more than {LIMIT}; {remedy}")
