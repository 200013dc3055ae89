"""Pairs of modes as one drawing: the analysis with the sensors on it, and beside it the test, moving together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from modalprep.correlation.mode_set import ModeSet
from modalprep.correlation.pairing import Correlation
from modalprep.correlation.sensors import expand
from modalprep.errors import InputError
from modalprep.report.scene.camera import view
from modalprep.report.scene.record import Scene
from modalprep.report.tables import hertz

SENSORS = 150  # marked sensors; of more, as many are chosen evenly
GAP = 0.45  # between the two models, of their size: each moves by a tenth of the size of both
Cells = Mapping[str, np.ndarray]


def draw_pairs(correlation: Correlation, analysis: ModeSet, cells: Cells, test_cells: Cells | None = None) -> Scene:
    """Return the pairs of a comparison side by side, or one above the other where the model is wide.

    Each test mode has the sign and the size at the sensors of its partner. On the analysis the sensors, which move as
    the test does, are marked; beside it is the test: its own mesh, or its shapes expanded to that of the analysis, with
    its trace lines.

    Parameters
    ----------
    correlation : Correlation
    analysis : ModeSet
        On the whole mesh, the modes that were compared.
    cells : {type: (n_cells, n_nodes)}
        Of the analysis.
    test_cells : {type: (n_cells, n_nodes)}, optional
        Of a test that is a model itself.
    """
    i, j = correlation.pairs.T
    test = correlation.test.select(i)
    factor = _factors(correlation)
    left = analysis.shape[:, :, j]
    moved = _completed(test, factor, left[correlation.node])
    if test_cells is None:
        right, parts, notes = _expanded(correlation, analysis, moved, factor, cells)
    else:
        right = ModeSetPart(test.points, moved)
        parts = test_cells
        notes = []
    shift = _shift(analysis.points)
    points = np.concatenate([analysis.points, right.points + shift])
    some = np.arange(0, len(test.points), -(-len(test.points) // SENSORS)) if test_cells is None else np.zeros(0, int)
    if 0 < len(some) < len(test.points):
        notes.append(f"{len(some)} of {len(test.points)} sensors are marked.")
    if test_cells is None and not test.measured.all():
        notes.append("In directions that were not measured the dots move as the analysis does.")
    ends = [_nearest(analysis.points, left), _nearest(right.points, right.shape)]
    marks = [ends[0][0], ends[1][0] + shift, test.points[some], test.points[some] + shift]
    return Scene(
        name=f"{correlation.test.name} and {correlation.analysis.name}",
        points=points,
        cells=_joined(cells, parts, len(analysis.points)),
        shape=np.concatenate([left, right.shape]),
        frequency=test.frequency,
        interface_name=("analysis", "test", *[""] * (2 * len(some))),
        interface_position=np.concatenate(marks),
        phi=np.concatenate([ends[0][1], ends[1][1], moved[some], moved[some]]),
        titles=tuple(f"pair {k}: {_title(row)}" for k, row in enumerate(correlation.rows(), start=1)),
        notes=tuple(notes),
    )


def _title(row: dict[str, Any]) -> str:
    test, analysis = (f"{row[side]} ({hertz(row[f'{side}_frequency_Hz'])} Hz)" for side in ("test", "analysis"))
    return f"test {test}, analysis {analysis}, MAC {row['mac']:.3f}"


@dataclass(frozen=True, eq=False)
class ModeSetPart:
    """Points (p, 3) and their motion (p, 3, n)."""

    points: np.ndarray
    shape: np.ndarray


def _factors(correlation: Correlation) -> np.ndarray:
    """Return what brings each test mode to the sign and the size of its partner at the sensors."""
    known = correlation.test.measured
    a = correlation.test.shape[known][:, correlation.pairs[:, 0]]
    b = correlation.analysis.shape[known][:, correlation.pairs[:, 1]]
    size = np.linalg.norm(a, axis=0)
    same = np.where(np.einsum("ij,ij->j", a, b) < 0, -1.0, 1.0)
    return same * np.linalg.norm(b, axis=0) / np.where(size > 0, size, 1.0)


def _completed(test: ModeSet, factor: np.ndarray, model: np.ndarray) -> np.ndarray:
    """Return the motion (p, 3, n) of the sensors: what they measure, and in other directions that of the model."""
    measured = np.where(test.measured[:, :, None], test.shape * factor, test.sees(model))
    return measured if test.axes is None else np.einsum("pab,pan->pbn", test.axes, measured)


def _expanded(correlation: Correlation, analysis: ModeSet, moved: np.ndarray, factor: np.ndarray, cells: Cells):
    """Return the test expanded to the mesh with its trace lines, its cells, and a note on how it is drawn."""
    test = correlation.test.select(correlation.pairs[:, 0])
    lines = {"line": test.lines} if len(test.lines) else {}
    try:
        whole = expand(test, correlation.node, analysis.select(correlation.pairs[:, 1]))
    except InputError as error:
        note = f"The test is drawn by its sensors and trace lines alone, as it cannot be expanded to the mesh: {error}."
        return ModeSetPart(test.points, moved), lines, [note]
    points = np.concatenate([analysis.points, test.points])
    shape = np.concatenate([whole.shape * factor, moved])
    note = "The test is expanded to the mesh in the span of the paired modes (SEREP); dots and lines are as measured."
    return ModeSetPart(points, shape), _joined(cells, lines, len(analysis.points)), [note]


def _joined(first: Cells, second: Cells, count: int) -> dict[str, np.ndarray]:
    found = {kind: [np.asarray(rows)] for kind, rows in first.items()}
    for kind, rows in second.items():
        found.setdefault(kind, []).append(np.asarray(rows) + count)
    return {kind: np.concatenate(rows) for kind, rows in found.items()}


def _nearest(points: np.ndarray, shape: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the point (1, 3) nearest to the origin of the frame, and its motion (1, 3, n)."""
    k = int(np.argmin(np.linalg.norm(points, axis=1)))
    return points[k : k + 1], shape[k : k + 1]


def _shift(points: np.ndarray) -> np.ndarray:
    """Return the vector from one model to the other: across the shorter extent in the view."""
    towards, up = view(points)
    right = np.cross(up, towards)
    across, along = (float(np.ptp(points @ axis)) for axis in (right, up))
    size = float(np.linalg.norm(np.ptp(points, axis=0))) or 1.0
    axis, extent = (right, across) if across < 1.5 * along else (-up, along)
    return (extent + GAP * size) * axis
