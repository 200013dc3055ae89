"""The modal file: one HDF5 file per body, readable without modalprep; docs/reference/formats.md has the layout."""

from __future__ import annotations

import json
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from modalprep.body.checks import check_identities
from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.recovery import DRIVES, Recovery
from modalprep.body.stations.record import OutsideBasis, Stations
from modalprep.body.stress import COMPONENTS, StressModes
from modalprep.errors import InputError
from modalprep.fe.mesh.cells import CELLS
from modalprep.formats.hdf5 import CHECKSUM, checksum, reading, writing
from modalprep.reduction.table import ModeTable
from modalprep.suggest import refuse_other
from modalprep.verdicts.notes import told

FORMAT, VERSION = "modalprep", 2
WITHOUT_CHECKSUM = (1,)  # versions
# Checks of what bodies may lack: a mode table those made by hand, P those linearised in the modes (`ruthless`).
OF_THE_TABLE, OF_P = "mass and inertia", "modal mass"
CONSEQUENCE = 1e-6  # relative: a body that violates an identity by more is another body
FULL = 0.75  # of the numbers of an array differ from zero
UNIT = 1e-9  # tolerance of orthogonal unit vectors
SHAPES: dict[str, Callable[[int, int], tuple[int, ...]]] = {  # name: shape from modes n and interfaces k
    "m": lambda n, k: (),
    "s0": lambda n, k: (3,),
    "E0": lambda n, k: (3, 3),
    "S": lambda n, k: (3, n),
    "H": lambda n, k: (3, 3, n),
    "P": lambda n, k: (3, 3, n, n),
    "Kg_A": lambda n, k: (3, n, n),
    "Kg_W": lambda n, k: (3, 3, n, n),
    "Kg_F": lambda n, k: (k, 3, n, n),
    "Kg_T": lambda n, k: (k, 3, n, n),
    "phi": lambda n, k: (k, 3, n),
    "psi": lambda n, k: (k, 3, n),
    "K": lambda n, k: (n,),
    "D": lambda n, k: (n,),
    "frequency": lambda n, k: (n,),
    "interface_position": lambda n, k: (k, 3),
}
PER_CELL: dict[str, Callable[[int, int], tuple[int, ...]]] = {  # optional: shape from cells c and modes n
    "energy": lambda c, n: (c, n),
    "volume": lambda c, n: (c,),
}
TEXTS = ("mode_names", "notes")  # optional
STATIONS: dict[str, Callable[[int, int, int, int], tuple[int, ...]]] = {  # optional: N parts, n modes, k interfaces, m
    "parent": lambda N, n, k, m: (N,),
    "m": lambda N, n, k, m: (N,),
    "centre": lambda N, n, k, m: (N, 3),
    "E": lambda N, n, k, m: (N, 3, 3),
    "S": lambda N, n, k, m: (N, 3, n),
    "H": lambda N, n, k, m: (N, 3, 3, n),
    "owner": lambda N, n, k, m: (k,),
    "part": lambda N, n, k, m: (m,),
}
OUTSIDE: dict[str, Callable[..., tuple[int, ...]]] = {  # optional: of k shapes and r vectors
    "shapes": lambda N, n, i, k, r: (k, n),
    "products": lambda N, n, i, k, r: (r, k, k),
    "moved": lambda N, n, i, k, r: (N, 3, r),
    "turned": lambda N, n, i, k, r: (N, 3, r),
    "phi": lambda N, n, i, k, r: (i, 3, r),
    "psi": lambda N, n, i, k, r: (i, 3, r),
}
# Arrays of a recovery; all but q and axes may be missing.
RECOVERED = ("q", "qdd", "loads", "axes", "position", "node", "cell")
TABLE = np.dtype(
    [
        ("kind", h5py.string_dtype()),
        ("frequency", float),
        ("effective_mass", float, (6,)),
        ("kept", np.uint8),
        ("reason", h5py.string_dtype()),
    ]
)


