"""Components of a node in any axes: which of its DOFs depend on the others and on the motion that it follows."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

ALIGNED = 1e-9  # of direction cosines


class Rows(NamedTuple):
    """Dependent DOFs ``(d,)``, and the entries (DOF, source, coefficient) of the rows that express them by others."""

    dependent: np.ndarray
    row: np.ndarray
    source: np.ndarray
    value: np.ndarray

    @classmethod
    def dense(cls, dependent: np.ndarray, sources: np.ndarray, coefficients: np.ndarray) -> Rows:
        """Return the rows of ``coefficients (d, s)`` on sources ``(s,)``, or on sources ``(d, s)`` of each row."""
        sources = np.broadcast_to(sources, coefficients.shape)
        return cls(dependent, np.repeat(dependent, sources.shape[1]), sources.ravel(), coefficients.ravel())

    @classmethod
    def joined(cls, parts: list[Rows]) -> Rows:
        """Return all rows."""
        none = np.zeros(0, dtype=int)
        return cls(*(np.concatenate(values) for values in zip((none, none, none, np.zeros(0)), *parts, strict=True)))

    def with_more(self, other: Rows) -> Rows:
        """Return the rows with further entries of the same dependent DOFs."""
        return Rows.joined([self, other])._replace(dependent=self.dependent)


class Followed(NamedTuple):
    """Components of a node in oblique axes that follow a motion of six: ``u[place] = motion W^T + own V^T``.

    ``place (m,)`` among the six DOFs of the node, ``W (m, 6)`` on the motion, ``V (m, 6)`` on the node's other DOFs.
    """

    place: np.ndarray
    W: np.ndarray
    V: np.ndarray

    def of(self, motion: np.ndarray, own: np.ndarray) -> np.ndarray:
        """Return the dependent ones ``(m,)`` for the motion (6,) and the node's own DOFs (6,)."""
        return self.W @ motion + self.V @ own


def followed_components(components: np.ndarray, axes: np.ndarray) -> Followed:
    """Return how the components ``(6,)`` of a node along the rows of ``axes (3, 3)`` follow a motion.

    Of each partly held triple those mesh directions depend that its axes define best.

    Examples
    --------
    >>> c = np.sqrt(0.5)
    >>> slope = np.array([[c, c, 0], [-c, c, 0], [0, 0, 1]])
    >>> wall = followed_components(np.array([1, 0, 0, 0, 0, 0], dtype=bool), slope)  # ux + uy follows
    >>> wall.place.tolist(), wall.W[0, :3].round(12), wall.V[0, :3].round(12)
    ([0], array([1., 1., 0.]), array([ 0., -1.,  0.]))
    """
    place, W, V = [], [], []
    for first in (0, 3):
        held = axes[components[first : first + 3]]
        if not len(held):
            continue
        chosen = _best(held)
        inverse = np.linalg.inv(held[:, chosen])
        whole, own = np.zeros((len(held), 6)), np.zeros((len(held), 6))
        whole[:, first : first + 3] = inverse @ held
        own[:, first : first + 3] = -inverse @ held
        own[:, first + chosen] = 0.0
        place.append(first + chosen)
        W.append(whole)
        V.append(own)
    return Followed(np.concatenate(place), np.concatenate(W), np.concatenate(V))


def oblique(components: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Whether each node ``(k,)`` holds only a part of a triple of components ``(k, 6)``, along axes not the mesh's."""
    if not len(axes):
        return np.zeros(len(components), dtype=bool)
    turned = np.any(np.abs(axes - np.eye(3)) > ALIGNED, axis=(1, 2))
    parts = np.reshape(components, (-1, 2, 3))
    return turned & np.any(parts.any(axis=2) & ~parts.all(axis=2), axis=1)


def _best(fixed: np.ndarray) -> np.ndarray:
    """Columns that determine the rows ``(m, 3)`` best: QR with pivoting."""
    from scipy.linalg import qr

    return np.sort(qr(fixed, mode="r", pivoting=True)[1][: len(fixed)])
