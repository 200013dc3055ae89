"""Mass and places of a body with stations at a deflection (theory 4.10)."""

from __future__ import annotations

import numpy as np

from modalprep.body.line import shortening
from modalprep.body.mass import Deflected, deflected
from modalprep.body.stations.motion import Frames, frames
from modalprep.body.stations.second_order import StationBody, station_body
from modalprep.vectors import cross, skew

TYPE_CHECKING = False
if TYPE_CHECKING:
    from modalprep.body.flexible_body import FlexibleBody


def with_stations(at: StationBody, moved: Frames, q: np.ndarray) -> Deflected:
    """Return the moments of a body with stations at a deflection, as `mass.deflected` does of others.

    Examples
    --------
    >>> from modalprep.examples import large_cantilever
    >>> at = station_body(large_cantilever(modes=2, stations=4))
    >>> q = np.zeros(10)
    >>> with_stations(at, frames(at.chain, q), q).s.round(9)
    array([60.,  0.,  0.])
    """
    N = len(at.stations)
    r, R, Jr, Jw = (x[:N] for x in moved)
    m = at.stations.m
    E = R @ at.stations.E @ R.swapaxes(1, 2)
    J = R @ at.stations.J @ R.swapaxes(1, 2)
    more = deflected(at.affine, q)
    p, dp = _affine(at, moved)
    root = at.affine.root_mass
    second = np.einsum("p,pa,pb->ab", m, r, r) + E.sum(axis=0) + p @ more.p.T + more.p @ p.T + more.E
    turned = np.einsum("cad,pcn,pdb->abn", skew(np.eye(3)), Jw, E)
    L = np.einsum("p,pan,pb->abn", m, Jr, r) + turned + more.L
    L += np.einsum("arn,br->abn", dp, more.p) + np.einsum("arn,br->abn", more.dp, p)
    strain = at.H_rest @ q
    M_ff = np.einsum("p,pai,paj->ij", m, Jr, Jr, optimize=True)
    M_ff += np.einsum("pai,pab,pbj->ij", Jw, J, Jw, optimize=True)
    M_ff += np.einsum("ari,arj->ij", dp, more.dp) + np.einsum("ari,arj->ij", more.dp, dp)
    return more._replace(
        p=p + more.p,
        dp=dp + more.dp,
        s=m @ r + more.s,
        E=second + strain + strain.T,
        S=np.einsum("p,pan->an", m, Jr) + root * more.dp[:, 0],
        L=L + at.H_rest,
        M_ff=M_ff + more.M_ff,
    )


def _affine(at: StationBody, moved: Frames) -> tuple[np.ndarray, np.ndarray]:
    """Return what the parts move in the body's affine functions: p (3, 4) and dp (3, 4, n)."""
    N = len(at.stations)
    arm = np.einsum("pab,prb->pra", moved.R[:N], at.by_turn)
    p = np.einsum("pr,pa->ar", at.by_mass, moved.r[:N])
    dp = np.einsum("pr,pan->arn", at.by_mass, moved.Jr[:N])
    p[:, 1:] += arm.sum(axis=0).T
    dp[:, 1:] -= np.einsum("prab,pbn->arn", skew(arm), moved.Jw[:N])
    return p, dp


def leaf_motion(
    at: StationBody, moved: Frames, k: int, linear: np.ndarray, angular: np.ndarray, q: np.ndarray, qd: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return place, rotation, partial velocities (6, n) and acceleration (6,) without q'' of interface k.

    `linear`, `angular` (3,) are those of its frame in the chain; the second order beyond it is added in the axes of
    the body, the displacement limited by the strain of its arm as in line.py.
    """
    leaf = len(at.stations) + k
    x, slope, bulge = beyond(at.Kg_F[k], at.strain[k], q, qd)
    v = -0.5 * (at.Kg_T[k] @ q) @ q
    turn, spin_q, spinning = _turn(v, -at.Kg_T[k] @ q, -(at.Kg_T[k] @ qd) @ qd, qd)
    R = turn @ moved.R[leaf]
    own = turn @ moved.Jw[leaf]
    Phi = np.vstack([moved.Jr[leaf] + slope, spin_q + own])
    acceleration = spinning + turn @ angular + cross(spin_q @ qd, own @ qd)
    return moved.r[leaf] + x, R, Phi, np.concatenate([linear + bulge, acceleration])


def beyond(Kg: np.ndarray, strain: np.ndarray, q: np.ndarray, qd: np.ndarray):
    """Return the displacement ``g(tau) u, u = -q Kg q / 2``, its slopes (3, n) and its acceleration without q''."""
    across = -Kg @ q
    u, rate, second = across @ q / 2, across @ qd, -(Kg @ qd) @ qd
    strains = strain @ q
    tau, tau_rate, bending = float(strains @ q) / 2, strains @ qd, qd @ strain @ qd
    g, g1, g2 = shortening(tau)
    slope = g * across + np.outer(g1 * u, strains)
    bulge = g * second + bending * g1 * u + 2 * tau_rate * g1 * rate + tau_rate**2 * g2 * u
    return g * u, slope, bulge


def _turn(v: np.ndarray, slope: np.ndarray, second: np.ndarray, qd: np.ndarray):
    """Return the rotation of a vector v, its partial angular velocities (3, n), angular acceleration without q''.

    Of fourth order in v, by Cayley's map, as interfaces of other bodies turn.
    """
    scale, fold = 1 + v @ v / 12, np.outer(v, v) / 6
    x, by_v = scale * v, scale * np.eye(3) + fold
    s = 4 / (4 + x @ x)
    to_rate = s * (np.eye(3) + skew(x) / 2)
    R = np.eye(3) + s * (skew(x) + skew(x) @ skew(x) / 2)
    partial = to_rate @ by_v @ slope
    vd = slope @ qd
    xd = by_v @ vd
    xdd = (v @ vd) / 3 * vd + (vd @ vd) / 6 * v + by_v @ second
    return R, partial, to_rate @ xdd - s / 2 * (x @ xd) * (partial @ qd)


def station_points(body: FlexibleBody, q: np.ndarray, nodes: np.ndarray | None = None) -> np.ndarray:
    """Return where the mesh nodes of a body with stations are at modal coordinates ``q (k, n)``: (k, n_points, 3), m.

    Each node moves with its part, and in its axes by what the modes move it beyond the part. `nodes` are those wanted,
    all by default.

    Examples
    --------
    >>> from modalprep.examples import large_cantilever
    >>> body = large_cantilever(modes=2, stations=4)
    >>> bool(np.allclose(station_points(body, np.zeros((1, body.n)))[0], body.points))
    True
    """
    at = station_body(body)
    wanted = slice(None) if nodes is None else nodes
    points = body.points[wanted]
    part = at.stations.part[wanted]
    owned = np.flatnonzero(part >= 0)
    own = part[owned]
    arm = points[owned] - at.stations.centre[own]
    rigid = at.stations.moved[own] - skew(arm) @ at.stations.turned[own]
    rest = body.shape[wanted][owned] - rigid
    found = np.repeat(points[None], len(q), axis=0).astype(float)
    for k, each in enumerate(np.asarray(q, dtype=float)):
        moved = frames(at.chain, each)
        found[k, owned] = moved.r[own] + np.einsum("pab,pb->pa", moved.R[own], arm + rest @ each)
    return found
