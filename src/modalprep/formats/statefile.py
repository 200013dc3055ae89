"""A state of a system on disk, by itself or as the end of a run."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np

from modalprep.errors import InputError
from modalprep.formats.hdf5 import reading, writing
from modalprep.multibody.evaluation.system_state import SystemState
from modalprep.suggest import refuse_other

STATE = "modalprep state"
GROUP = "state"  # of the file of a run
NUMBERS = ("joints", "joint_rates", "modal", "modal_rates", "closures", "active", "steps")


def write_state(state: SystemState, path: str | Path) -> Path:
    """Write a state to HDF5: a group for each of its dictionaries, a dataset for each name.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    OutputError
        When the folder cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> file = write_state(SystemState(t=2.0, modal={"arm": np.ones(2)}), Path(tempfile.mkdtemp()) / "state.h5")
    >>> read_state(file).t, read_state(file).modal
    (2.0, {'arm': array([1., 1.])})
    """
    refuse_other("write_state: the state", SystemState, state)
    path = Path(path)
    with writing(path) as file:
        file.attrs.update(format=STATE, format_version=1, units="SI")
        put_state(file, state)
    return path


def put_state(group: h5py.Group, state: SystemState) -> None:
    """Write a state into a group of a file."""
    group.attrs["t"] = state.t
    for kind in NUMBERS:
        for name, value in getattr(state, kind).items():
            if np.asarray(value).dtype.kind == "U":
                group.attrs[f"{kind}.{name}"] = str(value)
            else:
                group[f"{kind}/{name}"] = value


def read_state(path: str | Path) -> SystemState:
    """Read a state, or the end of a run from its file.

    Returns
    -------
    SystemState
        At which `simulate` can start.

    Raises
    ------
    InputError
        When the file is missing, damaged, or holds no state.
    """
    with reading(Path(path), "state file", "give a file of write_state or of a run") as file:
        return state_in(file if file.attrs.get("format") == STATE else file[GROUP])


def state_in(group: h5py.Group) -> SystemState:
    """Return the state that a group of a file holds.

    Raises
    ------
    InputError
        When it holds something else than numbers.
    """
    found: dict[str, dict] = {kind: {} for kind in NUMBERS}
    for kind in NUMBERS:
        for name, data in group[kind].items() if kind in group else ():
            found[kind][name] = _numbers(data)
    found["steps"] |= {name.partition(".")[2]: np.array(str(group.attrs[name])) for name in _texts(group)}
    found["active"] = {name: bool(value) for name, value in found["active"].items()}
    return SystemState(t=float(group.attrs["t"]), **found)


def _texts(group: h5py.Group) -> list[str]:
    return [name for name in group.attrs if name.startswith("steps.")]


def _numbers(data: h5py.Dataset) -> np.ndarray:
    if data.dtype.kind not in "fiub":
        raise InputError(f"{data.name} does not hold numbers")
    return np.asarray(data[()])
