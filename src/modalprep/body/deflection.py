"""Places of the mesh nodes and mass matrix of a deflected body: of any body."""

from __future__ import annotations

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.mass import assembled, deflected_points, mass_matrix
from modalprep.body.stations.motion import frames
from modalprep.body.stations.second_order import station_body
from modalprep.body.stations.shape import station_points, with_stations


def mesh_at(body: FlexibleBody, q: np.ndarray) -> np.ndarray:
    """Return where the body's `points` are at each of the modal coordinates ``q (k, n)``: ``(k, n_points, 3)``, m.

    In the body's frame, as the equations of motion move them: by the stations of a body that has them, else by the
    second order of its modes (`mass.deflected_points`).

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> bool(np.allclose(mesh_at(uniform_beam(modes=1), np.zeros((1, 1)))[0, -1], [10, 0, 0]))
    True
    """
    return station_points(body, q) if body.stations else deflected_points(body, q)


def mass_at(body: FlexibleBody, q: np.ndarray) -> np.ndarray:
    """Return the mass matrix ``(6 + n, 6 + n)`` at modal coordinates ``q (n,)``, as `mass_matrix`, also with stations.

    Examples
    --------
    >>> from modalprep.examples import large_cantilever
    >>> mass_at(large_cantilever(modes=2, stations=4), np.ones(10))[:1, :1].round(9)
    array([[12.]])
    """
    if body.stations is None:
        return mass_matrix(body, q)
    at = station_body(body)
    return assembled(body.m, with_stations(at, frames(at.chain, q), q))
