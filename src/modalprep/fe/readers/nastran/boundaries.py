"""Where the parts of a Nastran deck are joined: SECONCT, and grids in one place (SEBULK, SEBNDRY, SEEXCLD)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from itertools import combinations

import numpy as np
from scipy.spatial import cKDTree

from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.readers.nastran.cards import Card

TOLERANCE = 1e-5  # of Nastran, in units of the deck
ALL = -1  # stands for all other parts
Pair = tuple[tuple[int, int], tuple[int, int]]


def joined_grids(tables: Iterable[Card], meshes: Mapping[int, Mesh]) -> list[Pair]:
    """Return the pairs of (part, grid) that are one.

    Raises
    ------
    InputError
        When a SECONCT names a grid that its part does not have.
    """
    tables = list(tables)
    bulk = {card.id: card for card in tables if card.name == "SEBULK"}
    found = [pair for card in tables if card.name == "SECONCT" for pair in _connected(card, meshes)]
    searched = {
        number: mesh for number, mesh in meshes.items() if number not in bulk or bulk[number].text(3) != "MANUAL"
    }
    allowed, excluded = (_listed(tables, name, meshes) for name in ("SEBNDRY", "SEEXCLD"))
    tolerance = {number: card.real(4, "TOL", TOLERANCE) or TOLERANCE for number, card in bulk.items()}
    for a, b in combinations(searched, 2):
        reach = max(tolerance.get(a, TOLERANCE), tolerance.get(b, TOLERANCE))
        for i, k in _coincident(meshes[a], meshes[b], reach):
            if _taken(allowed, excluded, a, b, i) and _taken(allowed, excluded, b, a, k):
                found.append(((a, i), (b, k)))
    return found


def _taken(allowed: dict, excluded: dict, part: int, other: int, grid: int) -> bool:
    """Whether a grid of a part is looked at when the part is joined to another one."""
    lists = [allowed[key] for key in ((part, other), (part, ALL)) if key in allowed]
    inside = not lists or any(grid in own for own in lists)
    return inside and not any(grid in excluded.get(key, ()) for key in ((part, other), (part, ALL)))


def _listed(tables: Iterable[Card], name: str, meshes: Mapping[int, Mesh]) -> dict[tuple[int, int], set[int]]:
    """Return the grids of SEBNDRY or SEEXCLD by the part that has them and the other part."""
    found: dict[tuple[int, int], set[int]] = {}
    for card in (card for card in tables if card.name == name):
        part = card.integer(0, "SEIDA", lowest=0)
        other = ALL if card.text(1) == "ALL" else card.integer(1, "SEIDB", lowest=0)
        known = np.sort(meshes[part].labels) if part in meshes else np.zeros(0, dtype=int)
        grids = known.tolist() if card.text(2) == "ALL" else card.numbers(2, "a grid", known)
        found.setdefault((part, other), set()).update(grids)
    return found


def _connected(card: Card, meshes: Mapping[int, Mesh]) -> Iterator[Pair]:
    """Yield the grids that a SECONCT joins: pairs, or two ranges of the same length."""
    a, b = card.integer(0, "SEIDA", lowest=0), card.integer(1, "SEIDB", lowest=0)
    words = [text for text in card.fields[8:] if text]
    while words:
        span = 6 if words[1:2] == ["THRU"] else 2
        inner = Card(card.name, words[:span], card.file, card.line)
        words = words[span:]
        at = (0, 3) if span == 6 else (0, 1)
        first, second = (inner.integer(k, "a grid", lowest=1) for k in at)
        count = inner.integer(2, "the last grid") - first + 1 if span == 6 else 1
        for k in range(count):
            pair = (a, first + k), (b, second + k)
            if all(part in meshes and grid in meshes[part].labels for part, grid in pair):
                yield pair
            elif span == 2 and any(part in meshes and grid in meshes[part].labels for part, grid in pair):
                raise card.error(f"grids {first} and {second} cannot be joined, because one of them is not in its part")


def _coincident(one: Mesh, other: Mesh, reach: float) -> list[tuple[int, int]]:
    """Return the grids of two parts that lie in one place, within `reach` in units of the deck."""
    near = cKDTree(one.points).query(other.points, distance_upper_bound=reach * one.scale)[1]
    return [(int(one.labels[i]), int(other.labels[k])) for k, i in enumerate(near) if i < len(one.points)]
