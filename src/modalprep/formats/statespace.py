"""State spaces on disk: MATLAB, NumPy and HDF5 files of A, B, C, D with the names of inputs and outputs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import scipy

from modalprep.atomic import atomic_path
from modalprep.errors import InputError
from modalprep.multibody.analysis.state_space import LinearSystem
from modalprep.suggest import refuse_other, suggestion


def _mat(path: Path, data: dict[str, np.ndarray]) -> None:
    cells = {name: values.astype(object) if values.dtype.kind == "U" else values for name, values in data.items()}
    scipy.io.savemat(path, cells, appendmat=False)


def _npz(path: Path, data: dict[str, Any]) -> None:
    with path.open("wb") as file:
        np.savez(file, **data)


def _h5(path: Path, data: dict[str, np.ndarray]) -> None:
    with h5py.File(path, "w") as file:
        file.attrs.update(format="modalprep state space", format_version=1, units="SI")
        for name, values in data.items():
            file[name] = values.astype(object) if values.dtype.kind == "U" else values


WRITERS: dict[str, Callable[[Path, dict[str, np.ndarray]], None]] = {"mat": _mat, "npz": _npz, "h5": _h5}


def write_state_space(linear: LinearSystem, path: str | Path) -> Path:
    """Write ``z' = A z + B i``, ``o = C z + D i`` to a ``.mat``, ``.npz`` or ``.h5`` file.

    Besides the matrices it holds `states`, `inputs` and `outputs`, and of a `StateSpace` its `R`, `y` and `udot`.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        When the suffix is another.

    References
    ----------
    Theory 5.6.

    Examples
    --------
    >>> import tempfile
    >>> mass = LinearSystem(
    ...     A=np.array([[0, 1.0], [0, 0]]), B=np.array([[0], [0.5]]), C=np.eye(2)[:1], D=np.zeros((1, 1)),
    ...     states=("slide.displacement", "slide.speed"), inputs=("slide",), outputs=("slide.displacement",))
    >>> with np.load(write_state_space(mass, Path(tempfile.mkdtemp()) / "mass.npz")) as file:
    ...     print(file["B"].ravel(), file["states"])
    [0.  0.5] ['slide.displacement' 'slide.speed']
    """
    refuse_other("write_state_space: the linear system", LinearSystem, linear)
    path = Path(path)
    kind = path.suffix.removeprefix(".")
    if kind not in WRITERS:
        raise InputError(
            f"{path}: a state space has no {path.suffix!r} files; {suggestion(kind, WRITERS, 'known are')}"
        )
    matrices = [name for name in ("A", "B", "C", "D", "R", "y", "udot") if hasattr(linear, name)]
    data = {name: getattr(linear, name) for name in matrices}
    data |= {name: np.array(getattr(linear, name), dtype=str) for name in ("states", "inputs", "outputs")}
    with atomic_path(path) as temporary:
        WRITERS[kind](temporary, data)
    return path