def write_body(body: FlexibleBody, path: str | Path) -> Path:
    """Write a body to a modal file; the file is written completely or not at all.

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
    >>> file = write_body(uniform_beam(modes=2), Path(tempfile.mkdtemp()) / "beam.h5")
    >>> read_body(file).frequency.round(4)
    array([0.6044, 1.2086])
    """
    refuse_other("write_body: the body", FlexibleBody, body)
    path = Path(path)
    with writing(path) as file:
        from modalprep import __version__

        file.attrs.update(format=FORMAT, format_version=VERSION, units="SI", name=body.name)
        file.attrs.update(frame=body.frame, program=f"modalprep {__version__}")
        file.attrs["created"] = datetime.now(UTC).isoformat(timespec="seconds")
        file.attrs["inputs"] = json.dumps(body.provenance)
        for name in SHAPES:
            _store(file, name, getattr(body, name))
        if not body.normalised:
            _store(file, "modal_mass", body.modal_mass)
        if body.T is not None:
            _store(file, "T", body.T)
        if body.coupled_damping is not None:
            _store(file, "coupled_damping", body.coupled_damping)
        if np.any(body.truncation):
            _store(file, "truncation", body.truncation)
        if body.stations:
            _store_stations(file, body.stations)
        file["interface_name"] = np.array(body.interface_name, dtype=object)
        for name in TEXTS:
            if getattr(body, name):
                file[name] = np.array(getattr(body, name), dtype=object)
        _store(file, "points", body.points)
        _store(file, "shape", body.shape)
        for kind, cells in body.cells.items():
            _store(file, f"cells/{kind}", cells)
        for name in PER_CELL:
            for kind, values in getattr(body, name).items():
                _store(file, f"{name}/{kind}", values)
        for name, at in body.stress.items():
            _store(file, f"stress/{name}", at.modes)
            file[f"stress/{name}"].attrs.update(components=at.components, position=at.position, axes=at.axes)
        for name, block in body.recovery.items():
            _store_recovery(file, f"recovery/{name}", block)
        _store_table(file, body.modes)
        file.attrs[CHECKSUM] = checksum(file)
    return path


def _store(file: h5py.File, name: str, value: Any) -> None:
    """Store an array, packed if of integers or with many zeros: others take long and shrink by a tenth to a quarter."""
    value = np.asarray(value)
    packs = value.size > 1000 and (value.dtype.kind in "iu" or np.count_nonzero(value) < FULL * value.size)
    options = {"compression": "gzip", "shuffle": True} if packs else {}
    file.create_dataset(name, data=value, **options)


def _store_recovery(file: h5py.File, name: str, block: Recovery) -> None:
    for key in RECOVERED:
        if getattr(block, key) is not None:
            _store(file, f"{name}/{key}", getattr(block, key))
    for key in ("places", "components", "units"):
        file[f"{name}/{key}"] = np.array(getattr(block, key), dtype=object)
    said = file[name].attrs
    said["kind"] = block.kind
    if block.allowable is not None:
        said["allowable"] = block.allowable


def _store_table(file: h5py.File, table: ModeTable) -> None:
    rows = np.empty(len(table.kind), dtype=TABLE)
    for name in rows.dtype.names or ():
        rows[name] = getattr(table, name)
    file["modes"] = rows
    file["modes"].attrs["total"] = table.total
    file["modes"].attrs.update({} if table.held_mass is None else {"held_mass": table.held_mass})


@told
def read_body(path: str | Path, *, checked: bool = True) -> FlexibleBody:
    """Read a modal file.

    Parameters
    ----------
    path : path
    checked : bool
        Whether a body that violates an identity, as no reduction makes it, is refused. A file that does not match its
        checksum always is.

    Returns
    -------
    FlexibleBody
        In SI units, as it was written.

    Raises
    ------
    InputError
        When the file is missing, is no modal file, is damaged, was changed since it was written or by hand, or was
        written by a newer version.

    Examples
    --------
    >>> read_body("no.h5")
    Traceback (most recent call last):
    modalprep.errors.InputError: modal file no.h5 does not exist
    """
    with reading(Path(path), "modal file", "write it again") as file:
        version = _known_version(file)
        body = _read(file)
        if checked:
            refuse_impossible(body, CHECKSUM in file.attrs)
        if (CHECKSUM in file.attrs or version not in WITHOUT_CHECKSUM) and file.attrs.get(CHECKSUM) != checksum(file):
            raise InputError("its contents do not match its checksum: it was damaged or changed since it was written")
        return body


def refuse_impossible(body: FlexibleBody, vouched: bool) -> None:
    """Refuse a body that violates an identity; where a checksum vouches for it, P and the mode table may be missing."""
    missing = {OF_THE_TABLE} | (set() if np.any(body.P) else {OF_P})
    for check in check_identities(body):
        if vouched and check.name in missing:
            continue
        limit = max(check.limit, CONSEQUENCE)
        if not check.value <= limit:
            failed = f"check {check.name!r} failed ({check.value:.1e} > {limit:.0e}: {check.meaning})"
            raise InputError(f"{failed}, so that it is not what a reduction made")


