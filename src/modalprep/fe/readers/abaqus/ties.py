"""Surfaces that are tied: every node of the slave surface moves with the point of a master face next to it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.fe.mesh.cells import CELLS
from modalprep.fe.mesh.nearest_face import Faces
from modalprep.fe.readers.abaqus.cyclic import cyclic_tie
from modalprep.fe.readers.abaqus.deck import Deck
from modalprep.fe.readers.abaqus.lexer import Block, Row
from modalprep.fe.readers.abaqus.sets import faces_of, surface_nodes, surface_of
from modalprep.vectors import skew

TOLERANCE = 0.05  # of the size of a master face, where the deck gives none
NOTHING = 1e-13  # of a weight


class Tied(NamedTuple):
    """A slave node, the nodes of its master face with their weights, and the gap ``(3,)`` from its point to it.

    `turning (nodes, 3, 3)` makes the rotation of the face of the displacements of its nodes.
    """

    slave: int
    nodes: list[int]
    weights: np.ndarray
    gap: np.ndarray
    turning: np.ndarray
    name: str


def tie(deck: Deck, block: Block) -> None:
    """``*TIE``: translations, and rotations where both sides have them.

    Nodes off the surface are moved onto it, or with ADJUST=NO stay where they are and turn with the master face.
    """
    if not block.rows:
        block.refuse("names no surfaces; give the slave and the master")
    if "CYCLIC SYMMETRY" in block.options:
        cyclic_tie(deck, block)
        return
    tolerance = block.options.get("POSITION TOLERANCE")
    move = block.choice("ADJUST", "YES") != "NO"
    for row in block.rows:
        slaves = surface_nodes(deck, block, row.text(0))
        faces = faces_of(deck, block, surface_of(deck, block, row.text(1)))
        faces = [face for face in faces if CELLS[face[0]].dimension == 2]
        if not slaves or not faces:
            raise row.error("a surface of *TIE has no nodes or no faces; the master must be one of faces")
        reach = Row([tolerance], row.file, row.line).real(0, "POSITION TOLERANCE") if tolerance else None
        _tie(deck, row, slaves, faces, reach, move)


def _tie(
    deck: Deck, row: Row, slaves: list[int], faces: list[tuple[str, list[int]]], reach: float | None, move: bool
) -> None:
    surface = Faces(faces, deck.points)
    masters = {node for _, nodes in faces for node in nodes}
    tied = deck.current.setdefault("tied", set())
    far = []
    moved = 0.0
    for slave in slaves:
        if slave in masters or slave in tied:
            continue
        at = deck.points[slave]
        place, nodes, size = surface.nearest(at)
        if place.distance > (TOLERANCE * size if reach is None else reach):
            far.append(slave)
            continue
        gap = np.zeros(3) if move else at - place.point
        if move:
            moved = max(moved, place.distance)
            deck.points[slave] = place.point
        tied.add(slave)
        turning = _turning(np.array([deck.points[i] for i in nodes]), place.slopes)
        own = Tied(slave, nodes.tolist(), place.weights, gap, turning, f"*TIE in line {row.line}")
        deck.current.setdefault("ties", []).append(own)
    _say(deck, row, len(slaves), far, moved)


def _say(deck: Deck, row: Row, count: int, far: list[int], moved: float) -> None:
    if len(far) == count:
        raise row.error("no node of the slave surface lies on the master surface; correct the tie or its tolerance")
    if far:
        first = ", ".join(deck.label(node) for node in far[:3])
        deck.note(f"*TIE in line {row.line}: {len(far)} of {count} nodes lie off the master and are free ({first}...)")
    size = np.ptp(np.array(deck.points), axis=0).max()
    if moved > 1e-6 * size:
        deck.note(f"*TIE in line {row.line}: nodes are moved onto the master surface by up to {moved:.3g}")


def tie_equations(deck: Deck, turning: set[int]) -> None:
    """Make the equations of the ties; `turning` are the nodes with rotations."""
    for tied in deck.current.get("ties", []):
        whole = all(node in turning for node in tied.nodes)
        for c in range(6 if whole and tied.slave in turning else 3):
            terms = [(n, c, -float(w)) for n, w in zip(tied.nodes, tied.weights, strict=True) if abs(w) > NOTHING]
            if c < 3 and tied.gap.any():
                terms += _of_gap(tied, c, whole)
            deck.equations.append(([(tied.slave, c, 1.0), *_summed(terms)], tied.name))


def _of_gap(tied: Tied, component: int, whole: bool) -> list[tuple[int, int, float]]:
    """Return the terms of the rotation of the master face, about which the gap turns: of its nodes or its shape."""
    lever = skew(tied.gap)[component]  # theta x gap = -gap x theta
    if whole:
        rows = tied.weights[:, None] * lever
        return [(n, 3 + k, float(x)) for n, row in zip(tied.nodes, rows, strict=True) for k, x in enumerate(row) if x]
    rows = lever @ tied.turning
    return [(n, k, float(x)) for n, row in zip(tied.nodes, rows, strict=True) for k, x in enumerate(row) if x]


def _summed(terms: list[tuple[int, int, float]]) -> list[tuple[int, int, float]]:
    """Return terms with each component of each node once."""
    total: dict[tuple[int, int], float] = {}
    for node, c, factor in terms:
        total[node, c] = total.get((node, c), 0.0) + factor
    return [(node, c, factor) for (node, c), factor in total.items()]


def _turning(points: np.ndarray, slopes: np.ndarray) -> np.ndarray:
    """Return the rotation of a face by the displacements of its nodes ``(n, 3, 3)``; exact for rigid motions.

    ``omega = (g^1 x dg_1 + g^2 x dg_2 + n x dn) / 2`` with the tangents g_a, their dual base g^a, and the normal n,
    whose change is ``dn = -(dg_a n) g^a``.
    """
    tangents = (points.T @ slopes).T
    normal = np.cross(*tangents)
    normal = normal / np.linalg.norm(normal)
    dual = np.linalg.inv(np.array([*tangents, normal])).T[:2]
    turns = [(skew(g) - np.outer(np.cross(normal, g), normal)) / 2 for g in dual]
    return np.einsum("na,aij->nij", slopes, np.array(turns))
