"""What error the stations of a body leave at a deflection (theory 4.10)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.mass import affine_part, deflected
from modalprep.body.stations.motion import Chain, chain, chain_outside, frames
from modalprep.body.stations.record import Stations
from modalprep.body.stations.second_order import station_body
from modalprep.body.stations.shape import beyond, station_points, with_stations

LOOKED_AT = 2000  # nodes of large meshes
REACH = 0.4  # of the size of a body: a large deflection
TRIES = 12  # each halves what is left of the difference, or better
SMALL = 1e-6


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


class Errors(NamedTuple):
    """Estimated errors (k,) of the farthest place at k deflections, m.

    Attributes
    ----------
    spacing : (k,)
        Of the distance between the stations: a third of what half of them differ by, as it is of second order.
    basis : (k,)
        Of the derivatives that the basis leaves out; 0 where they are not known.
    """

    spacing: np.ndarray
    basis: np.ndarray

    @property
    def both(self) -> np.ndarray:
        """The root of the sum of squares."""
        return np.hypot(self.spacing, self.basis)


def station_errors(body: FlexibleBody, q: np.ndarray) -> Errors:
    """Return the estimated errors of the stations at deflections ``q (k, n)``.

    Examples
    --------
    >>> from modalprep.examples import large_cantilever
    >>> body = large_cantilever(modes=2, stations=4)
    >>> station_errors(body, np.zeros((1, body.n))).both
    array([0.])
    """
    assert body.stations is not None
    half = body.with_(stations=halved(body.stations))
    nodes = _some(body.stations.part)
    gap = np.linalg.norm(station_points(half, q, nodes) - station_points(body, q, nodes), axis=2)
    return Errors(gap.max(axis=1) / 3, _outside(body, q))


def station_error(body: FlexibleBody, q: np.ndarray) -> np.ndarray:
    """Return the estimated error (k,) of the farthest place at deflections ``q (k, n)``, m: `Errors.both`.

    Parameters
    ----------
    body : FlexibleBody
        With stations.
    q : (k, n)
        Modal coordinates.

    Returns
    -------
    (k,)
        Of the kinematics and of the second order of the basis, not of the modes beyond that or of the mesh.

    References
    ----------
    Theory 4.10.

    Examples
    --------
    >>> from modalprep.examples import large_cantilever
    >>> body = large_cantilever(modes=2, stations=4)
    >>> station_error(body, np.zeros((1, body.n)))
    array([0.])
    """
    return station_errors(body, q).both


def _some(part: np.ndarray) -> np.ndarray:
    """Return nodes of the parts, evenly chosen: errors vary as slowly as the parts do."""
    owned = np.flatnonzero(part >= 0)
    return owned[:: max(1, len(owned) // LOOKED_AT)]


def _outside(body: FlexibleBody, q: np.ndarray) -> np.ndarray:
    """Return how far the derivatives outside the basis would move the farthest part or interface (k,)."""
    stations = body.stations
    if stations is None or stations.outside is None or not len(stations.outside.products):
        return np.zeros(len(q))
    own = chain(stations, body.interface_position, body.phi, body.psi)
    more = chain_outside(stations, body.interface_position)
    both = Chain(own.parent, own.d, *(np.concatenate(x, axis=2) for x in zip(own[2:], more[2:], strict=True)))
    softest = q @ stations.outside.shapes.T
    amounts = np.einsum("ti,rij,tj->tr", softest, stations.outside.products, softest)
    found = np.empty(len(q))
    for t, (each, amount) in enumerate(zip(q, amounts, strict=True)):
        off = frames(both, np.append(each, amount)).r - frames(own, each).r
        found[t] = np.linalg.norm(off, axis=1).max()
    return found


def errors_at(body: FlexibleBody, reach: float = REACH) -> Errors:
    """Return the estimated errors, over its size, of a body that bends by `reach` of it: the largest of two shapes.

    The softest mode, and the two softest at once with equal energies.

    Examples
    --------
    >>> from modalprep.examples import large_cantilever
    >>> found = errors_at(large_cantilever(modes=2, stations=8), 0.4)
    >>> bool(1e-4 < found.spacing[0] < 4e-4)  # of the elastica 3e-4
    True
    """
    softest = np.flatnonzero(body.K > 0)[:2]
    shapes = np.eye(body.n)[softest] / np.sqrt(body.K[softest, None])
    q = np.array([_bent_by(body, each, reach) for each in (shapes[0], shapes.sum(axis=0))])
    found = station_errors(body, q)
    return Errors(*(x.max(keepdims=True) / size_of(body) for x in found))


def gap_of_modes(body: FlexibleBody, q: np.ndarray) -> np.ndarray:
    """Return how far (k,) the modes alone move interfaces and centre of mass from where stations do at ``q (k, n)``, m.

    Examples
    --------
    >>> from modalprep.examples import large_cantilever
    >>> body = large_cantilever(modes=2, stations=4)
    >>> gap_of_modes(body, np.zeros((1, body.n))).round(12)
    array([0.])
    """
    at = station_body(body)
    whole = affine_part(body)
    found = np.empty(len(q))
    for k, each in enumerate(q):
        moved = frames(at.chain, each)
        off = [with_stations(at, moved, each).s - deflected(whole, each).s]
        for i in range(1, len(body.interface_name)):
            alone = body.interface_position[i] + body.phi[i] @ each + beyond(body.Kg_F[i], at.strain[i], each, each)[0]
            far = moved.r[len(at.stations) + i] + beyond(at.Kg_F[i], at.strain[i], each, each)[0]
            off.append(body.m * (far - alone))
        found[k] = np.linalg.norm(off, axis=1).max() / body.m
    return found


def size_of(body: FlexibleBody) -> float:
    """Return the largest extent of a body along its axes, m."""
    return float(np.ptp(np.concatenate([body.points, body.interface_position]), axis=0).max())


def _bent_by(body: FlexibleBody, shape: np.ndarray, reach: float) -> np.ndarray:
    """Return the multiple of a shape (n,) that moves the farthest part by a share of the body's size."""
    wanted = reach * size_of(body)
    q = shape * wanted / _moved(body, shape * SMALL) * SMALL
    for _ in range(TRIES):
        q = q * wanted / _moved(body, q)
    return q


def _moved(body: FlexibleBody, q: np.ndarray) -> float:
    """Return how far the farthest part or interface moves."""
    stations = body.stations
    assert stations is not None
    link = chain(stations, body.interface_position, body.phi, body.psi)
    rest = np.concatenate([stations.centre, body.interface_position])
    return float(np.linalg.norm(frames(link, q).r - rest, axis=1).max())
