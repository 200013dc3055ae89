"""Ensembles on disk: HDF5 with the histories of all cases, from which an interrupted ensemble goes on."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from modalprep.ensemble.record import Ensemble
from modalprep.errors import InputError
from modalprep.formats.hdf5 import reading, writing
from modalprep.suggest import refuse_other

FORMAT = "modalprep ensemble"
IDENTITY = "identity_"  # begin of the attributes that tell whose results the file holds
OTHER = {  # what an identity is of, and what is said when it differs
    "system": "another system",
    "cases": "other cases",
    "run": "other times, tolerances, events or channels",
}
TABLES = ("cases", "channels", "events")
EVERY, SHARE = 10.0, 20.0  # s between two writings, and times what one takes
ADVICE = "give another file, or remove it"


class OtherEnsembleError(InputError):
    """A file holds the results of another ensemble."""


def write_ensemble(
    ensemble: Ensemble,
    path: str | Path,
    *,
    levels: list[float] | None = None,
    identity: Mapping[str, str] | None = None,
) -> Path:
    """Write an ensemble to HDF5; the file is written completely or not at all.

    The groups ``cases``, ``channels`` and ``events`` have a dataset for each name, whose first index is the case.

    Parameters
    ----------
    ensemble : Ensemble
    path : str or Path
    levels : list of float or None
        Percent; the group ``percentiles`` then has those of every channel.
    identity : {what: fingerprint} or None
        Whose results these are.

    Returns
    -------
    Path
        The file.

    Examples
    --------
    >>> import tempfile
    >>> one = Ensemble(cases={"stay.stiffness": np.ones(1)}, time=np.arange(2.0), channels={"a.x": np.ones((1, 2))},
    ...                status=("done",), message=("",), end=np.ones(1), energy_error=np.zeros(1))
    >>> read_ensemble(write_ensemble(one, Path(tempfile.mkdtemp()) / "one.h5"))["a.x"]
    array([[1., 1.]])
    """
    refuse_other("write_ensemble: the ensemble", Ensemble, ensemble)
    path = Path(path)
    with writing(path) as file:
        file.attrs.update(format=FORMAT, format_version=1, units="SI")
        file.attrs.update({f"{IDENTITY}{name}": value for name, value in (identity or {}).items()})
        for name in ("time", "end", "energy_error", "momentum_error"):
            file[name] = getattr(ensemble, name)
        for name in ("status", "message", "audit"):
            file[name] = np.array(getattr(ensemble, name), dtype=object)
        for table in TABLES:
            group = file.create_group(table, track_order=True)
            for name, values in getattr(ensemble, table).items():
                group[name] = values
        if levels:
            group = file.create_group("percentiles", track_order=True)
            group.attrs["levels"] = levels
            for name, values in ensemble.percentiles(levels).items():
                group[name] = values
    return path


def read_ensemble(path: str | Path) -> Ensemble:
    """Read a file of `write_ensemble`, or of an ensemble that was interrupted.

    Returns
    -------
    Ensemble
        With the cases, histories and statuses that were written.

    Raises
    ------
    InputError
        When the file is missing, damaged or does not hold an ensemble.
    """
    return _read(Path(path), {})


def _read(path: Path, identity: Mapping[str, str]) -> Ensemble:
    """Read an ensemble; refuse one of another identity."""
    with reading(path, "file of an ensemble", ADVICE) as file:
        if file.attrs.get("format") != FORMAT:
            raise InputError("it does not hold an ensemble")
        for what, value in identity.items():
            if file.attrs.get(f"{IDENTITY}{what}") != value:
                raise OtherEnsembleError(f"it holds an ensemble of {OTHER.get(what, f'another {what}')}")
        tables = {table: {name: data[()] for name, data in file[table].items()} for table in TABLES}
        texts = {name: tuple(file[name].asstr()[()].tolist()) for name in ("status", "message", "audit")}
        numbers = {name: file[name][()] for name in ("time", "end", "energy_error")}
        numbers |= {"momentum_error": file["momentum_error"][()]} if "momentum_error" in file else {}
        found = Ensemble(**tables, **texts, **numbers)
        _check(found)
    return found


def _check(ensemble: Ensemble) -> None:
    count, times = len(ensemble), len(ensemble.time)
    rows = [ensemble.end, ensemble.energy_error, ensemble.momentum_error, ensemble.message, ensemble.audit]
    rows += [*ensemble.cases.values(), *ensemble.events.values()]
    shapes = [values.shape[:2] for values in ensemble.channels.values()]
    if any(len(values) != count for values in rows) or any(shape != (count, times) for shape in shapes):
        raise InputError(f"its tables do not have {count} cases and {times} times")


class Keeper:
    """Keeps the finished cases of an ensemble in a file.

    Parameters
    ----------
    path : Path or None
        None keeps nothing.
    identity : {what: fingerprint}
    """

    def __init__(self, path: Path | None, identity: Mapping[str, str]) -> None:
        self.path, self.identity = path, identity
        self._next = time.monotonic() + EVERY

    def read(self) -> Ensemble | None:
        """Return what the file holds; None where there is none.

        Raises
        ------
        InputError
            When it holds something else.
        """
        return _read(self.path, self.identity) if self.path is not None and self.path.exists() else None

    @property
    def due(self) -> bool:
        """Whether it is time to write again."""
        return self.path is not None and time.monotonic() > self._next

    def write(self, ensemble: Ensemble) -> None:
        """Write the cases that are finished so far."""
        if self.path is None:
            return
        begin = time.monotonic()
        write_ensemble(ensemble, self.path, identity=self.identity)
        self._next = time.monotonic() + max(EVERY, SHARE * (time.monotonic() - begin))
