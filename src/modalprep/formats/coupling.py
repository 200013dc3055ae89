"""Coupling matrices of an appendage on disk, for programs of attitude control: JSON or MATLAB."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import scipy

from modalprep.atomic import atomic_path
from modalprep.body.coupling import coupling_matrices
from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.formats.refusals import with_suffix


def write_coupling(body: FlexibleBody, path: str | Path, point: str | Sequence[float] = (0.0, 0.0, 0.0)) -> Path:
    """Write the matrices of `modalprep.body.CouplingMatrices`, with the names of its fields, in SI units.

    Parameters
    ----------
    body : FlexibleBody
    path : str or Path
        ``.json``, or ``.mat`` for MATLAB.
    point : (3,) or str
        Reference point in the body's frame, m; as text ``"x,y,z"``.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        When the suffix is another, the point is not three numbers, the body is one of free modes, or the folder cannot
        be written.

    Examples
    --------
    >>> import tempfile
    >>> from modalprep.examples import uniform_beam
    >>> file = write_coupling(uniform_beam(modes=2), Path(tempfile.mkdtemp()) / "beam.json", "5,0,0")
    >>> json.loads(file.read_text())["mass"][0][0]
    12.0
    """
    path = with_suffix(path, "a file of coupling matrices", ".json", ".mat")
    found = coupling_matrices(body, _numbers(point) if isinstance(point, str) else point)
    arrays = {name: getattr(found, name) for name in found.__dataclass_fields__}
    named = {"body": body.name, "mode_names": list(body.mode_names)}
    with atomic_path(path) as temporary:
        if path.suffix == ".json":
            plain = {name: array.tolist() for name, array in arrays.items()}
            temporary.write_text(json.dumps(named | plain, indent=1) + "\n", encoding="utf-8")
        else:
            scipy.io.savemat(temporary, named | arrays, appendmat=False, oned_as="column")
    return path


def _numbers(text: str) -> np.ndarray:
    try:
        return np.array([float(word) for word in text.split(",")])
    except ValueError:
        raise InputError(f"the point is {text!r}; give x,y,z in m, such as 0.5,0,0") from None