def _known_version(file: h5py.File) -> int:
    if file.attrs.get("format") != FORMAT:
        raise InputError(f"it has no attribute format = {FORMAT!r}, as modal files have")
    version = int(file.attrs["format_version"])
    if version > VERSION:
        raise InputError(f"it has format version {version}, this program reads up to {VERSION}; update modalprep")
    if version < 1 or file.attrs["units"] != "SI":
        said = f"format version {version} and units {file.attrs['units']!r}"
        raise InputError(f"it has {said}; versions begin at 1, and the units are 'SI'")
    return version


def _read(file: h5py.File) -> FlexibleBody:
    n, k = len(file["K"]), len(file["interface_name"])
    arrays: dict[str, Any] = {name: _array(file, name, shape(n, k)) for name, shape in SHAPES.items()}
    if not (arrays["m"] > 0 and np.all(arrays["K"] >= 0)):
        raise InputError("the mass m is not positive, or a stiffness in K is negative")
    points = _array(file, "points", (len(file["points"]), 3))
    if not len(points):
        raise InputError("points is empty")
    names = tuple(file["interface_name"].asstr()[()])
    if len(set(names)) != len(names):
        raise InputError("two interfaces have one name")
    rows = file["modes"][()]
    said = file["modes"].attrs
    total = np.asarray(said["total"], dtype=float)
    held = said.get("held_mass")
    for name, six in (("total", total), ("held mass", total if held is None else held)):
        if np.shape(six) != (6,) or not np.all(np.isfinite(six)):
            raise InputError(f"the {name} of the modes table is not six numbers")
    cells = {kind: _cells(file, kind, len(points)) for kind in file.get("cells", ())}
    arrays["m"] = float(arrays["m"])
    texts: dict[str, Any] = {name: tuple(file[name].asstr()[()]) for name in TEXTS if name in file}
    return FlexibleBody(
        **arrays,
        name=str(file.attrs["name"]),
        interface_name=names,
        points=points,
        shape=_array(file, "shape", (len(points), 3, n)),
        cells=cells,
        modal_mass=_array(file, "modal_mass", (n, n)) if "modal_mass" in file else None,
        T=_array(file, "T", (n, n, n)) if "T" in file else None,
        coupled_damping=_array(file, "coupled_damping", (n, n)) if "coupled_damping" in file else None,
        truncation=_array(file, "truncation", (n,)) if "truncation" in file else None,
        stations=_stations(file, n, k, len(points)) if "stations" in file else None,
        **{name: _per_cell(file, name, cells, n) for name in PER_CELL},
        stress={name: _stress(file, name, n) for name in file.get("stress", ())},
        recovery={name: _recovery(file, f"recovery/{name}", n, k, len(points)) for name in file.get("recovery", ())},
        modes=ModeTable(
            kind=tuple(x.decode() for x in rows["kind"]),
            frequency=rows["frequency"],
            effective_mass=rows["effective_mass"],
            total=total,
            kept=rows["kept"].astype(bool),
            reason=tuple(x.decode() for x in rows["reason"]),
            held_mass=held,
        ),
        provenance=dict(json.loads(file.attrs["inputs"])),
        **texts,
    )


def _store_stations(file: h5py.File, stations: Stations) -> None:
    """Write the stations of a body that deflects far."""
    for name in STATIONS:
        _store(file, f"stations/{name}", getattr(stations, name))
    for name in OUTSIDE if stations.outside else ():
        _store(file, f"stations/outside/{name}", getattr(stations.outside, name))
    if stations.idle_below:
        file["stations"].attrs["idle_below"] = stations.idle_below


def _stations(file: h5py.File, n: int, k: int, points: int) -> Stations:
    """Read the stations of a body that deflects far."""
    N = len(file["stations/m"])
    found = {name: _array(file, f"stations/{name}", shape(N, n, k, points)) for name, shape in STATIONS.items()}
    for name, largest in {"parent": np.arange(N), "owner": N, "part": N}.items():
        found[name] = found[name].astype(int)
        if np.any(found[name] < -1) or np.any(found[name] >= largest):
            raise InputError(f"stations/{name} names parts that are not there, or not before their own")
    if not np.all(found["m"] > 0):
        raise InputError("stations/m is not positive")
    idle = float(file["stations"].attrs.get("idle_below", 0.0))
    if not 0 <= idle < 1:
        raise InputError(f"stations: idle_below = {idle:g} is not between 0 and 1")
    outside = _outside(file, N, n, k) if "outside" in file["stations"] else None
    return Stations(**found, outside=outside, idle_below=idle)


