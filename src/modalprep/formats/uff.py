"""Universal file: nodes, elements and mode shapes for modal test and correlation programs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from modalprep.atomic import atomic_path
from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.fe.mesh.cells import cell_of
from modalprep.formats.refusals import refuse_without_modes

BEAM = 21  # has a record of its own for orientation and cross sections
COLOUR = 7
SI = (1.0, 1.0, 1.0, 273.15)  # factors of length, force and temperature, offset of temperature
STRUCTURAL, NORMAL_MODE, TRANSLATIONS, DISPLACEMENT, REAL = 1, 2, 2, 8, 2  # codes of dataset 55


def write_uff(body: FlexibleBody, path: str | Path) -> Path:
    """Write datasets 164 (units), 2411 (nodes), 2412 (elements) and one 55 (normal mode) for each mode.

    Nodes are labelled 1, 2, ... in the order of `body.points` (m, frame B). Each dataset 55 holds the frequency in Hz
    (as in the modal file, with the root interface clamped), modal mass 1 kg, the viscous damping ratio, and the
    translations of every node with the sign of the modal file, in 1/sqrt(kg).

    Lost: rotations of nodes and interfaces; digits beyond six of shapes and frequencies, the precision of the
    format; elements are written by their corners, mid-side nodes remain as nodes.

    Parameters
    ----------
    body : FlexibleBody
    path : str or Path
        Usually ``.unv`` or ``.uff``.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        When the body has no mesh or no modes, or the folder cannot be written.

    References
    ----------
    SDRC I-DEAS universal file format, datasets 164, 2411, 2412, 55 (University of Cincinnati).

    Examples
    --------
    >>> import tempfile
    >>> from modalprep.examples import uniform_beam
    >>> file = write_uff(uniform_beam(modes=2), Path(tempfile.mkdtemp()) / "beam.unv")
    >>> [int(a) for a, b in zip(file.read_text().splitlines()[1:], file.read_text().splitlines()) if b == "    -1"
    ...  and a != "    -1"]
    [164, 2411, 2412, 55, 55]
    """
    if not body.cells:
        raise InputError(f"body {body.name!r} has no mesh to write; a universal file needs one")
    refuse_without_modes(body, "to a file of modes", "a rigid body has none")
    with atomic_path(path) as temporary, open(temporary, "w", encoding="ascii", errors="replace") as file:
        file.writelines(_dataset(164, _units()))
        file.writelines(_dataset(2411, _nodes(body.points)))
        file.writelines(_dataset(2412, _elements(body.cells)))
        for k in range(body.n):
            file.writelines(_dataset(55, _mode(body, k)))
    return Path(path)


def _dataset(number: int, lines: Iterable[str]) -> Iterator[str]:
    yield f"{-1:6d}\n{number:6d}\n"
    yield from (line + "\n" for line in lines)
    yield f"{-1:6d}\n"


def _integers(*values: int) -> str:
    return "".join(f"{value:10d}" for value in values)


def _reals(values: Iterable[float]) -> str:
    return "".join(f"{value:13.5E}" for value in values)


def _doubles(values: Iterable[float]) -> str:
    return "".join(f"{value:25.16E}" for value in values).replace("E", "D")


def _units() -> Iterator[str]:
    yield f"{1:10d}{'SI: Meter (newton)':20}{2:10d}"
    yield _doubles(SI[:3])
    yield _doubles(SI[3:])


def _nodes(points: np.ndarray) -> Iterator[str]:
    for label, x in enumerate(points.tolist(), start=1):
        yield _integers(label, 1, 1, COLOUR)
        yield _doubles(x)


def _elements(cells: dict[str, np.ndarray]) -> Iterator[str]:
    label = 0
    for kind, nodes in cells.items():
        cell = cell_of(kind)
        if cell is None or cell.uff is None:  # a point
            continue
        descriptor, corners = cell.uff
        for row in (nodes[:, corners] + 1).tolist():
            label += 1
            yield _integers(label, descriptor, 1, 1, COLOUR, len(row))
            if descriptor == BEAM:
                yield _integers(0, 1, 1)
            yield _integers(*row)


def _mode(body: FlexibleBody, k: int) -> Iterator[str]:
    omega = np.sqrt(body.K[k])
    ratio = body.D[k] / (2 * omega) if omega > 0 else 0.0
    title = f"Mode {k + 1}, frequency {body.frequency[k]:.6g} Hz"
    yield from (line[:80] for line in (f"Body {body.name}", f"Frame: {body.frame}", "NONE", title, title))
    yield _integers(STRUCTURAL, NORMAL_MODE, TRANSLATIONS, DISPLACEMENT, REAL, 3)
    yield _integers(2, 4, 1, k + 1)
    yield _reals((body.frequency[k], 1.0, ratio, 0.0))
    for label, u in enumerate(body.shape[:, :, k].tolist(), start=1):
        yield _integers(label)
        yield _reals(u)
