"""Several meshes as one, joined at nodes that they share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from modalprep.fe.mesh.builder import BLANK
from modalprep.fe.mesh.mesh import Mesh


def join_meshes(meshes: Mapping[int, Mesh], same: Sequence[tuple[tuple[int, int], tuple[int, int]]]) -> Mesh:
    """Return one mesh of several.

    Parameters
    ----------
    meshes : {number: Mesh}
        Groups and supports of number 2 get names that begin with ``part2_``; those of number 0 keep theirs.
    same : pairs of (number of the mesh, node)
        Nodes that become one, which has the place and the number of the first mesh that has it.

    Returns
    -------
    Mesh
        A node whose number an earlier mesh has too gets the number of its mesh before its own: 206 for 6 of mesh 2
        where all have two digits.

    Examples
    --------
    >>> bar = Mesh(points=np.array([[0.0, 0, 0], [1, 0, 0]]), cells={"line": np.array([[0, 1]])},
    ...            groups={"bar": {"line": np.array([0])}}, labels=np.array([1, 2]))
    >>> joined = join_meshes({0: bar, 3: bar.with_(points=bar.points + [1.0, 0, 0])}, [((0, 1), (3, 0))])
    >>> joined.cells["line"].tolist(), list(joined.groups), joined.labels
    ([[0, 1], [1, 2]], ['bar', 'part3_bar'], array([ 1,  2, 32]))
    """
    first = dict(zip(meshes, np.cumsum([0, *(len(mesh.points) for mesh in meshes.values())]), strict=False))
    points = np.concatenate([mesh.points for mesh in meshes.values()])
    number, kept = _merged(len(points), [[first[mesh] + node for mesh, node in pair] for pair in same])
    place = {k: number[start : start + len(meshes[k].points)] for k, start in first.items() if k in meshes}
    one = next(iter(meshes.values()))
    cells, start = _cells(meshes, place)
    prefix = {k: f"part{k}_" if k else "" for k in meshes}
    return Mesh(
        points=points[kept],
        cells=cells,
        groups={
            prefix[k] + name: {kind: rows + start[k][kind] for kind, rows in group.items()}
            for k, mesh in meshes.items()
            for name, group in mesh.groups.items()
        },
        source=one.source,
        sha256=one.sha256,
        scale=one.scale,
        labels=_labels(meshes, kept),
        properties={
            prefix[k] + name: section for k, mesh in meshes.items() for name, section in mesh.properties.items()
        },
        links=tuple(link.renumbered(place[k]) for k, mesh in meshes.items() for link in mesh.links),
        equations=tuple(e.with_(nodes=place[k][e.nodes]) for k, mesh in meshes.items() for e in mesh.equations),
        matrices=tuple(own.renumbered(place[k]) for k, mesh in meshes.items() for own in mesh.matrices),
        supports={
            prefix[k] + name: held.with_(nodes=place[k][held.nodes])
            for k, mesh in meshes.items()
            for name, held in mesh.supports.items()
        },
        loads={
            prefix[k] + name: load.renumbered(place[k])
            for k, mesh in meshes.items()
            for name, load in mesh.loads.items()
        },
        cases=one.cases,
        data=_data(meshes, cells, start),
        notes=tuple(f"part {k}: {note}" if k else note for k, mesh in meshes.items() for note in mesh.notes),
    )


def _labels(meshes: Mapping[int, Mesh], kept: np.ndarray) -> np.ndarray:
    """Return a number of its own for each node of the joined mesh, those `kept` of all."""
    labels = np.concatenate([mesh.labels for mesh in meshes.values()])[kept]
    mesh = np.repeat(list(meshes), [len(mesh.points) for mesh in meshes.values()])[kept]
    _, first = np.unique(labels, return_index=True)
    again = np.setdiff1d(np.arange(len(labels)), first)
    labels[again] += mesh[again] * 10 ** len(str(labels.max()))
    return labels


def _merged(n: int, pairs: list[list[int]]) -> tuple[np.ndarray, np.ndarray]:
    """Return the new number of each node ``(n,)``, and the node that each new one comes from."""
    rows, cols = np.array(pairs, dtype=int).reshape(-1, 2).T
    _, label = connected_components(coo_array((np.ones(len(rows)), (rows, cols)), shape=(n, n)), directed=False)
    _, kept, back = np.unique(label, return_index=True, return_inverse=True)
    order = np.argsort(kept)
    rank = np.empty(len(kept), dtype=int)
    rank[order] = np.arange(len(kept))
    return rank[back], kept[order]


def _cells(meshes: Mapping[int, Mesh], place: dict[int, np.ndarray]):
    """Return the cells of all meshes, and the row of each kind at which those of a mesh begin."""
    found: dict[str, list[np.ndarray]] = {}
    start: dict[int, dict[str, int]] = {}
    for k, mesh in meshes.items():
        start[k] = {kind: sum(map(len, found.get(kind, []))) for kind in mesh.cells}
        for kind, conn in mesh.cells.items():
            found.setdefault(kind, []).append(place[k][conn])
    return {kind: np.concatenate(parts) for kind, parts in found.items()}, start


def _data(meshes: Mapping[int, Mesh], cells: dict[str, np.ndarray], start) -> dict[str, dict[str, np.ndarray]]:
    data: dict[str, dict[str, np.ndarray]] = {}
    for k, mesh in meshes.items():
        for name, by_kind in mesh.data.items():
            for kind, values in by_kind.items():
                blank = np.full((len(cells[kind]), *values.shape[1:]), BLANK.get(name, np.nan))
                table = data.setdefault(name, {}).setdefault(kind, blank)
                table[start[k][kind] : start[k][kind] + len(values)] = values
    return data
