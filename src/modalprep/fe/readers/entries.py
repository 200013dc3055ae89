"""Matrices as read from files: a name, entries, and the node and component of each row."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import coo_array, csr_array, eye_array

from modalprep.errors import InputError
from modalprep.fe.mesh.mesh import Mesh

HOLLOW = 1_000_000  # rows without an entry that cost no memory to speak of


class Labelled(NamedTuple):
    """A matrix and the (node number of the file, component 0..5) of each row, ``(n, 2)``; None: rows by position."""

    matrix: csr_array
    rows: np.ndarray | None


@dataclass(frozen=True, eq=False)
class Found:
    """The content of one file: matrices by name, and perhaps nodes (file units) and their DOFs."""

    matrices: dict[str, Labelled]
    nodes: Mesh | None = None
    dof: Any = field(default=None)
    supported: str = ""  # why the matrices are those of a supported structure


def labelled(row: np.ndarray, column: np.ndarray, values: np.ndarray) -> Labelled:
    """Return the matrix of entries between ``row (k, 2)`` and ``column (k, 2)``, sorted by node and component.

    Examples
    --------
    >>> K = labelled(np.array([[7, 0], [7, 1]]), np.array([[7, 0], [7, 1]]), np.array([4.0, 5.0]))
    >>> K.rows.tolist(), K.matrix.toarray().tolist()
    ([[7, 0], [7, 1]], [[4.0, 0.0], [0.0, 5.0]])
    """
    rows, at = np.unique(np.concatenate([row, column]), axis=0, return_inverse=True)
    place = tuple(at.reshape(2, -1))
    return Labelled(coo_array((values, place), shape=(len(rows),) * 2).tocsr(), rows)


def integers(values: np.ndarray) -> np.ndarray:
    """Return counts and numbers of rows, read as real ones, as the integers that they must be.

    Raises
    ------
    ValueError
        When one is not positive, not whole, or of more than nine digits.

    Examples
    --------
    >>> integers(np.array([2.0, 3.0]))
    array([2, 3])
    """
    if not np.all((values >= 1) & (values < 1e9) & (values == np.round(values))):
        raise ValueError("a size, row, node or dof is not a positive whole number (of nine digits at most)")
    return values.astype(int)


def refuse_hollow(rows: int, entries: int) -> None:
    """Refuse a matrix of mostly empty rows, each of which takes memory.

    Raises
    ------
    ValueError
        When it is.
    """
    if rows > HOLLOW + entries:
        raise ValueError(f"it has {rows} rows or columns, but {entries} entries")


def mirrored(A: csr_array) -> csr_array:
    """Return the full matrix of which only one of each pair of entries is given.

    Examples
    --------
    >>> mirrored(csr_array(np.array([[2.0, 0.0], [1.0, 3.0]]))).toarray().tolist()
    [[2.0, 1.0], [1.0, 3.0]]
    """
    given = A.astype(bool).astype(float)
    return (A + A.T - A.T.multiply(given)).tocsr()


def together(first: Labelled, second: Labelled) -> tuple[csr_array, csr_array, np.ndarray | None]:
    """Return both matrices over the union of their rows, and these rows; unlabelled matrices as they are."""
    if first.rows is None or second.rows is None:
        return first.matrix, second.matrix, first.rows if first.rows is not None else second.rows
    rows, at = np.unique(np.concatenate([first.rows, second.rows]), axis=0, return_inverse=True)
    parts = np.split(at.ravel(), [len(first.rows)])
    return *(_spread(A.matrix, part, len(rows)) for A, part in zip((first, second), parts, strict=True)), rows


def in_basic_axes(A: Labelled, axes: Mapping[int, np.ndarray]) -> Labelled:
    """Return a matrix whose nodes have displacements in axes of their own, in basic axes.

    Parameters
    ----------
    A : Labelled
    axes : {node number: (3, 3)}
        Columns: the axes of the node's components in basic axes. A node that has some translations, or some rotations,
        has all three of them in the answer.

    Examples
    --------
    >>> K = labelled(np.array([[7, 0]]), np.array([[7, 0]]), np.array([4.0]))
    >>> turned = in_basic_axes(K, {7: np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])})  # x of the node is y
    >>> turned.matrix.toarray()[1].tolist()
    [0.0, 4.0, 0.0]
    """
    if A.rows is None or not axes:
        return A
    own = A.rows[np.isin(A.rows[:, 0], list(axes)) & (A.rows[:, 1] >= 0)]
    first = np.unique(np.column_stack([own[:, 0], own[:, 1] - own[:, 1] % 3]), axis=0)
    block = np.concatenate([first + np.array([0, k]) for k in range(3)])
    rows, at = np.unique(np.concatenate([A.rows, block]), axis=0, return_inverse=True)
    turn = eye_array(len(rows), format="lil")
    for (node, _), place in zip(first, at.ravel()[len(A.rows) :].reshape(3, -1).T, strict=True):
        turn[np.ix_(place, place)] = axes[int(node)]
    turn = turn.tocsr()
    return Labelled((turn @ _spread(A.matrix, at.ravel()[: len(A.rows)], len(rows)) @ turn.T).tocsr(), rows)


def _spread(A: csr_array, where: np.ndarray, n: int) -> csr_array:
    entries = A.tocoo()
    return coo_array((entries.data, (where[entries.row], where[entries.col])), shape=(n, n)).tocsr()


def cloud(
    nodes: Any,
    scale: float = 1.0,
    cells: dict[str, np.ndarray] | None = None,
    sets: dict[str, np.ndarray] | None = None,
    **fields: Any,
) -> Mesh:
    """Return nodes ``(n, 3)`` as a mesh, with cells to draw and node sets if there are any.

    Parameters
    ----------
    nodes : (n, 3)
    scale : float
        m per unit of length.
    cells : {type: (k, nodes) int}
    sets : {name: (k,) int}
        Rows of `nodes`; each becomes a group.
    fields
        Further fields of the mesh.

    Raises
    ------
    InputError
        When the coordinates are not three finite numbers each, or a cell or set names a node that is not there.

    Examples
    --------
    >>> cloud([[0, 0, 0], [1, 0, 0]], sets={"tip": np.array([1])}).nodes("tip")
    array([1])
    """
    try:
        points = np.asarray(nodes, dtype=float)
    except (TypeError, ValueError):
        points = np.zeros(0)
    if points.shape[1:] != (3,) or not len(points):
        raise InputError(f"nodes has shape {points.shape}; give the coordinates x, y, z of every node, (n_nodes, 3)")
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if len(bad):
        raise InputError(f"{len(bad)} nodes have coordinates that are not numbers, the first is in row {bad[0] + 1}")
    cells, sets = cells or {}, sets or {}
    for name, rows in (cells | sets).items():
        if np.min(rows, initial=0) < 0 or np.max(rows, initial=0) >= len(points):
            raise InputError(f"{name!r} names a node that is not there: there are {len(points)} nodes")
    return Mesh(
        points=points * scale,
        cells={"vertex": np.arange(len(points))[:, None], **cells},
        groups={name: {"vertex": np.asarray(rows)} for name, rows in sets.items()},
        scale=scale,
        **fields,
    )
