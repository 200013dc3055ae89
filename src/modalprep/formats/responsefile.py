"""Responses of a body on disk: HDF5 with every curve and every peak."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np

from modalprep.formats.hdf5 import reading, write_texts, writing
from modalprep.response.result import Peak, Response
from modalprep.suggest import refuse_other
from modalprep.verdicts.notes import told

RESPONSE = "modalprep response"
PARTS = ("block", "place", "component", "unit")  # of a peak


def write_response(response: Response, path: str | Path) -> Path:
    """Write a response to HDF5: ``axis``, ``curves``, ``inputs`` and a dataset for each figure of the peaks.

    Curves are columns in the order of the dataset ``channels``, with their ``units``; those of a harmonic response
    are complex. Peaks are in the order of ``peaks/channel``.

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
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.response import harmonic_response
    >>> found = harmonic_response(uniform_beam(modes=1), {"base.y": 1.0}, [1.0])
    >>> with h5py.File(write_response(found, Path(tempfile.mkdtemp()) / "shaker.h5")) as file:
    ...     file["peaks/channel"].asstr()[0], file["curves"].shape
    ('base.force.x', (1, 24))
    """
    refuse_other("write_response: the response", Response, response)
    path = Path(path)
    with writing(path) as file:
        file.attrs.update(format=RESPONSE, format_version=1, units="SI", kind=response.kind)
        file.attrs["notes"] = "\n".join(response.notes)
        arrays = {"axis": response.axis, "curves": response.values, "inputs/values": response.input_values}
        arrays |= {"weight": response.weight, "steady": response.steady} | _figures(response)
        for name, values in arrays.items():
            if values is not None:
                file[name] = values
        texts = {"channels": response.names, "units": response.units, "inputs/names": response.inputs}
        texts |= {"chosen": response.chosen, "peaks/channel": [x.channel for x in response.peaks]}
        texts |= {f"peaks/{part}": [getattr(x, part) for x in response.peaks] for part in PARTS}
        for name, words in texts.items():
            write_texts(file, name, words)
    return path


def _figures(response: Response) -> dict[str, np.ndarray]:
    """Return each figure of the peaks, and their margins, by the name of its dataset."""
    names = response.peaks[0].figures if response.peaks else ()
    found = {f"peaks/{name}": np.array([x.figures[name] for x in response.peaks]) for name in names}
    own = {"largest": [x.largest for x in response.peaks], "margin": [x.margin for x in response.peaks]}
    return found | {f"peaks/{name}": np.array(values) for name, values in own.items()}


@told
def read_response(path: str | Path) -> Response:
    """Read a response that `write_response` wrote.

    Returns
    -------
    Response
        As it was written.

    Raises
    ------
    InputError
        When the file is missing, damaged, or no response.

    Examples
    --------
    >>> import tempfile
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.response import harmonic_response
    >>> found = harmonic_response(uniform_beam(modes=1), {"base.y": 1.0}, [1.0])
    >>> again = read_response(write_response(found, Path(tempfile.mkdtemp()) / "shaker.h5"))
    >>> again.peaks == found.peaks or again.peaks[0].channel
    'base.force.x'
    """
    with reading(Path(path), "response file", "compute it again") as file:
        text = {name: tuple(file[name].asstr()[()]) for name in ("channels", "units", "inputs/names", "chosen")}
        optional = {name: file[name][()] if name in file else None for name in ("weight", "steady")}
        return Response(
            kind=str(file.attrs["kind"]),
            axis=file["axis"][()],
            names=text["channels"],
            units=text["units"],
            values=file["curves"][()],
            peaks=_peaks(file["peaks"]),
            inputs=text["inputs/names"],
            input_values=file["inputs/values"][()],
            notes=tuple(str(file.attrs["notes"]).splitlines()),
            chosen=text["chosen"],
            **optional,
        )


def _peaks(group: h5py.Group) -> tuple[Peak, ...]:
    words = [group[part].asstr()[()] for part in PARTS]
    own = {name: group[name][()] for name in group if name not in (*PARTS, "channel")}
    largest = own.pop("largest").tolist()
    margin = own.pop("margin").tolist()
    figures = [dict(zip(own, map(float, row), strict=True)) for row in zip(*own.values(), strict=True)]
    return tuple(map(Peak, *words, largest, figures or [{}] * len(largest), margin))
