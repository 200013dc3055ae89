"""Modes of a test from a universal file, by pyuff."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from modalprep.correlation.axes import component_axes, node_systems, placed
from modalprep.correlation.mode_set import ModeSet
from modalprep.errors import InputError
from modalprep.suggest import refuse_missing

NODES = (15, 2411)
SHAPES, ANALYSIS, TRACES, SYSTEMS, UNITS = 55, 2414, 82, 2420, 164
# codes of datasets 55 and 2414: types of analysis, data at nodes, vectors of three and six components
NORMAL = 2
COMPLEX = (3, 7)
AT_NODES = 1
VECTORS = (2, 3)
RESPONSES = ("r1", "r2", "r3")


def read_test_modes(path: str | Path, *, length: float | None = None) -> ModeSet:
    """Read measured modes, or another program's: datasets 55 or 2414 (normal and complex modes) at nodes 15 or 2411.

    Parameters
    ----------
    path : str or Path
        Universal file (.uff, .unv).
    length : float or None
        m in the file's unit of length; None: as its dataset 164 says, else m.

    Returns
    -------
    ModeSet
        In order of frequency. A component that is zero in all modes was not measured. Shapes stay complex where the
        file has complex modes; their damping is that of the pole, ``-Re / |pole|``. Components along axes of their own
        (displacement coordinate systems of the nodes, dataset 2420) have these as `axes`.

    Raises
    ------
    InputError
        When the file is missing, damaged, has no modes or no nodes, or coordinate systems that are not known.

    References
    ----------
    Universal file datasets 15, 55, 82, 164, 2411, 2414, 2420 (University of Cincinnati, Structural Dynamics Research
    Laboratory).
    """
    path = Path(path)
    refuse_missing(path, "universal file")
    sets = _datasets(path)
    shapes = [s for s in sets if s["type"] in (SHAPES, ANALYSIS) and s.get("analysis_type") in (NORMAL, *COMPLEX)]
    shapes = [shape for shape in shapes if shape["type"] == SHAPES or _is_motion(shape)]
    if not shapes:
        raise InputError(f"{path} has no mode shapes (dataset 55 or 2414 of normal or complex modes)")
    nodes = next((s for s in sets if s["type"] in NODES), None)
    if nodes is None:
        raise InputError(f"{path} has no nodes (dataset 15 or 2411), so that its sensors have no place")
    try:
        return _modes(path, sets, nodes, shapes, length)
    except (LookupError, ValueError, TypeError) as error:
        raise InputError(f"universal file {path} is damaged: {error}") from None


def _datasets(path: Path) -> list[dict[str, Any]]:
    import pyuff

    wanted = {*NODES, SHAPES, ANALYSIS, TRACES, SYSTEMS, UNITS}
    try:
        file = pyuff.UFF(str(path))
        found = [file.read_sets(k) for k, kind in enumerate(file.get_set_types()) if int(kind) in wanted]
    except Exception as error:  # of any kind: the library reads without checks
        raise InputError(f"universal file {path} is damaged or is none ({type(error).__name__}: {error})") from None
    if not found:
        raise InputError(f"{path} is no universal file with nodes and modes")
    return found


def _modes(path: Path, sets: list, nodes: dict, shapes: list[dict], length: float | None) -> ModeSet:
    labels = np.asarray(nodes["node_nums"]).astype(int)
    if length is None:
        length = next((1 / float(s["length"]) for s in sets if s["type"] == UNITS and s.get("length")), 1.0)
    systems = node_systems(path, [s for s in sets if s["type"] == SYSTEMS], length)
    points = placed(path, nodes, systems, length)
    axes = component_axes(path, nodes, systems, points)
    row = {label: k for k, label in enumerate(labels.tolist())}
    columns, poles = [], []
    for found in shapes:
        shape = _as_55(found) if found["type"] == ANALYSIS else found
        columns.append(_column(path, shape, row))
        poles.append(_pole(shape))
    frequency, damping = np.array(poles, dtype=float).T
    table = np.stack(columns, axis=2)
    order = np.argsort(frequency, kind="stable")
    table[~np.nan_to_num(table).any(axis=2)] = np.nan
    known = ~np.isnan(table).all(axis=(1, 2))
    if not known.any():
        raise InputError(f"{path}: all mode shapes are zero")
    keep = {label: k for k, label in enumerate(labels[known].tolist())}
    return ModeSet(
        name=path.stem,
        points=points[known],
        shape=table[known][:, :, order],
        frequency=frequency[order],
        damping=damping[order],
        labels=labels[known],
        lines=_lines(sets, keep),
        axes=None if axes is None else axes[known],
    )


def _is_motion(dataset: dict) -> bool:
    """Whether a dataset 2414 holds displacements of nodes, and not stresses or energies."""
    return dataset["dataset_location"] == AT_NODES and dataset["data_characteristic"] in VECTORS


def _as_55(dataset: dict) -> dict:
    """Return a mode of dataset 2414 with the keys that dataset 55 has."""
    values = np.array(dataset["data_at_node"])
    if dataset["data_type"] > 4:  # of real and imaginary parts
        values = values[:, ::2] + 1j * values[:, 1::2]
    _, frequency, _, _, viscous, hysteretic = (dataset.get(f"record12_field{k}") or 0.0 for k in range(1, 7))
    real, imaginary = (dataset.get(f"record13_field{k}") or 0.0 for k in (1, 2))
    found = {
        "freq": frequency,
        "modal_damp_vis": viscous,
        "modal_damp_his": hysteretic,
        "eig": complex(real, imaginary),
    }
    found |= {key: dataset[key] for key in ("analysis_type", "node_nums")}
    return found | dict(zip(RESPONSES, values.T, strict=False))


def _column(path: Path, shape: dict, row: dict[int, int]) -> np.ndarray:
    """Return a shape at all nodes (p, 3), NaN at those that it does not name."""
    at = np.asarray(shape["node_nums"]).astype(int).tolist()
    missing = [label for label in at if label not in row]
    if missing:
        raise InputError(f"{path}: a mode shape names node {missing[0]}, which is not among the nodes")
    values = np.stack([np.asarray(shape[r]) for r in RESPONSES], axis=1)
    found = np.full((len(row), 3), np.nan, dtype=values.dtype if np.iscomplexobj(values) else float)
    found[[row[label] for label in at]] = values
    if not np.isfinite(values).all():
        raise InputError(f"{path}: a mode shape has values that are not finite")
    return found


def _pole(shape: dict) -> tuple[float, float]:
    """Return the frequency (Hz) and the damping ratio, NaN if the file has none."""
    if shape["analysis_type"] == NORMAL:
        viscous, hysteretic = (float(shape.get(key) or 0.0) for key in ("modal_damp_vis", "modal_damp_his"))
        return float(shape["freq"]), viscous or hysteretic / 2 or np.nan
    pole = complex(shape["eig"])
    return abs(pole) / (2 * np.pi), -pole.real / abs(pole) if pole else np.nan


def _lines(sets: list, row: dict[int, int]) -> np.ndarray:
    """Return the trace lines as pairs of points; a zero lifts the pen."""
    pairs = []
    for trace in (s for s in sets if s["type"] == TRACES):
        nodes = np.asarray(trace.get("nodes", trace.get("lines", []))).astype(int).tolist()
        pairs += [(row[a], row[b]) for a, b in pairwise(nodes) if a in row and b in row]
    return np.array(pairs, dtype=int).reshape(-1, 2)
