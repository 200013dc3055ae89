"""Rows of reduced matrices: displacements and rotations of boundary nodes in their own axes, and scalar coordinates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from modalprep.errors import InputError
from modalprep.records import Record
from modalprep.suggest import refuse_unknown
from modalprep.vectors import skew

ROTATION = 1e-6  # of unit axes: cards hold seven digits
RANK = 1e-8  # of a group's rigid columns, made dimensionless


@dataclass(frozen=True, eq=False, kw_only=True)
class BoundaryRows(Record):
    """The rows of reduced matrices, all that are in no node being generalised coordinates.

    Attributes
    ----------
    names : tuple of str
        Of the nodes.
    position : (k, 3)
        m, in basic axes.
    axes : (k, 3, 3)
        Columns: the axes of a node's displacements and rotations.
    dof : (k, 6) int
        Row of each component, -1 where a node has none.
    rows : int
        Rows of the matrices.

    Examples
    --------
    >>> dof, axes = np.arange(6)[None], np.eye(3)[None]
    >>> ends = BoundaryRows(names=("a",), position=np.ones((1, 3)), axes=axes, dof=dof, rows=8)
    >>> ends.generalised
    array([6, 7])
    >>> ends.motion(np.zeros(3))[:3, 5]  # by rotation about z
    array([-1.,  1.,  0.])
    """

    names: tuple[str, ...]
    position: np.ndarray
    axes: np.ndarray
    dof: np.ndarray
    rows: int

    @property
    def generalised(self) -> np.ndarray:
        """Rows of the generalised coordinates."""
        return np.setdiff1d(np.arange(self.rows), self.dof)

    @property
    def size(self) -> float:
        """Largest extent (m) of the nodes, 1 of a single one."""
        return float(np.ptp(self.position, axis=0).max()) or 1.0

    def label(self, row: int) -> str:
        """Return the name of a row for messages."""
        at = np.argwhere(self.dof == row)
        if not len(at):
            return f"generalised coordinate {1 + int(np.searchsorted(self.generalised, row))}"
        node, component = at[0]
        return f"{('ux', 'uy', 'uz', 'rx', 'ry', 'rz')[component]} of node {self.names[node]}"

    def motion(self, origin: np.ndarray) -> np.ndarray:
        """Return the rows' motion (rows, 6) in unit rigid motions about an origin, 0 for generalised coordinates."""
        R = np.zeros((self.rows, 6))
        for at, Q, dof in zip(self.position - origin, self.axes, self.dof, strict=True):
            own = np.block([[Q.T, -Q.T @ skew(at)], [np.zeros((3, 3)), Q.T]])
            R[dof[dof >= 0]] = own[dof >= 0]
        return R

    def group(self, nodes: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
        """Return the place (3,) of an interface on some nodes, and its motion (6, rows) by the rows of the matrices.

        That of a node with six components is its own; of several nodes it is their mean motion, weighted equally, by
        their displacements alone where these suffice. A rotation that the components do not determine is none.
        """
        table = self.dof[list(nodes)]
        place = self.position[list(nodes)].mean(axis=0)
        scale = np.repeat([1.0, self.size], 3)
        R = self.motion(place) / scale
        moved = table[:, :3][table[:, :3] >= 0]
        rows = moved if np.linalg.matrix_rank(R[moved], tol=RANK) == 6 else table[table >= 0]
        found = np.zeros((6, self.rows))
        found[:, rows] = np.linalg.pinv(R[rows], rcond=RANK) / scale[:, None]
        return place, found


def boundary_rows(
    nodes: Any,
    rows: int,
    length: float,
    *,
    dof: Any = None,
    axes: Any = None,
    names: Sequence[str] | None = None,
) -> BoundaryRows:
    """Return the rows of matrices, checked.

    Parameters
    ----------
    nodes : (k, 3)
        Positions in the unit of `length` m.
    rows : int
        Of the matrices.
    dof : (k, 6) int or None
        Row of each component; None: six for each node, then the generalised coordinates.
    axes : (k, 3, 3) or None
        Columns are the axes of each node's components; None: basic axes.
    names : sequence of str or None
        None: ``node_1`` and so on.

    Raises
    ------
    InputError
        When sizes do not match, a row is used twice, or axes are not those of a rotation.

    Examples
    --------
    >>> boundary_rows([[0.0, 0, 0]], 8, 1.0).names
    ('node_1',)
    """
    position = np.asarray(nodes, dtype=float)
    if position.ndim != 2 or position.shape[1] != 3 or not len(position) or not np.all(np.isfinite(position)):
        raise InputError(f"the nodes have shape {position.shape}; give three finite coordinates for each")
    k = len(position)
    names = tuple(f"node_{i + 1}" for i in range(k)) if names is None else tuple(str(name) for name in names)
    if len(names) != k or len(set(names)) != k:
        raise InputError(f"{k} nodes have {len(set(names))} different names; give one to each")
    axes = np.broadcast_to(np.eye(3), (k, 3, 3)) if axes is None else np.asarray(axes, dtype=float)
    return BoundaryRows(
        names=names, position=position * length, axes=_rotations(axes, names), dof=_table(dof, k, rows), rows=rows
    )


def _rotations(axes: np.ndarray, names: tuple[str, ...]) -> np.ndarray:
    """Return axes (k, 3, 3) made orthogonal to all digits."""
    if axes.shape != (len(names), 3, 3):
        raise InputError(f"the axes of {len(names)} nodes have shape {axes.shape}; give three columns for each")
    for Q, name in zip(axes, names, strict=True):
        if not np.abs(Q.T @ Q - np.eye(3)).max() <= ROTATION or np.linalg.det(Q) < 0:
            raise InputError(f"the axes of node {name} are not those of a rotation; give orthogonal unit columns")
    U, _, Vt = np.linalg.svd(axes)
    return U @ Vt


def _table(dof: Any, k: int, rows: int) -> np.ndarray:
    if dof is None:
        if rows < 6 * k:
            raise InputError(
                f"the matrices have {rows} rows, {k} nodes with six components each {6 * k}; say by dof which row is "
                "which component"
            )
        return np.arange(6 * k).reshape(k, 6)
    table = np.asarray(dof)
    if table.shape != (k, 6) or table.dtype.kind not in "iu" or table.max() >= rows or table.min() < -1:
        raise InputError(f"dof has shape {table.shape}; give {k} x 6 whole numbers from -1 (none) to {rows - 1}")
    used, count = np.unique(table[table >= 0], return_counts=True)
    if np.any(count > 1):
        raise InputError(f"dof names row {used[count > 1][0]} twice; each row is one component of one node")
    return table.astype(int)


def interface_nodes(
    ends: BoundaryRows, interfaces: Mapping[str, Sequence[str]] | None, root: str | None
) -> dict[str, list[int]]:
    """Return the nodes of each interface, the root first.

    Without `interfaces` each node is one. The root is the first with six components, or where there is none the mean
    motion of all nodes, named ``boundary``.

    Raises
    ------
    InputError
        When a name is unknown, or an interface has no nodes.

    Examples
    --------
    >>> list(interface_nodes(boundary_rows(np.eye(3), 18, 1.0), None, "node_2"))
    ['node_2', 'node_1', 'node_3']
    """
    if interfaces is None:
        found = {name: [k] for k, name in enumerate(ends.names)}
        full = [name for name, nodes in found.items() if np.all(ends.dof[nodes[0]] >= 0)]
        if root is None and not full:
            found = {"boundary": list(range(len(ends.names)))} | found
    else:
        found = {str(name): _numbers(ends, name, nodes) for name, nodes in interfaces.items()}
        full = list(found)
    if not found:
        raise InputError("there are no interfaces; give at least one")
    first = root if root is not None else next(iter(full or found))
    refuse_unknown(first, found, "root interface")
    return {first: found[first]} | found


def _numbers(ends: BoundaryRows, name: str, nodes: Sequence[str]) -> list[int]:
    if isinstance(nodes, str) or not len(nodes):
        raise InputError(f"interface {name!r} needs a list of nodes")
    for node in nodes:
        refuse_unknown(str(node), ends.names, f"interface {name!r}: node")
    return [ends.names.index(str(node)) for node in nodes]
