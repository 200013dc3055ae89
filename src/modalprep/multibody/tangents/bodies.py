"""The inertia forces of a body and their derivatives in closed form (theory 5.8)."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.mass import AffinePart, Deflected, affine_part, assembled, cross_moment, rest_coordinates
from modalprep.multibody.tangents.displacement import displacement
from modalprep.vectors import skew

AXES = skew(np.eye(3))  # (3, 3, 3) e_k~


class BodyForce(NamedTuple):
    """Inertia and internal forces (6 + n,) of a body, the mass matrix, and derivatives by its own motion.

    `by_spin` is at a constant acceleration of the origin.
    """

    force: np.ndarray
    mass: np.ndarray  # (6 + n, 6 + n)
    by_spin: np.ndarray  # (6 + n, 3)
    by_q: np.ndarray  # (6 + n, n)
    by_qd: np.ndarray  # (6 + n, n)


def body_force(body: FlexibleBody, w: np.ndarray, A: np.ndarray, motion: tuple) -> BodyForce:
    """Return the forces of a body whose origin accelerates by ``A (6,)``, with q, q' and q''.

    Parameters
    ----------
    w : (3,)
        Angular velocity, axes of the body as A: m/s^2 less gravity, rad/s^2.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> rest = np.zeros(2)
    >>> found = body_force(uniform_beam(modes=2), np.zeros(3), np.array([0, 1.0, 0, 0, 0, 0]), (rest, rest, rest))
    >>> found.force[:6].round(9)
    array([ 0., 12.,  0.,  0.,  0., 60.])
    """
    return _flexible(body, w, A, motion) if body.n else _rigid(body, w, A)


def _rigid(body: FlexibleBody, w: np.ndarray, A: np.ndarray) -> BodyForce:
    s, J = body.s0, np.trace(body.E0) * np.eye(3) - body.E0
    mass = np.block([[body.m * np.eye(3), -skew(s)], [skew(s), J]])
    W = skew(w)
    force = mass @ A + np.concatenate([W @ W @ s, W @ J @ w])
    by_spin = np.vstack([-skew(W @ s) - W @ skew(s), W @ J - skew(J @ w)])
    return BodyForce(force, mass, by_spin, np.zeros((6, 0)), np.zeros((6, 0)))


@lru_cache(maxsize=256)  # bodies compare by identity
def _part(body: FlexibleBody) -> AffinePart:
    return affine_part(body)


def _flexible(body: FlexibleBody, w: np.ndarray, A: np.ndarray, motion: tuple) -> BodyForce:
    part = _part(body)
    field = A[:3], skew(A[3:]) + skew(w) @ skew(w), skew(w)
    affine, rest = _affine(part, field, motion), _rest(part, field, motion)
    force = affine.force + rest.force
    force[6:] += body.K * motion[0] + body.D * motion[1]
    by_q, by_qd = affine.by_q + rest.by_q, affine.by_qd + rest.by_qd
    by_q[6:] += np.diag(body.K)
    by_qd[6:] += np.diag(body.D)
    return BodyForce(force, affine.mass + rest.mass, affine.by_spin + rest.by_spin, by_q, by_qd)


def field_slopes(body: FlexibleBody, g: np.ndarray, gradient: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Return the derivative by q (6 + n, n) of the force of a field that is ``g + gradient x`` on a particle at x.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> body = uniform_beam(modes=1)
    >>> found = field_slopes(body, np.zeros(3), -np.eye(3), np.zeros(1))
    >>> bool(np.allclose(found[:3, 0], -body.S[:, 0]))
    True
    """
    part, field, none = _part(body), (g, gradient, np.zeros((3, 3))), np.zeros(len(q))
    return _affine(part, field, (q, none, none)).by_q + _rest(part, field, (q, none, none)).by_q


