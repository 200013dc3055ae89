"""Surfaces that are tied: every node of the slave surface moves with the point of a master face next to it."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from modalprep.fe.mesh.cells import CELLS
from modalprep.fe.readers.abaqus.deck import Deck
from modalprep.fe.readers.abaqus.lexer import Block, Row
from modalprep.fe.readers.abaqus.sets import faces_of, surface_nodes, surface_of
from modalprep.vectors import skew

TOLERANCE = 0.05  # of the size of a master face, where the deck gives none
STEPS = 20  # of Newton's method; plane faces need one
SETTLED = 1e-13


class Place(NamedTuple):
    """The point of a face next to a node: distance, weights of the nodes of the face and their slopes, the point."""

    distance: float
    weights: np.ndarray
    slopes: np.ndarray
    point: np.ndarray


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
    if "CYCLIC SYMMETRY" in block.options:
        block.refuse("of a cyclic symmetry is not read; give the whole structure")
    if not block.rows:
        block.refuse("names no surfaces; give the slave and the master")
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
    points = [np.array([deck.points[i] for i in nodes]) for _, nodes in faces]
    centres = np.array([p.mean(axis=0) for p in points])
    radius = np.array([np.linalg.norm(p - c, axis=1).max() for p, c in zip(points, centres, strict=True)])
    tree = cKDTree(centres)
    masters = {node for _, nodes in faces for node in nodes}
    tied = deck.current.setdefault("tied", set())
    far = []
    moved = 0.0
    for slave in slaves:
        if slave in masters or slave in tied:
            continue
        at = deck.points[slave]
        near = tree.query(at)[0]
        places = [(nearest(faces[k][0], points[k], at), k) for k in tree.query_ball_point(at, near + radius.max())]
        place, k = min(places, key=lambda one: one[0].distance)
        if place.distance > (TOLERANCE * 2 * radius[k] if reach is None else reach):
            far.append(slave)
            continue
        gap = np.zeros(3) if move else at - place.point
        if move:
            moved = max(moved, place.distance)
            deck.points[slave] = place.point
        tied.add(slave)
        own = Tied(
            slave, faces[k][1], place.weights, gap, _turning(points[k], place.slopes), f"*TIE in line {row.line}"
        )
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
            terms = [(n, c, -float(w)) for n, w in zip(tied.nodes, tied.weights, strict=True) if abs(w) > SETTLED]
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


def nearest(kind: str, points: np.ndarray, at: np.ndarray) -> Place:
    """Return the point of a face ``points (n, 3)`` next to `at (3,)`.

    Examples
    --------
    >>> square = np.array([[0.0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]])
    >>> place = nearest("quad", square, np.array([0.5, 3.0, 1.0]))
    >>> place.point, place.weights.round(3)
    (array([0.5, 2. , 0. ]), array([0.  , 0.  , 0.25, 0.75]))
    """
    corners = CELLS[kind].corners
    centre = corners.mean(axis=0)
    found = [_newton(kind, points, at, centre, np.eye(2))]
    if not _inside(kind, found[0]):
        ends = zip(corners, np.roll(corners, -1, axis=0), strict=True)
        found = [_on_edge(kind, points, at, a, b) for a, b in ends]
    return min((_place(kind, points, at, x) for x in found), key=lambda place: place.distance)


def _place(kind: str, points: np.ndarray, at: np.ndarray, x: np.ndarray) -> Place:
    weights, slopes = _shapes(kind, x)
    point = weights @ points
    return Place(float(np.linalg.norm(point - at)), weights, slopes, point)


def _on_edge(kind: str, points: np.ndarray, at: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    x = _newton(kind, points, at, (a + b) / 2, (b - a)[None])
    s = np.clip((x - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
    return a + s * (b - a)


def _newton(kind: str, points: np.ndarray, at: np.ndarray, start: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Gauss and Newton from `start` in the directions `along (m, 2)` of the unit cell."""
    x = start
    for _ in range(STEPS):
        N, dN = _shapes(kind, x)
        tangent = along @ dN.T @ points
        step = np.linalg.lstsq(tangent.T, at - N @ points, rcond=None)[0] @ along
        x = np.clip(x + step, -2.0, 3.0)
        if np.abs(step).max() < SETTLED:
            break
    return x


def _inside(kind: str, x: np.ndarray) -> bool:
    high = x.sum() if CELLS[kind].shape == "triangle" else x.max()
    return bool(x.min() >= -1e-12 and high <= 1 + 1e-12)


@cache
def _coefficients(kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Exponents (n, 2) of the monomials, and their coefficients (monomial, node) in the shape functions."""
    powers = np.array(CELLS[kind].powers)
    X = CELLS[kind].node_coordinates()
    return powers, np.linalg.inv(np.prod(X[:, None] ** powers, axis=2))


def _shapes(kind: str, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the shape functions (n,) and their gradients (n, 2) at a point of the unit cell."""
    powers, C = _coefficients(kind)
    values = np.prod(x**powers, axis=1)
    slopes = []
    for d in (0, 1):
        lower = powers.copy()
        lower[:, d] = np.maximum(lower[:, d] - 1, 0)
        slopes.append(powers[:, d] * np.prod(x**lower, axis=1))
    return values @ C, (np.array(slopes) @ C).T
