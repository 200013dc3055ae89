"""OpenFAST: the superelement file of its module ExtPtfm."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.linalg import block_diag

from modalprep.atomic import atomic_path
from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.mass import mass_matrix
from modalprep.errors import InputError

G = 9.80665  # m/s^2
END = 1e5  # s, up to which the weight is given


def write_extptfm(body: FlexibleBody, path: str | Path) -> Path:
    """Write mass, stiffness, damping and weight of a body as an ExtPtfm superelement (``FlexASCII``).

    The six motions of the root are the interface of the platform (translations before rotations, axes of the body's
    frame, whose z has to point upwards), followed by the modes with the root clamped. The loads are the weight of the
    body, constant until `END`.

    Lost: all that is not linear, and the other interfaces.

    Returns
    -------
    Path
        The file, which ``Red_FileName`` of the module's input file names, with ``FileFormat`` 1.

    Raises
    ------
    InputError
        When the body's frame is not that of its root, or the folder cannot be written.

    References
    ----------
    OpenFAST documentation, ExtPtfm: superelement input file (FlexASCII).

    Examples
    --------
    >>> import tempfile
    >>> from modalprep.examples import uniform_beam
    >>> file = write_extptfm(uniform_beam(modes=2), Path(tempfile.mkdtemp()) / "beam.extptfm")
    >>> file.read_text().splitlines()[2]
    '!Dimension: 8'
    """
    if not body.at_root:
        raise InputError(f"body {body.name!r} has its {body.frame}; ExtPtfm needs reroot(body, interface) first")
    n = 6 + body.n
    M = mass_matrix(body, np.zeros(body.n))
    K, D = (block_diag(np.zeros((6, 6)), A) for A in (np.diag(body.K), body.damping_matrix))
    weight = -G * M[:, 2]
    lines = [
        f"!{' '.join(body.name.split())} by modalprep, SI units",
        "!Flex 5 Format",
        f"!Dimension: {n}",
        f"!Time increment in simulation: {END:g}",
        f"!Total simulation time in file: {END:g}",
        *_matrix("Mass Matrix (Units (kg,m))", M),
        *_matrix("Stiffness Matrix (Units (N,m))", K),
        *_matrix("Damping Matrix (Units (N,m,kg))", D),
        "!Loading and Wave Elevation (Units (N,m))",
        f"!Dimension: 1 time column - {n} force columns - 1 wave elevation column",
        *(_row([t, *weight, 0.0]) for t in (0.0, END)),
    ]
    with atomic_path(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="ascii", errors="replace")
    return Path(path)


def _matrix(title: str, matrix: np.ndarray) -> Iterator[str]:
    yield f"!{title}"
    yield f"!Dimension: {len(matrix)}"
    yield from map(_row, matrix)


def _row(values) -> str:
    return " ".join(f"{value:23.15e}" for value in values)