def _outside(file: h5py.File, N: int, n: int, k: int) -> OutsideBasis:
    """Read the derivatives that a body's basis leaves out."""
    place = "stations/outside"
    sizes = [int(file[f"{place}/{name}"].shape[0]) for name in ("shapes", "products")]
    return OutsideBasis(
        **{name: _array(file, f"{place}/{name}", shape(N, n, k, *sizes)) for name, shape in OUTSIDE.items()}
    )


def _cells(file: h5py.File, kind: str, n_points: int) -> np.ndarray:
    conn = file[f"cells/{kind}"][()]
    good = kind in CELLS and conn.ndim == 2 and conn.shape[1] == CELLS[kind].count and conn.dtype.kind in "iu"
    good = good and conn.min(initial=0) >= 0 and conn.max(initial=0) < n_points
    if not good:
        raise InputError(f"cells/{kind} does not connect its points")
    return conn


def _per_cell(file: h5py.File, name: str, cells: dict, n: int) -> dict[str, np.ndarray]:
    """Read an optional quantity of each cell, in its precision; all types of cells have it, or none."""
    if name not in file:
        return {}
    found = {}
    for kind, nodes in cells.items():
        values = _array(file, f"{name}/{kind}", PER_CELL[name](len(nodes), n))
        if values.min(initial=0.0) < 0:
            raise InputError(f"{name}/{kind} has negative values")
        found[kind] = values.astype(file[f"{name}/{kind}"].dtype)
    return found


def _stress(file: h5py.File, name: str, n: int) -> StressModes:
    """Read the stress at a point."""
    place = f"stress/{name}"
    said = file[f"stress/{name}"].attrs
    components = tuple(str(x) for x in said["components"])
    if not components or set(components) - set(COMPONENTS) or len(set(components)) < len(components):
        raise InputError(f"{place} has components {', '.join(components)[:80]}, known are {', '.join(COMPONENTS)}")
    position, axes = (np.asarray(said[key], dtype=float) for key in ("position", "axes"))
    if position.shape != (3,) or axes.shape != (3, 3) or not np.all(np.isfinite(position)):
        raise InputError(f"{place} has no position or no axes of three numbers")
    if not np.abs(axes @ axes.T - np.eye(3)).max() <= UNIT:
        raise InputError(f"the axes of {place} are not orthogonal unit vectors")
    modes = _array(file, place, (len(components), n))
    return StressModes(position=position, axes=axes, components=components, modes=modes)


def _recovery(file: h5py.File, name: str, n: int, k: int, points: int) -> Recovery:
    """Read a block of recovery matrices."""
    group = file[name]
    said = file[name].attrs
    places, components, units = (tuple(group[key].asstr()[()]) for key in ("places", "components", "units"))
    p, c = len(places), len(components)
    shapes = {"q": (p, c, n), "qdd": (p, c, n), "loads": (p, c, DRIVES + 6 * k), "axes": (3, 3)}
    shapes |= {"position": (p, 3), "node": (p,), "cell": (p,)}
    arrays = {key: _array(file, f"{name}/{key}", shapes[key]) for key in RECOVERED if key in group}
    cells = sum(len(nodes) for nodes in file.get("cells", {}).values())
    for key, count in {"node": points, "cell": cells}.items():
        if key in arrays:
            arrays[key] = arrays[key].astype(int)
            if arrays[key].min(initial=0) < 0 or arrays[key].max(initial=0) >= count:
                raise InputError(f"{name}/{key} names {key}s that are not there")
    if not np.abs(arrays["axes"] @ arrays["axes"].T - np.eye(3)).max() <= UNIT:
        raise InputError(f"the axes of {name} are not orthogonal unit vectors")
    allowable = float(said["allowable"]) if "allowable" in said else None
    return Recovery(
        kind=str(said["kind"]), places=places, components=components, units=units, allowable=allowable, **arrays
    )


def _array(file: h5py.File, name: str, shape: tuple[int, ...]) -> np.ndarray:
    data = file[name]
    if data.shape != shape:
        raise InputError(f"{name} has shape {data.shape} instead of {shape}")
    if data.dtype.kind not in "fiu":
        raise InputError(f"{name} does not hold real numbers")
    array = np.asarray(data[()], dtype=float)
    if not np.all(np.isfinite(array)):
        raise InputError(f"{name} holds values that are not numbers")
    return array
