"""Hidden hinges: solids have no rotations, so that shells and beams on an edge or a point of them can rotate freely."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from modalprep.fe.assembly.parts import Part
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.properties.properties import Beam, Shell, Solid


def hidden_hinges(mesh: Mesh, parts: list[Part]) -> list[str]:
    """Return a message for each region where a shell or beam meets a solid without transferring its rotation.

    A shell that covers at least one face of the solid, or nodes tied by an rbe2, are no hinge.
    """
    solid = np.zeros(len(mesh.points), dtype=bool)
    for part in parts:
        if isinstance(part.section, Solid):
            solid[part.nodes] = True
    tied = [np.append(link.nodes, link.node) for link in mesh.links if link.kind == "rbe2"]
    solid[np.concatenate([np.zeros(0, dtype=int), *tied])] = False
    sentences = []
    for family, name in ((Shell, "shell"), (Beam, "beam")):
        conn = [part.nodes for part in parts if isinstance(part.section, family)]
        for nodes in _hinges(conn, solid):
            at = ", ".join(f"{v:.4g}" for v in mesh.points[nodes].mean(axis=0))
            cure = "lay the shell over one row of faces of the solid, or tie its edge with an rbe2"
            if family is Beam:
                cure = "run the beam into the solid along several nodes off one line, or tie its end with an rbe2"
            sentences.append(
                f"hidden hinge: a {name} meets a solid at {len(nodes)} nodes around ({at}) m without passing on "
                f"its rotation; {cure}"
            )
    return sentences


def _hinges(conn: list[np.ndarray], solid: np.ndarray) -> list[np.ndarray]:
    """Return clusters of shared nodes in which no element is a face of the solid."""
    if not conn or not np.any(solid):
        return []
    inside = [solid[c] for c in conn]
    pairs = [c[np.sum(s, axis=1) > 0] for c, s in zip(conn, inside, strict=True)]
    faces = [c[np.all(s, axis=1)] for c, s in zip(conn, inside, strict=True) if c.shape[1] > 2]
    shared = np.unique(np.concatenate([c[solid[c]] for c in pairs]))
    graph = _graph(pairs, solid, len(solid))
    label = connected_components(graph, directed=False)[1]
    covered = {int(label[c[0]]) for f in faces for c in f}
    clusters = [shared[label[shared] == k] for k in np.unique(label[shared])]
    return [nodes for nodes in clusters if int(label[nodes[0]]) not in covered]


def _graph(conn: list[np.ndarray], solid: np.ndarray, n: int) -> coo_array:
    """Return the graph in which the shared nodes of an element are connected."""
    rows, cols = [np.zeros(0, dtype=int)], [np.zeros(0, dtype=int)]
    for c in conn:
        for i in range(c.shape[1]):
            for j in range(i):
                both = solid[c[:, i]] & solid[c[:, j]]
                rows.append(c[both, i])
                cols.append(c[both, j])
    rows, cols = np.concatenate(rows), np.concatenate(cols)
    return coo_array((np.ones(len(rows), dtype=np.int8), (rows, cols)), shape=(n, n))
