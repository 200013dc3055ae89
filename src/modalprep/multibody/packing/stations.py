"""Pack the stations of bodies for the kernels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.stations.second_order import StationBody, station_body
from modalprep.multibody.kernels.stations.data import Parts, empty_parts, no_parts

UPPER = np.triu_indices(3)


def packed_parts(
    bodies: Sequence[tuple[FlexibleBody, np.ndarray]], first: Mapping[int, int], interfaces: int, N: int
) -> Parts:
    """Return the constants of the stations of flexible bodies, each with the rotation of its axes from the link's.

    `first` has the first interface of each body, by its number.

    Examples
    --------
    >>> from modalprep.examples import large_cantilever
    >>> packed_parts([(large_cantilever(modes=2, stations=4), np.eye(3))], {0: 0}, 2, 12).moved.shape
    (4, 6, 12)
    """
    counts = [len(body.stations) if body.stations else 0 for body, _ in bodies]
    if not any(counts):
        return no_parts(len(bodies), interfaces)
    found = empty_parts(len(bodies), interfaces, sum(counts), N)
    found.number[:] = counts
    found.first[:] = np.cumsum(counts) - counts
    for k, (body, Q) in enumerate(bodies):
        if body.stations:
            _fill(found, k, station_body(body), first[k], Q)
    return found


def _fill(found: Parts, k: int, at: StationBody, interface: int, Q: np.ndarray) -> None:
    """Write the constants of body k, its axes turned by Q."""
    n, parts = at.H_rest.shape[2], len(at.stations)
    some = slice(int(found.first[k]), int(found.first[k]) + parts)
    nodes = slice(interface, interface + len(at.chain.parent) - parts)
    moved = np.concatenate([Q.T @ at.chain.rho_q, Q.T @ at.chain.th_q], axis=1)
    rows = found.parts[some]
    rows["parent"], rows["d"] = at.chain.parent[:parts], at.chain.d[:parts] @ Q
    rows["mass"], rows["by_mass"] = at.stations.m, at.by_mass
    rows["J"] = (Q.T @ at.stations.J @ Q)[:, UPPER[0], UPPER[1]]
    rows["by_turn"].reshape(parts, 3, 4)[:, :, 1:] = (at.by_turn @ Q).swapaxes(1, 2)
    found.moved[some, :, :n] = moved[:parts]
    found.H_rest[k, :9, :n] = np.einsum("abn,ac,bd->cdn", at.H_rest, Q, Q).reshape(9, n)
    leaves = found.leaves[nodes]
    leaves["parent"], leaves["d"] = at.chain.parent[parts:], at.chain.d[parts:] @ Q
    found.leaf_moved[nodes, :, :n] = moved[parts:]
    found.strain[nodes, :n, :n] = at.strain
