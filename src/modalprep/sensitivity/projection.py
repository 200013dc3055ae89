"""The projection of a state onto closed loops after a step, as a linear map of changes."""

from __future__ import annotations

import numpy as np

from modalprep.sensitivity.local import Local


class Projection:
    """Changes of a state brought onto closed loops, by the least kinetic energy; without loops the identity.

    A state that was closed with other parameters, or by a step with its error, is brought onto the loops in the metric
    of the mass matrix: ``dx - B (G dx + Phi_p)`` with ``B = M^-1 G' (G M^-1 G')^-1``, speeds likewise with the
    derivatives of the rates.
    """

    def __init__(self, local: Local) -> None:
        self.local = local
        if local.rows is None:
            return
        model, rows = local.model, local.rows
        self.G, self.rate_x = rows.slopes.G, rows.slopes.rate_x
        _, self.B = local.mobility
        self.increments = local.kinematics.increments
        self.directions = model.layout.directions(local.y)
        self.gap_p, self.rate_p = local.gap_slopes()

    def forward(self, dy: np.ndarray) -> np.ndarray:
        """Return the change (ny, np) of the closed state."""
        return dy if self.local.rows is None else self._closed(dy, self.gap_p, self.rate_p)

    def tangent(self, dy: np.ndarray) -> np.ndarray:
        """Return changes (ny, k) without what opens the loops, the parameters given."""
        none = np.zeros((1, 1))
        return dy if self.local.rows is None else self._closed(dy, none, none)

    @property
    def shift(self) -> np.ndarray:
        """The change (ny, np) of the closed state by the parameters, the state before given."""
        shape = len(self.local.y), len(self.local.model.parameters)
        return self.forward(np.zeros(shape))

    def _closed(self, dy: np.ndarray, gap: np.ndarray, rate: np.ndarray) -> np.ndarray:
        nx = self.local.model.nx
        turned = self.increments @ dy[:nx]
        move = -self.B @ (self.G @ turned + gap)
        u = dy[nx:] - self.B @ (self.G @ dy[nx:] + self.rate_x @ (turned + move) + rate)
        return np.vstack([dy[:nx] + self.directions @ move, u])

    def reverse(self, bar: np.ndarray, bar_p: np.ndarray) -> np.ndarray:
        """Return the gradient (ny,) by the state before; that by the parameters is added."""
        if self.local.rows is None:
            return bar
        nx = self.local.model.nx
        push = self.B.T @ bar[nx:]
        turned = -self.rate_x.T @ push
        move = self.B.T @ (self.directions.T @ bar[:nx] + turned)
        bar_p -= self.rate_p.T @ push + self.gap_p.T @ move
        x = bar[:nx] + self.increments.T @ (turned - self.G.T @ move)
        return np.concatenate([x, bar[nx:] - self.G.T @ push])