def _affine(part: AffinePart, field: tuple, motion: tuple) -> BodyForce:
    """Return what the particles ``p_r(q)`` of the affine part do.

    A particle at x in the body accelerates by ``a + S x + 2 W x' + x''``; the field is a, S, W.
    """
    n = part.B.shape[2]
    moved = displacement(part.B.reshape(12, n), part.Kg_p.reshape(12, n, n), part.strain.ravel(), motion)
    p, pd = part.p0 + moved.p.reshape(3, 4), moved.rate.reshape(3, 4)
    dp = moved.dp.reshape(3, 4, n)
    a, S, W = field
    rate_q, turned = moved.rate_q.reshape(3, 4 * n), moved.dp.reshape(3, 4 * n)
    acc = S @ p + 2 * W @ pd + moved.acceleration.reshape(3, 4)
    acc[:, 0] += part.root_mass * a
    acc_q = (S @ turned + 2 * W @ rate_q).reshape(12, n) + moved.acceleration_q
    acc_qd = 2 * (W @ turned).reshape(12, n) + moved.acceleration_qd
    acc_w = np.stack([-skew(W @ x) - W @ skew(x) - 2 * skew(v) for x, v in zip(p.T, pd.T, strict=True)], 1)
    acc_w = acc_w.reshape(12, 3)
    onto = np.vstack([np.zeros((3, 12)), np.stack([skew(x) for x in p.T], 2).reshape(3, 12), moved.dp.T])
    onto[[0, 1, 2], [0, 4, 8]] = part.root_mass
    by_q = onto @ acc_q
    by_q[3:6] -= np.einsum("rac,crn->an", np.stack([skew(x) for x in acc.T]), dp)
    by_q[6:] += moved.curvature(acc.ravel())
    at = np.zeros((n, n))
    moments = Deflected(p, dp, part.root_mass * p[:, 0], p @ p.T, part.root_mass * dp[:, 0], *_products(p, dp), at, at)
    mass = assembled(part.root_mass**2, moments)
    return BodyForce(onto @ acc.ravel(), mass, onto @ acc_w, by_q, onto @ acc_qd)


def _products(p: np.ndarray, dp: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return ``dp_a.p_b (3, 3, n)`` and ``dp.dp (n, n)``."""
    flat = dp.reshape(12, -1)
    return np.einsum("arn,br->abn", dp, p), flat.T @ flat


def _rest(part: AffinePart, field: tuple, motion: tuple) -> BodyForce:
    """Return what the rest of the motion, ``phi' eta(q)``, does; arguments as `_affine`."""
    q, qd, qdd = motion
    n = len(q)
    eta, slope = rest_coordinates(part, q)
    growing, rising = (part.c @ qd, part.c @ qdd) if part.c.size else np.zeros((2, n, n))
    etad, etadd = slope @ qd, slope @ qdd + growing @ qd
    _, S, W = field
    P = part.P_rest
    Pe, Pd, Pdd = P @ eta, P @ etad, P @ etadd  # (3, 3, n)
    by_eta, by_etad = (np.tensordot(X, P, 2) for X in (S, 2 * W))  # (n, n)
    modal = by_eta @ eta + by_etad @ etad + part.M_rest @ etadd
    X, Xd, Xdd = Pe @ eta, Pe @ etad, Pe @ etadd  # int x'_a x_b, its rates by the first
    torque = cross_moment(S @ X + 2 * W @ Xd + Xdd)
    flip = Pe.transpose(1, 0, 2)
    across = np.tensordot(S, Pe + flip, 1) + np.tensordot(2 * W, Pd.transpose(1, 0, 2), 1) + Pdd.transpose(1, 0, 2)
    T_eta, T_etad, T_etadd = map(cross_moment, (across, np.tensordot(2 * W, Pe, 1), Pe))
    onto_q = slope.T
    by_q = np.zeros((6 + n, n))
    by_qd = np.zeros((6 + n, n))
    by_q[3:6] = T_eta @ slope + T_etad @ growing + T_etadd @ rising
    by_qd[3:6] = T_etad @ slope + 2 * T_etadd @ growing
    by_q[6:] = onto_q @ (by_eta @ slope + by_etad @ growing + part.M_rest @ rising)
    by_qd[6:] = onto_q @ (by_etad @ slope + 2 * part.M_rest @ growing)
    if part.c.size:
        by_q[6:] += np.tensordot(modal, part.c, 1)
    by_spin = np.zeros((6 + n, 3))
    for k, axis in enumerate(AXES):
        turning = axis @ W + W @ axis
        by_spin[3:6, k] = cross_moment(turning @ X + 2 * axis @ Xd)
        by_spin[6:, k] = onto_q @ (np.tensordot(turning, Pe, 2) + 2 * np.tensordot(axis, Pd, 2))
    force = np.concatenate([np.zeros(3), torque, onto_q @ modal])
    return BodyForce(force, _rest_mass(part, X, Pe, slope), by_spin, by_q, by_qd)


def _rest_mass(part: AffinePart, E: np.ndarray, Pe: np.ndarray, slope: np.ndarray) -> np.ndarray:
    none = np.zeros((3, len(slope)))
    L, M_ff = Pe @ slope, slope.T @ part.M_rest @ slope
    return assembled(0.0, Deflected(none, none, np.zeros(3), E, none, L, M_ff, none, none))
