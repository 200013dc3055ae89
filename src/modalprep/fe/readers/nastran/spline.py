"""RSPLINE: grids that follow the elastic line of a tube through others."""

from __future__ import annotations

import numpy as np

from modalprep.fe.mesh.mesh import Equation
from modalprep.fe.readers.nastran.builder import Builder
from modalprep.fe.readers.nastran.cards import Card
from modalprep.fe.readers.nastran.constraints import components_of, place_of
from modalprep.vectors import skew

SLENDER = 0.1  # diameter over length, where the card has none
NOTHING = 1e-9  # coefficients, rotations times the length


def rspline(b: Builder, card: Card) -> None:
    """RSPLINE: D/L, then grids, each but the first and the last with the components that depend.

    All other components of its grids are independent; the dependent ones are where the tube rests.
    """
    last = len(card.fields) - 1
    places = [2, *range(3, last + 1, 2)]
    nodes = [b.grids.node(card, k, "a grid") for k in places]
    dependent = [np.zeros(6, dtype=bool) for _ in nodes]
    for k, place in enumerate(places[1:], 1):
        if card.text(place + 1):
            dependent[k] = components_of(card, card.text(place + 1))
    if len(nodes) < 3 or dependent[-1].any() or not np.any(dependent):
        raise card.error("its last grid must be independent, and one between it and the first depend; correct its list")
    held = np.concatenate(dependent)
    points = b.grids.points[nodes] * b.units.length
    turns = [np.kron(np.eye(2), b.grids.displacement(node)) for node in nodes]
    K = _tube(card, points, card.real(1, "D/L", SLENDER))
    for k, turn in enumerate(turns):
        own = slice(6 * k, 6 * k + 6)
        K[own] = turn @ K[own]
        K[:, own] = K[:, own] @ turn.T
    follow = -np.linalg.solve(K[np.ix_(held, held)], K[np.ix_(held, ~held)])
    _add(b, card, nodes, np.flatnonzero(held), np.flatnonzero(~held), follow, np.ptp(points, axis=0).max())


def _tube(card: Card, points: np.ndarray, slenderness: float) -> np.ndarray:
    """Return the stiffness ``(6 n, 6 n)`` of a thin tube through points, with E I = 1 and no Poisson's ratio."""
    steps = np.diff(points, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    if not (lengths > 0).all() or slenderness <= 0:
        raise card.error("two of its grids that follow each other lie in one place, or D/L is not positive; correct it")
    EA = 8 / (slenderness * lengths.sum()) ** 2  # A = 8 I / D^2
    K = np.zeros((6 * len(points), 6 * len(points)))
    for k, (step, length) in enumerate(zip(steps, lengths, strict=True)):
        moved = np.hstack([-np.block([[np.eye(3), -skew(step)], [np.zeros((3, 3)), np.eye(3)]]), np.eye(6)])
        own = slice(6 * k, 6 * k + 12)
        K[own, own] += moved.T @ np.linalg.inv(_flexibility(step / length, length, EA)) @ moved
    return K


def _flexibility(e: np.ndarray, length: float, EA: float) -> np.ndarray:
    """Return displacement and rotation of the end of a clamped tube by its force and moment ``(6, 6)``."""
    along = np.outer(e, e)
    across = np.eye(3) - along
    mixed = -skew(e) * length**2 / 2
    return np.block(
        [
            [along * length / EA + across * length**3 / 3, mixed],
            [mixed.T, (across + along) * length],  # G J = E I of a thin tube without Poisson's ratio
        ]
    )


def _add(
    b: Builder,
    card: Card,
    nodes: list[int],
    held: np.ndarray,
    free: np.ndarray,
    follow: np.ndarray,
    size: float,
) -> None:
    """Add an equation for each dependent component."""
    axes = {node: b.grids.displacement(node) for node in nodes}
    for own, row in zip(held, follow, strict=True):
        terms = [(nodes[own // 6], int(own % 6), 1.0)]
        scaled = np.where(free % 6 < 3, 1.0, 1 / size) * (size if own % 6 > 2 else 1.0)
        terms += [
            (nodes[k // 6], int(k % 6), -float(value))
            for k, value, scale in zip(free, row, scaled, strict=True)
            if abs(value * scale) > NOTHING
        ]
        b.equations.append(Equation.of_terms(terms, length=1.0, name=place_of(card), axes=axes))
