"""The inertia forces of a body and their derivatives in closed form (theory 5.8)."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.mass import affine_part, rigid_mass_matrix
from modalprep.multibody.tangents.displacement import curvature, displacement
from modalprep.multibody.tangents.spatial import skewed
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


class Constants(NamedTuple):
    """A body with modes: `AffinePart` of body/mass.py with component ``4 a + r`` of axis a and function r."""

    p0: np.ndarray  # (3, 4)
    B: np.ndarray  # (12, n)
    D: np.ndarray  # (12, n, n)
    e: np.ndarray  # (12,) strain
    P: np.ndarray  # (9, n, n)
    M: np.ndarray  # (n, n)
    c: np.ndarray  # (n, n, n), empty without T
    stiffness: np.ndarray  # (n,)
    damping: np.ndarray  # (n,)
    root_mass: float


@lru_cache(maxsize=256)  # bodies compare by identity
def _constants(body: FlexibleBody) -> Constants:
    part, n = affine_part(body), body.n
    B, D = part.B.reshape(12, n), part.Kg_p.reshape(12, n, n)
    arrays = (part.p0, B, D, part.strain.ravel(), part.P_rest.reshape(9, n, n), part.M_rest, part.c)
    own = [np.array(x, dtype=float, order="C") for x in (*arrays, body.K, body.D)]
    return Constants(*own, root_mass=float(part.root_mass))


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
    return _flexible(_constants(body), w, A, *motion) if body.n else _rigid(_rigid_mass(body), w, A)


@lru_cache(maxsize=256)
def _rigid_mass(body: FlexibleBody) -> np.ndarray:
    return rigid_mass_matrix(body.m, body.s0, body.E0)


def _rigid(mass: np.ndarray, w: np.ndarray, A: np.ndarray) -> BodyForce:
    """Return `body_force` of a body without modes."""
    W, C, J = skewed(w), mass[3:, :3], mass[3:, 3:]
    Ws = -(C @ w)
    force, by_spin = mass @ A, np.empty((6, 3))
    force[:3] += W @ Ws
    force[3:] += W @ (J @ w)
    by_spin[:3], by_spin[3:] = -skewed(Ws) - W @ C, W @ J - skewed(J @ w)
    return BodyForce(force, mass, by_spin, np.zeros((6, 0)), np.zeros((6, 0)))


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
    none, constants = np.zeros(len(q)), _constants(body)
    affine = _affine(constants, g, gradient, np.zeros((3, 3)), q, none, none)
    return affine.by_q + _rest(constants, gradient, np.zeros((3, 3)), q, none, none).by_q


def _flexible(
    part: Constants, w: np.ndarray, A: np.ndarray, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray
) -> BodyForce:
    """Return `body_force` of a body with modes."""
    W = skewed(w)
    S = skewed(A[3:]) + W @ W
    affine = _affine(part, A[:3], S, W, q, qd, qdd)
    found = BodyForce(*map(np.add, affine, _rest(part, S, W, q, qd, qdd)))
    found.force[6:] += part.stiffness * q + part.damping * qd
    modes = np.arange(len(q))
    found.by_q[6 + modes, modes] += part.stiffness
    found.by_qd[6 + modes, modes] += part.damping
    return found


def _affine(
    part: Constants, a: np.ndarray, S: np.ndarray, W: np.ndarray, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray
) -> BodyForce:
    """Return what the particles ``p_r(q)`` of the affine part do.

    A particle at x in the body accelerates by ``a + S x + 2 W x' + x''``. The rows of `onto` are their partial
    velocities, so that the mass matrix is its product with itself.
    """
    n = len(q)
    moved = displacement(part.B, part.D, part.e, q, qd, qdd)
    p, pd = part.p0 + moved.p.reshape(3, 4), moved.rate.reshape(3, 4)
    acc = S @ p + 2.0 * (W @ pd) + moved.acceleration.reshape(3, 4)
    acc[:, 0] += part.root_mass * a
    turned, turning = moved.dp.reshape(3, 4 * n), moved.rate_q.reshape(3, 4 * n)
    acc_q = (S @ turned + 2.0 * (W @ turning)).reshape(12, n) + moved.acceleration_q
    acc_qd = 2.0 * (W @ turned).reshape(12, n) + moved.acceleration_qd
    Wp = W @ p
    onto, acc_w, across = np.zeros((6 + n, 12)), np.zeros((12, 3)), np.zeros((3, 12))
    for r in range(4):
        P = skewed(p[:, r])
        onto[3:6, r::4] = P
        across[:, r::4] = skewed(acc[:, r])
        acc_w[r::4] = -(W @ P) - skewed(Wp[:, r]) - 2.0 * skewed(pd[:, r])
    for c in range(3):
        onto[c, 4 * c] = part.root_mass
    onto[6:] = moved.dp.T
    by_q = onto @ acc_q
    by_q[3:6] -= across @ moved.dp
    forces = acc.reshape(12)
    by_q[6:] += curvature(moved.bent, forces)
    return BodyForce(onto @ forces, onto @ onto.T, onto @ acc_w, by_q, onto @ acc_qd)


def _moment(X: np.ndarray) -> np.ndarray:
    """Return the torque (3, k) of ``int x_b f_a`` in row ``3 a + b`` of X (9, k)."""
    return X[[7, 2, 3]] - X[[5, 6, 1]]


def _flipped(X: np.ndarray) -> np.ndarray:
    """Return rows ``3 b + a`` of X (9, k) as rows ``3 a + b``."""
    return X.reshape(3, 3, -1).swapaxes(0, 1).reshape(9, -1)


def _left(S: np.ndarray, X: np.ndarray) -> np.ndarray:
    """Return ``S_ac X_cb`` of rows ``3 c + b`` of X (9, k), in rows ``3 a + b``."""
    k = X.shape[1]
    return (S @ X.reshape(3, 3 * k)).reshape(9, k)


def _rest(part: Constants, S: np.ndarray, W: np.ndarray, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> BodyForce:
    """Return what the rest of the motion, ``phi' eta(q)``, does; arguments as `_affine`."""
    n = len(q)
    slope, growing, rising = np.eye(n), np.zeros((n, n)), np.zeros((n, n))
    eta = q.copy()
    if part.c.size > 0:
        by_rows = part.c.reshape(n * n, n)
        bent, growing, rising = ((by_rows @ z).reshape(n, n) for z in (q, qd, qdd))
        slope += bent
        eta += 0.5 * (bent @ q)
    etad, etadd = slope @ qd, slope @ qdd + growing @ qd
    rows, flat = part.P.reshape(9 * n, n), part.P.reshape(9, n * n)
    Pe, Pd, Pdd = ((rows @ z).reshape(9, n) for z in (eta, etad, etadd))
    by_eta, by_etad = ((Z.reshape(9) @ flat).reshape(n, n) for Z in (S, 2.0 * W))
    modal = by_eta @ eta + by_etad @ etad + part.M @ etadd
    X, Xd, Xdd = ((Pe @ z).reshape(9, 1) for z in (eta, etad, etadd))
    across = _left(S, Pe + _flipped(Pe)) + 2.0 * _left(W, _flipped(Pd)) + _flipped(Pdd)
    T_eta, T_etad, T_etadd = _moment(across), 2.0 * _moment(_left(W, Pe)), _moment(Pe)
    by_q, by_qd = np.zeros((2, 6 + n, n))
    by_spin, mass = np.zeros((6 + n, 3)), np.zeros((6 + n, 6 + n))
    by_q[3:6] = T_eta @ slope + T_etad @ growing + T_etadd @ rising
    by_qd[3:6] = T_etad @ slope + 2.0 * (T_etadd @ growing)
    by_q[6:] = slope.T @ (by_eta @ slope + by_etad @ growing + part.M @ rising)
    by_qd[6:] = slope.T @ (by_etad @ slope + 2.0 * (part.M @ growing))
    if part.c.size > 0:
        by_q[6:] += (modal @ part.c.reshape(n, n * n)).reshape(n, n)
    for k in range(3):
        axis = AXES[k]
        turning = axis @ W + W @ axis
        by_spin[3:6, k] = _moment(_left(turning, X) + 2.0 * _left(axis, Xd))[:, 0]
        by_spin[6:, k] = slope.T @ (turning.reshape(9) @ Pe + 2.0 * (axis.reshape(9) @ Pd))
    force = np.zeros(6 + n)
    force[3:6] = _moment(_left(S, X) + 2.0 * _left(W, Xd) + Xdd)[:, 0]
    force[6:] = slope.T @ modal
    E, C = X.reshape(3, 3), T_etadd @ slope
    mass[3:6, 3:6] = (E[0, 0] + E[1, 1] + E[2, 2]) * np.eye(3) - E
    mass[3:6, 6:], mass[6:, 3:6], mass[6:, 6:] = C, C.T, slope.T @ part.M @ slope
    return BodyForce(force, mass, by_spin, by_q, by_qd)
