"""What error the stations of a body leave at a deflection (theory 4.10)."""

from __future__ import annotations

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.stations.record import Stations
from modalprep.body.stations.shape import station_points


def halved(stations: Stations) -> Stations:
    """Return stations of which every second one along each way has joined its parent.

    Examples
    --------
    >>> from modalprep.examples import large_cantilever
    >>> halved(large_cantilever(modes=2, stations=4).stations).m.round(9)
    array([6., 6.])
    """
    depth = np.zeros(len(stations), dtype=int)
    into = np.arange(len(stations))
    for p, a in enumerate(stations.parent.tolist()):
        depth[p] = depth[a] + 1 if a >= 0 else 0
        into[p] = into[a] if depth[p] % 2 else p
    kept, number = np.unique(into, return_inverse=True)
    m = np.bincount(number, stations.m)
    centre = _summed(number, stations.m[:, None] * stations.centre) / m[:, None]
    off = stations.centre - centre[number]
    parent = stations.parent[kept]
    return stations.with_(
        parent=np.where(parent >= 0, number[parent], -1),
        m=m,
        centre=centre,
        E=_summed(number, stations.E + stations.m[:, None, None] * off[:, :, None] * off[:, None]),
        S=_summed(number, stations.S),
        H=_summed(number, stations.H + stations.S[:, :, None] * off[:, None, :, None]),
        owner=_renumbered(number, stations.owner),
        part=_renumbered(number, stations.part),
    )


def _summed(number: np.ndarray, values: np.ndarray) -> np.ndarray:
    found = np.zeros((number.max() + 1, *values.shape[1:]))
    np.add.at(found, number, values)
    return found


def _renumbered(number: np.ndarray, of: np.ndarray) -> np.ndarray:
    return np.where(of >= 0, number[of], -1)


def station_error(body: FlexibleBody, q: np.ndarray) -> np.ndarray:
    """Return the estimated error (k,) of the farthest node at deflections ``q (k, n)``, m.

    A third of what it differs by with half the stations, as the error is of second order in the distance between them.
    What the modes cannot represent is not in it.

    Examples
    --------
    >>> from modalprep.examples import large_cantilever
    >>> body = large_cantilever(modes=2, stations=4)
    >>> station_error(body, np.zeros((1, body.n)))
    array([0.])
    """
    assert body.stations is not None
    half = body.with_(stations=halved(body.stations))
    return np.linalg.norm(station_points(half, q) - station_points(body, q), axis=2).max(axis=1) / 3
