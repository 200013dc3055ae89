"""Static loads of a deck while it is read: terms at nodes, and faces under pressure."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from modalprep.fe.mesh.analysis import LoadSet
from modalprep.fe.mesh.face_forces import LoadedFace, faces_load
from modalprep.fe.readers.units import Units


@dataclass
class DeckLoad:
    """One load in units of the deck: terms (node, component, value), faces, gravity; and what is not read, by place."""

    terms: list[tuple[int, int, float]] = field(default_factory=list)
    faces: list[LoadedFace] = field(default_factory=list)
    gravity: np.ndarray = field(default_factory=lambda: np.zeros(3))
    unread: list[tuple[str, str]] = field(default_factory=list)

    def add(self, other: DeckLoad, factor: float) -> None:
        """Add another load times a factor."""
        self.terms += [(node, c, factor * value) for node, c, value in other.terms]
        self.faces += [face.times(factor) for face in other.faces]
        self.gravity = self.gravity + factor * other.gravity
        self.unread += other.unread

    def in_si(self, points: np.ndarray, units: Units) -> LoadSet:
        """Return the load of nodes at ``points (n, 3)``, in units of the deck, in N and N m."""
        own = LoadSet.of_terms(self.terms)
        nodes, forces = faces_load(self.faces, points)
        values = np.vstack([np.hstack([own.forces, own.moments]), np.hstack([forces, np.zeros((len(forces), 3))])])
        unit = units.mass * units.length * np.array([1.0] * 3 + [units.length] * 3)
        return LoadSet.summed(np.concatenate([own.nodes, nodes]), values * unit)
