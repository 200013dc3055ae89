"""Derivatives of runs on disk: HDF5 with named histories and numbers."""

from __future__ import annotations

from pathlib import Path

from modalprep.formats.hdf5 import write_texts, writing
from modalprep.sensitivity.gradient import Gradient
from modalprep.sensitivity.run_sensitivities import RunSensitivities

FORMAT = "modalprep derivatives of a run"


def write_derivatives(
    path: str | Path, histories: RunSensitivities | None, gradient: Gradient | None = None, *, objective: str = ""
) -> Path:
    """Write derivatives to HDF5; the file is written completely or not at all.

    ``parameters`` has their names and ``at`` their values. Of histories there are ``time``, and in the groups
    ``values`` (nt,) and ``derivatives`` (parameters, nt) a dataset for each channel. Of one number the group
    ``objective`` has its ``value`` and ``derivatives`` (parameters,).

    Parameters
    ----------
    path : str or Path
    histories : RunSensitivities or None
    gradient : Gradient or None
        By the same parameters.
    objective : str
        What the number is.

    Returns
    -------
    Path
        The file.

    Examples
    --------
    >>> import h5py, tempfile
    >>> import numpy as np
    >>> found = RunSensitivities(time=np.arange(2.0), channels=("hinge.angle",), parameters=("hinge.stiffness",),
    ...                          at=np.ones(1), values=np.zeros((2, 1)), derivatives=np.full((1, 2, 1), 3.0))
    >>> with h5py.File(write_derivatives(Path(tempfile.mkdtemp()) / "one.h5", found)) as file:
    ...     file["derivatives/hinge.angle"][()].tolist()
    [[3.0, 3.0]]
    """
    path = Path(path)
    of = histories if histories is not None else gradient
    with writing(path) as file:
        file.attrs.update(format=FORMAT, format_version=1, units="SI")
        if of is not None:
            names = histories.parameters if histories is not None else tuple(gradient.derivatives if gradient else ())
            write_texts(file, "parameters", names)
            file["at"] = of.at
            write_texts(file, "notes", of.notes)
        if histories is not None:
            file["time"] = histories.time
            for c, channel in enumerate(histories.channels):
                file[f"values/{channel}"] = histories.values[:, c]
                file[f"derivatives/{channel}"] = histories.derivatives[:, :, c]
        if gradient is not None:
            group = file.create_group("objective")
            group.attrs["of"] = objective
            group["value"], group["derivatives"] = gradient.value, gradient.vector
    return path
