"""The reference implementation of a body with stations: its parts as rigid bodies, and the rest (theory 4.10)."""

from __future__ import annotations

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.mass import assembled, deflected, partial_rates
from modalprep.body.stations.motion import Frames, accelerations, frames
from modalprep.body.stations.second_order import StationBody, station_body
from modalprep.body.stations.shape import leaf_motion, with_stations
from modalprep.vectors import cross, skew


def station_equations(
    body: FlexibleBody, V: np.ndarray, q: np.ndarray, qd: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the mass matrix (6 + n, 6 + n) and bias (6 + n,) of a body with stations.

    Examples
    --------
    >>> from modalprep.examples import large_cantilever
    >>> body = large_cantilever(modes=2, stations=4)
    >>> M, b = station_equations(body, np.zeros(6), np.zeros(body.n), np.zeros(body.n))
    >>> round(float(M[0, 0]), 9), float(abs(b).max())
    (12.0, 0.0)
    """
    at = station_body(body)
    moved = frames(at.chain, q)
    M = assembled(body.m, with_stations(at, moved, q))
    bias = _parts_bias(at, moved, V[3:], q, qd) + _rest_bias(at, moved, V[3:], q, qd)
    bias[6:] += body.K * q + body.damping_matrix @ qd
    return M, bias


def _parts_bias(at: StationBody, moved: Frames, w: np.ndarray, q: np.ndarray, qd: np.ndarray) -> np.ndarray:
    """Return the forces that the parts need as rigid bodies where A, alpha and q'' are zero."""
    linear, angular = accelerations(at.chain, moved, q, qd)
    bias = np.zeros(6 + len(q))
    for p, (m, J) in enumerate(zip(at.stations.m, at.stations.J, strict=True)):
        r, R, Jr, Jw = (x[p] for x in moved)
        spin = w + Jw @ qd
        inertia = R @ J @ R.T
        force = m * (linear[p] + cross(w, cross(w, r) + 2 * (Jr @ qd)))
        torque = inertia @ (angular[p] + cross(w, Jw @ qd)) + cross(spin, inertia @ spin)
        bias += np.concatenate([force, cross(r, force) + torque, Jr.T @ force + Jw.T @ torque])
    return bias


def _rest_bias(at: StationBody, moved: Frames, w: np.ndarray, q: np.ndarray, qd: np.ndarray) -> np.ndarray:
    """Return the forces of the affine second order beyond the parts, with them, and those of the rest of the modes."""
    spin = skew(w)
    W2 = spin @ spin
    more = deflected(at.affine, q)
    linear, angular = accelerations(at.chain, moved, q, qd)
    p, dp, pd, pdd = affine_of_parts(at, moved, linear, angular, qd)
    own = W2 @ p + 2 * spin @ pd + pdd
    Omega = W2 @ more.p + 2 * spin @ (more.dp @ qd) + partial_rates(at.affine, q, qd) @ qd
    force = at.affine.root_mass * Omega[:, 0]
    torque = np.cross(p + more.p, Omega, axis=0).sum(axis=1) + np.cross(more.p, own, axis=0).sum(axis=1)
    modal = np.einsum("ar,arn->n", Omega, dp + more.dp) + np.einsum("ar,arn->n", own, more.dp)
    L = at.H_rest + at.affine.P_rest @ q
    E = L @ q + (at.H_rest @ q).T
    Y = L @ qd
    torque += cross(w, np.trace(E) * w - E @ w) + 2 * (np.trace(Y) * w - Y @ w)
    modal += np.einsum("ab,abn->n", W2, L) + 2 * np.einsum("ab,abn->n", spin, at.affine.P_rest @ qd)
    return np.concatenate([force, torque, modal])


def affine_of_parts(
    at: StationBody, moved: Frames, linear: np.ndarray, angular: np.ndarray, qd: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return what the parts move in the body's affine functions: p (3, 4), dp (3, 4, n), rate, acceleration."""
    N = len(at.stations)
    R, Jw = moved.R[:N], moved.Jw[:N]
    arm = np.einsum("pab,prb->pra", R, at.by_turn)
    speed, spin = moved.Jr[:N] @ qd, Jw @ qd
    p = np.einsum("pr,pa->ar", at.by_mass, moved.r[:N])
    dp = np.einsum("pr,pan->arn", at.by_mass, moved.Jr[:N])
    pd = np.einsum("pr,pa->ar", at.by_mass, speed)
    pdd = np.einsum("pr,pa->ar", at.by_mass, linear[:N])
    p[:, 1:] += arm.sum(axis=0).T
    turn = np.cross(Jw.transpose(0, 2, 1)[:, None], arm[:, :, None])  # (N, r, n, a)
    dp[:, 1:] += turn.sum(axis=0).transpose(2, 0, 1)
    rate = np.cross(spin[:, None], arm)
    pd[:, 1:] += rate.sum(axis=0).T
    bulge = np.cross(angular[:N, None], arm) + np.cross(spin[:, None], rate)
    pdd[:, 1:] += bulge.sum(axis=0).T
    return p, dp, pd, pdd


def station_node(body: FlexibleBody, k: int, w: np.ndarray, q: np.ndarray, qd: np.ndarray):
    """Return the motion of interface k of a body with stations, as `equations.node_motion`."""
    at = station_body(body)
    moved = frames(at.chain, q)
    linear, angular = accelerations(at.chain, moved, q, qd)
    leaf = len(at.stations) + k
    r, R, Phi, acc = leaf_motion(at, moved, k, linear[leaf], angular[leaf], q, qd)
    vel = Phi @ qd
    acc[:3] += cross(w, cross(w, r)) + 2 * cross(w, vel[:3])
    acc[3:] += cross(w, vel[3:])
    return r, R, Phi, vel, acc
