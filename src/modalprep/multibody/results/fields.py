"""Recovered quantities over the nodes and cells of a mesh, for pictures and files."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.recovery import Recovery


def cell_fields(body: FlexibleBody, block: Recovery, values: np.ndarray) -> dict[str, dict[str, np.ndarray]]:
    """Return the values of a recovery of elements over the cells, NaN elsewhere.

    Parameters
    ----------
    block : Recovery
        With `cell`.
    values : (p, c)
        Of its `full_components` at one time.

    Returns
    -------
    {name: {type: (n_cells,)}}
        By ``component``, after ``place.`` where a cell has several, such as ``top.xx`` or ``start.N``.
    """
    assert block.cell is not None
    parts = np.array([_part(place) for place in block.places])
    found = {}
    for part in dict.fromkeys(parts.tolist()):
        some = parts == part
        for component, own in zip(block.full_components, values[some].T, strict=True):
            field = np.full(sum(len(nodes) for nodes in body.cells.values()), np.nan)
            field[block.cell[some]] = own
            found[".".join(filter(None, (part, component)))] = _by_type(body.cells, field)
    return found


def node_field(body: FlexibleBody, block: Recovery, values: np.ndarray, component: str) -> np.ndarray:
    """Return one component of a recovery at the nodes ``(n_points,)``, NaN where it has none.

    Of elements it is the mean around each node of the largest magnitudes in them, with their sign.

    Parameters
    ----------
    values : (p, c)
        Of its `full_components` at one time.
    """
    own = values[:, block.full_components.index(component)]
    field = np.full(len(body.points), np.nan)
    if block.node is not None:
        field[block.node] = own
        return field
    assert block.cell is not None
    order = np.argsort(np.abs(own), kind="stable")  # the last of a cell is its largest
    largest = np.full(sum(len(nodes) for nodes in body.cells.values()), np.nan)
    largest[block.cell[order]] = own[order]
    total, count = np.zeros((2, len(field)))
    for kind, cells in _by_type(body.cells, largest).items():
        known = np.isfinite(cells)
        nodes = body.cells[kind][known]
        np.add.at(total, nodes, cells[known][:, None])
        np.add.at(count, nodes, 1)
    return np.divide(total, count, out=field, where=count > 0)


def on_mesh(block: Recovery) -> bool:
    """Whether a recovery belongs to nodes or cells of the mesh."""
    return block.node is not None or block.cell is not None


def _part(place: str) -> str:
    """Return what follows the number of the element."""
    number, _, rest = place.partition(".")
    return rest if number.isdigit() else "" if place in ("shell", "spring") else place


def _by_type(cells: Mapping[str, np.ndarray], field: np.ndarray) -> dict[str, np.ndarray]:
    kinds = sorted(cells)
    ends = np.cumsum([len(cells[kind]) for kind in kinds])
    return dict(zip(kinds, np.split(field, ends[:-1]), strict=True))
