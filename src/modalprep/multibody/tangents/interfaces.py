"""The motion of an interface relative to its body, and its derivatives by the modal coordinates in closed form.

The rotation is the Cayley map of ``(1 + v.v / 12) v`` with ``v = psi q - q Kg_T q / 2``. Its angular velocity by v',

    W(v) z = a z + b (v.z) v + c v x z

has factors that depend on ``v.v`` alone: with ``k = 1 + v.v / 12`` and ``s = 4 / (4 + k^2 v.v)`` they are ``s k``,
``s / 6`` and ``s k^2 / 2``.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.line import strain_arms
from modalprep.multibody.tangents import displacement as displacements
from modalprep.multibody.tangents.displacement import Bent, displacement
from modalprep.multibody.tangents.spatial import skewed


class Turn(NamedTuple):
    """The rotation of a vector v, and the factors a, b, c with two derivatives by ``v.v``."""

    v: np.ndarray
    k: float
    s: float
    a: np.ndarray
    b: np.ndarray
    c: np.ndarray


class Shapes(NamedTuple):
    """What `curvature` needs of an interface."""

    R: np.ndarray
    dp: np.ndarray  # (3, n)
    bent: Bent
    turn: Turn
    to_spin: np.ndarray  # (3, 3)
    v_q: np.ndarray  # (3, n)
    v_qq: np.ndarray  # (3, n, n)
    spin_q: np.ndarray  # (3, n)


class InterfaceMotion(NamedTuple):
    """Motion of an interface relative to its body, twists in axes of the interface, with derivatives (6, n)."""

    r: np.ndarray  # (3,) axes of the body
    R: np.ndarray  # (3, 3) axes of the interface to those of the body
    partial: np.ndarray  # (6, n)
    twist: np.ndarray  # (6,)
    rate: np.ndarray  # (6,) of the components of the twist
    twist_q: np.ndarray
    rate_q: np.ndarray
    rate_qd: np.ndarray
    shapes: Shapes


class Constants(NamedTuple):
    """An interface of a body with modes."""

    position: np.ndarray  # (3,)
    phi: np.ndarray  # (3, n)
    psi: np.ndarray
    bow: np.ndarray  # (3, n, n) second order of the displacement
    twist: np.ndarray  # (3, n, n) of the rotation
    arm: np.ndarray  # (3,) strain


@lru_cache(maxsize=1024)  # bodies compare by identity
def _constants(body: FlexibleBody, k: int) -> Constants:
    arm = strain_arms(body.interface_position, body.points)[k]
    given = body.interface_position[k], body.phi[k], body.psi[k], -body.Kg_F[k], -body.Kg_T[k], arm
    return Constants(*(np.array(x, dtype=float, order="C") for x in given))


def interface_motion(body: FlexibleBody, k: int, motion: tuple) -> InterfaceMotion:
    """Return the motion of interface k of a body with modes, with q, q' and q''.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> body, rest = uniform_beam(modes=2), np.zeros(2)
    >>> tip = interface_motion(body, 1, (rest, np.array([1.0, 0]), rest))
    >>> bool(np.allclose(tip.twist, np.concatenate([body.phi[1, :, 0], body.psi[1, :, 0]])))
    True
    """
    return _motion(_constants(body, k), *motion)


def _motion(own: Constants, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> InterfaceMotion:
    """Return `interface_motion`."""
    n = len(q)
    moved = displacement(own.phi, own.bow, own.arm, q, qd, qdd)
    by_rows = own.twist.reshape(3 * n, n)
    curved, growing = (by_rows @ q).reshape(3, n), (by_rows @ qd).reshape(3, n)
    v, v_q = own.psi @ q + 0.5 * (curved @ q), own.psi + curved
    vd, vdd = v_q @ qd, v_q @ qdd + growing @ qd
    turn = _turn(v)
    to_spin, X = _combined(turn, 0, np.eye(3)), turn.k * skewed(v)
    spin_q = to_spin @ v_q
    R = np.eye(3) + turn.s * (X + 0.5 * (X @ X))
    w, bent = to_spin @ vd, _slopes(turn, vd)
    spin_rate = to_spin @ vdd + bent @ vd
    by_v, by_vd = _convected_slopes(turn, vd)
    w_q = bent @ v_q + to_spin @ growing
    wd_q = (_slopes(turn, vdd) + by_v) @ v_q + to_spin @ (by_rows @ qdd).reshape(3, n) + by_vd @ growing
    wd_qd = 2.0 * (to_spin @ growing) + by_vd @ v_q
    W, U = skewed(w), skewed(moved.rate)
    linear = moved.acceleration - W @ moved.rate
    linear_q = moved.acceleration_q + U @ w_q - W @ moved.rate_q + skewed(linear) @ spin_q
    linear_qd = moved.acceleration_qd + U @ spin_q - W @ moved.dp
    back = R.T
    twist, rate = np.empty(6), np.empty(6)
    twist[:3], twist[3:] = back @ moved.rate, back @ w
    rate[:3], rate[3:] = back @ linear, back @ spin_rate
    return InterfaceMotion(
        own.position + moved.p,
        R,
        _both(back, moved.dp, spin_q),
        twist,
        rate,
        _both(back, moved.rate_q + U @ spin_q, w_q + W @ spin_q),
        _both(back, linear_q, wd_q + skewed(spin_rate) @ spin_q),
        _both(back, linear_qd, wd_qd),
        Shapes(R, moved.dp, moved.bent, turn, to_spin, v_q, own.twist, spin_q),
    )


def _both(back: np.ndarray, translation: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Return translations and rotations (3, n) in other axes, (6, n)."""
    found = np.empty((6, translation.shape[1]))
    found[:3], found[3:] = back @ translation, back @ rotation
    return found


