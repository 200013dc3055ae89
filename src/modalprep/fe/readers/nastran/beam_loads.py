"""PLOAD1 of Nastran: forces and moments at points of a beam, or distributed along it, to loads of its grids."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from modalprep.fe.readers.loads import DeckLoad
from modalprep.fe.readers.nastran.builder import Builder
from modalprep.fe.readers.nastran.cards import Card

KINDS = ("FX", "FY", "FZ", "FXE", "FYE", "FZE", "MX", "MY", "MZ", "MXE", "MYE", "MZE")
SCALES = ("LE", "FR", "LEPR", "FRPR")  # X in units of length or as a fraction; PR: per projected length
PROJECTED = "PR"


class Line(NamedTuple):
    """The axis of a beam in units of the deck: grids at its ends, arms from these to the axis, span, rows x, y, z."""

    grids: list[int]
    arms: np.ndarray
    span: np.ndarray
    axes: np.ndarray

    @property
    def length(self) -> float:
        """Of the axis."""
        return float(np.linalg.norm(self.span))


def add_beam_load(b: Builder, card: Card, load: DeckLoad) -> None:
    """Add a PLOAD1: nodal forces and moments that do its work on the cubic deflection of the beam."""
    kind, scale = card.text(2), card.text(3)
    line = _line(b, card)
    if kind not in KINDS or scale not in SCALES:
        raise card.error(f"type {kind!r} with {scale!r} is not one of {', '.join(KINDS)} with {', '.join(SCALES)}")
    direction = (line.axes if kind.endswith("E") else np.eye(3))["XYZ".index(kind[1])]
    unit = line.length if scale.startswith("LE") else 1.0
    s, values = _points(card, line.length, unit)
    if len(s) > 1 and scale.endswith(PROJECTED):
        values = values * _projection(card, kind, line)
    vectors = values[:, None] * direction
    load.terms += _nodal(line, s, vectors, kind[0] == "M")


def _line(b: Builder, card: Card) -> Line:
    """Return the axis of the beam that a card names."""
    own = [one for one in b.places.get(card.integer(1, "EID", lowest=1), []) if one[1] == "line"]
    if not own:
        raise card.error(f"element {card.text(1)} is no bar and no beam of the deck")
    group, kind, row = own[0]
    grids = list(b.cells[kind][row])
    arms = b.data.get(("ends", kind), {}).get(row, np.zeros((2, 3))) / b.units.length
    span = np.subtract(*(b.places_of(grids, b.grids.points) + arms)[::-1])
    x = span / np.linalg.norm(span)
    up = b.data.get(("up", kind), {}).get(row)
    if up is None:
        up = np.eye(3)[np.argmin(np.abs(x))]  # a rod or spring, which has no axes across
        if card.text(2)[1:] in ("YE", "ZE"):
            raise card.error(f"element {card.text(1)} has no axes across its length; give the load along basic axes")
    z = np.cross(x, up)
    z /= np.linalg.norm(z)
    y = np.cross(z, x)
    angle = b.twist.get(group, 0.0)  # from y of the element to the principal axis, along which `up` points
    c, s = np.cos(angle), np.sin(angle)
    return Line(grids, arms, span, np.array([x, c * y - s * z, s * y + c * z]))


def _points(card: Card, length: float, unit: float) -> tuple[np.ndarray, np.ndarray]:
    """Return fractions (k,) of the length, and the values of the load there; a distributed load times its weights."""
    first, start = card.real(4, "X1") / unit, card.real(5, "P1", 0.0)
    last = card.real(6, "X2", first * unit) / unit
    if not 0 <= first <= last <= 1 + 1e-6:
        raise card.error(f"X1 = {card.text(4)} and X2 = {card.text(6)} do not lie on the beam one after the other")
    if last == first:
        return np.array([first]), np.array([start])
    end = card.real(7, "P2")
    x, weight = np.polynomial.legendre.leggauss(4)
    along = (x + 1) / 2
    values = (start + (end - start) * along) * weight / 2 * (last - first) * length
    return first + (last - first) * along, values


def _projection(card: Card, kind: str, line: Line) -> float:
    """Return the projected length of the beam across the load, over its length."""
    if kind not in ("FX", "FY", "FZ"):
        raise card.error(f"a projected load ({card.text(3)}) of type {kind} is not read; give it with LE or FR")
    return float(np.sqrt(1 - line.axes[0]["XYZ".index(kind[1])] ** 2))


def _nodal(line: Line, s: np.ndarray, vectors: np.ndarray, moments: bool) -> Iterator[tuple[int, int, float]]:
    """Yield the loads of the grids of forces or moments ``(k, 3)`` at the fractions ``s (k,)`` of the axis."""
    ends = _of_moments(line, s, vectors) if moments else _of_forces(line, s, vectors)
    for grid, arm, (force, moment) in zip(line.grids, line.arms, ends, strict=True):
        values = np.concatenate([force, moment + np.cross(arm, force)])
        yield from ((int(grid), c, float(value)) for c, value in enumerate(values))


def _of_forces(line: Line, s: np.ndarray, forces: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return force and moment at each end of the axis: linear along it, cubic across."""
    e = line.axes[0]
    along = np.outer(forces @ e, e)
    across = forces - along
    turned = np.cross(line.span, across)
    cubic = s**2 * (3 - 2 * s)
    first = (1 - s) @ along + (1 - cubic) @ across, (s * (1 - s) ** 2) @ turned
    last = s @ along + cubic @ across, (-(s**2) * (1 - s)) @ turned
    return [first, last]


def _of_moments(line: Line, s: np.ndarray, moments: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return force and moment at each end of the axis: twist is linear, slopes are those of the cubic deflection."""
    e = line.axes[0]
    along = np.outer(moments @ e, e)
    couple = np.cross(moments, e) / line.length  # works on the derivative of the deflection by s
    turned = np.cross(line.span, couple)
    slope = 6 * s * (1 - s)
    first = -slope @ couple, (1 - s) @ along + ((1 - s) * (1 - 3 * s)) @ turned
    last = slope @ couple, s @ along + (s * (3 * s - 2)) @ turned
    return [first, last]
