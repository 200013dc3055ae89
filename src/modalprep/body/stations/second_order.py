"""What stations leave to the rest of a body: its modes, its mass and its second order less theirs (theory 4.10).

About rest the stations move as ``u = phi_s q + q u2_s q / 2``. What the integrals of the body have beyond them stays
where theory 4.6 has it: the second order in the affine functions of the whole body, the rest of the modes in P'.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.line import strain_arms
from modalprep.body.mass import AffinePart, affine_axes
from modalprep.body.stations.motion import Chain, chain
from modalprep.body.stations.record import Stations
from modalprep.vectors import skew

SKEW = skew(np.eye(3))  # SKEW[c, a, d] r_c x_d = (r x x)_a


class StationBody(NamedTuple):
    """A body as its stations and the rest move it.

    Attributes
    ----------
    stations : Stations
    chain : Chain
        Its frames, the interfaces last.
    affine : AffinePart
        The second order beyond the stations, and the rest of the modes: ``p0`` and ``B`` are zero.
    by_mass : (N, 4)
        ``int rho X_r`` over each part, of the affine functions X_r of the body.
    by_turn : (N, 3, 3)
        ``int rho (x - c) X_r`` of the last three of them, r first.
    H_rest : (3, 3, n)
        H less that of the stations: mean strains of the parts.
    Kg_F, Kg_T : (n_if, 3, n, n)
        Those of the body less those of the stations.
    strain : (n_if, n, n)
        ``tau = q strain q / 2``, the strain of each interface's arm (line.py) by the whole second order of the body.
    """

    stations: Stations
    chain: Chain
    affine: AffinePart
    by_mass: np.ndarray
    by_turn: np.ndarray
    H_rest: np.ndarray
    Kg_F: np.ndarray
    Kg_T: np.ndarray
    strain: np.ndarray


@lru_cache(maxsize=64)  # bodies compare by identity
def station_body(body: FlexibleBody) -> StationBody:
    """Return what a body's stations leave to the rest.

    Examples
    --------
    >>> from modalprep.examples import large_cantilever
    >>> body = large_cantilever(modes=2, stations=8)
    >>> rest = station_body(body)
    >>> from modalprep.body.mass import affine_part
    >>> bool(abs(rest.affine.Kg_p).max() < 0.2 * abs(affine_part(body).Kg_p).max())
    True
    """
    stations = body.stations
    assert stations is not None
    links = chain(stations, body.interface_position, body.phi, body.psi)
    r2, R2 = second_derivatives(links)
    N = len(stations)
    axes = affine_axes(body)
    m, c, E = stations.m, stations.centre, stations.E
    Kg_A = body.Kg_A - np.einsum("p,paij->aij", m, r2[:N])
    Kg_W = body.Kg_W - np.einsum("p,pb,paij->abij", m, c, r2[:N]) - np.einsum("padij,pdb->abij", R2[:N], E)
    P = body.P - _products(stations)
    H = (
        body.H
        - np.einsum("p,pb,pan->abn", m, c, stations.moved)
        - np.einsum("cad,pcn,pdb->abn", SKEW, stations.turned, E)
    )
    turn2 = (
        np.stack([R2[N:, 2, 1] - R2[N:, 1, 2], R2[N:, 0, 2] - R2[N:, 2, 0], R2[N:, 1, 0] - R2[N:, 0, 1]], axis=1) / 2
    )
    none = np.zeros((3, 4, body.n))
    affine = AffinePart(
        p0=np.zeros((3, 4)),
        B=none,
        Kg_p=axes.coordinates(Kg_A, Kg_W),
        P_rest=P,
        M_rest=body.modal_mass - np.einsum("aaij->ij", body.P - P),
        strain=axes.strain,
        root_mass=axes.root,
        c=np.zeros((0, 0, 0)),
    )
    turning = axes.axes.T * axes.inverse[:, None]  # slopes of the linear functions
    by_mass = m[:, None] * np.column_stack([np.full(N, 1 / axes.root), (c - axes.centre) @ turning.T])
    by_turn = np.einsum("pab,rb->pra", E, turning)
    strain = -np.einsum("ka,kaij->kij", strain_arms(body.interface_position, body.points), body.Kg_F)
    return StationBody(stations, links, affine, by_mass, by_turn, H, body.Kg_F + r2[N:], body.Kg_T + turn2, strain)


def mass_growth(body: FlexibleBody) -> np.ndarray:
    """Return the T (n, n, n) that a body of stations has: that of its parts and of its affine second order.

    Examples
    --------
    >>> from modalprep.examples import large_cantilever
    >>> mass_growth(large_cantilever(modes=2, stations=8)).shape
    (10, 10, 10)
    """
    at = station_body(body)
    N = len(at.stations)
    r2, R2 = (x[:N] for x in second_derivatives(at.chain))
    spin = np.einsum("cad,pcn->padn", SKEW, at.stations.turned)
    own = np.einsum("p,pai,pajk->ijk", at.stations.m, at.stations.moved, r2, optimize=True)
    own += np.einsum("padi,pde,paejk->ijk", spin, at.stations.E, R2, optimize=True)
    first = affine_axes(body).coordinates(body.S, body.H)
    return own + np.einsum("ari,arjk->ijk", first, at.affine.Kg_p)


def _products(stations: Stations) -> np.ndarray:
    """Return ``int rho phi_a phi_b (3, 3, n, n)`` of the rigid motion of the parts."""
    spin = np.einsum("cad,pcn->padn", SKEW, stations.turned)
    moved = np.einsum("p,pai,pbj->abij", stations.m, stations.moved, stations.moved)
    return moved + np.einsum("padi,pde,pbej->abij", spin, stations.E, spin, optimize=True)


def second_derivatives(links: Chain) -> tuple[np.ndarray, np.ndarray]:
    """Return the second derivatives at rest of the frames' places (k, 3, n, n) and rotations (k, 3, 3, n, n)."""
    k, n = len(links.parent), links.th_q.shape[2]
    r1, w1 = np.zeros((k, 3, n)), np.zeros((k, 3, n))
    r2, R2 = np.zeros((k, 3, n, n)), np.zeros((k, 3, 3, n, n))
    for p, a in enumerate(links.parent.tolist()):
        d, t, u = links.d[p], links.th_q[p], links.rho_q[p]
        T = np.einsum("cad,cn->adn", SKEW, t)
        TT = np.einsum("adi,dbj->abij", T, T)
        step1 = u - skew(d) @ t / 2
        step2 = _both(np.einsum("adi,dj->aij", T, u)) / 2 + _both(np.einsum("abij,b->aij", TT, d)) / 6
        turn2 = _both(TT) / 2
        r1[p], w1[p], r2[p], R2[p] = step1, t, step2, turn2
        if a >= 0:
            A = np.einsum("cad,cn->adn", SKEW, w1[a])
            r1[p] += r1[a] - skew(d) @ w1[a]
            w1[p] += w1[a]
            r2[p] += r2[a] + np.einsum("abij,b->aij", R2[a], d) + _both(np.einsum("adi,dj->aij", A, step1))
            R2[p] += R2[a] + _both(np.einsum("adi,dbj->abij", A, T))
    return r2, R2


def _both(x: np.ndarray) -> np.ndarray:
    """Return a form plus its transpose in the last two axes."""
    return x + x.swapaxes(-1, -2)