def curvature(own: Shapes, w: np.ndarray) -> np.ndarray:
    """Return the derivative by q of ``partial' w`` (n, n) at a constant wrench ``w (6,)``, axes of the interface.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> body, rest = uniform_beam(modes=2), np.zeros(2)
    >>> tip = interface_motion(body, 1, (rest, rest, rest))
    >>> found = curvature(tip.shapes, np.array([1.0, 0, 0, 0, 0, 0]))  # a force that turns with the tip
    >>> (_, v, w), (_, y, z) = body.phi[1], body.psi[1]
    >>> bool(np.allclose(found, -body.Kg_F[1, 0] + np.outer(v, z) - np.outer(w, y)))
    True
    """
    n = own.dp.shape[1]
    F, T = own.R @ w[:3], own.R @ w[3:]
    found = displacements.curvature(own.bent, F) - own.dp.T @ (skewed(F) @ own.spin_q)
    found += own.v_q.T @ (_turned_back(own.turn, T) @ own.v_q) - own.spin_q.T @ (skewed(T) @ own.spin_q)
    return found + ((T @ own.to_spin) @ own.v_qq.reshape(3, n * n)).reshape(n, n)


def _turn(v: np.ndarray) -> Turn:
    x = float(v @ v)
    k, k1 = 1.0 + x / 12.0, 1.0 / 12.0
    d, d1 = 4.0 + k * k * x, k * k + 2.0 * k * k1 * x
    d2 = 4.0 * k * k1 + 2.0 * k1 * k1 * x
    s, s1 = 4.0 / d, -4.0 * d1 / (d * d)
    s2 = 8.0 * d1 * d1 / (d * d * d) - 4.0 * d2 / (d * d)
    a = np.array([s * k, s1 * k + s * k1, s2 * k + 2.0 * s1 * k1])
    b = np.array([s / 6.0, s1 / 6.0, s2 / 6.0])
    kk = 0.5 * k * k
    c = np.array([s * kk, s1 * kk + s * k * k1, s2 * kk + 2.0 * s1 * k * k1 + s * k1 * k1])
    return Turn(v, k, s, a, b, c)


def _combined(turn: Turn, order: int, Z: np.ndarray) -> np.ndarray:
    """Return W, or a derivative of it by v.v, times Z (3, k)."""
    v = turn.v
    return turn.a[order] * Z + turn.b[order] * np.outer(v, v @ Z) + turn.c[order] * (skewed(v) @ Z)


def _slopes(turn: Turn, z: np.ndarray) -> np.ndarray:
    """Return the derivative of ``W z`` by v (3, 3) at a constant z."""
    v, b = turn.v, turn.b[0]
    one = _combined(turn, 1, z.reshape(3, 1))[:, 0]
    return 2.0 * np.outer(one, v) + b * ((v @ z) * np.eye(3) + np.outer(v, z)) - turn.c[0] * skewed(z)


def _turned_back(turn: Turn, T: np.ndarray) -> np.ndarray:
    """Return the derivative of ``W' T`` by v (3, 3) at a constant T."""
    v, b = turn.v, turn.b[0]
    first = turn.a[1] * T + turn.b[1] * (v @ T) * v + turn.c[1] * (skewed(T) @ v)
    return 2.0 * np.outer(first, v) + b * (np.outer(v, T) + (v @ T) * np.eye(3)) + turn.c[0] * skewed(T)


def _convected_slopes(turn: Turn, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the derivatives of the acceleration ``W' z`` with v' = z, by v and by z (3, 3)."""
    v, b0, b1 = turn.v, turn.b[0], turn.b[1]
    m, zz, one_axes = v @ z, z @ z, np.eye(3)
    one = _combined(turn, 1, z.reshape(3, 1))[:, 0]
    two = _combined(turn, 2, z.reshape(3, 1))[:, 0]
    by_v = 2.0 * np.outer(one, z) + 4.0 * m * np.outer(two, v) + b0 * (np.outer(z, z) + zz * one_axes)
    by_v += 2.0 * m * (b1 * (m * one_axes + np.outer(v, z)) - turn.c[1] * skewed(z))
    by_v += 2.0 * b1 * np.outer(m * z + zz * v, v)
    by_z = 2.0 * np.outer(one, v) + 2.0 * m * _combined(turn, 1, one_axes)
    by_z += b0 * (m * one_axes + np.outer(z, v) + 2.0 * np.outer(v, z))
    return by_v, by_z
