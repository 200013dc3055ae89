"""The motion of an interface relative to its body, and its derivatives by the modal coordinates in closed form.

The rotation is the Cayley map of ``(1 + v.v / 12) v`` with ``v = psi q - q Kg_T q / 2``. Its angular velocity by v',

    W(v) z = a z + b (v.z) v + c v x z

has factors that depend on ``v.v`` alone: with ``k = 1 + v.v / 12`` and ``s = 4 / (4 + k^2 v.v)`` they are ``s k``,
``s / 6`` and ``s k^2 / 2``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.line import strain_arms
from modalprep.multibody.tangents.displacement import displacement
from modalprep.vectors import cross, skew


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
    shapes: tuple  # for `curvature`

    def curvature(self, w: np.ndarray) -> np.ndarray:
        """Return the derivative by q of ``partial' w`` (n, n) at a constant wrench ``w (6,)``, its axes."""
        moved, turned, to_spin, v_q, v_qq, spin_q = self.shapes
        F, T = self.R @ w[:3], self.R @ w[3:]
        found = moved.curvature(F) - moved.dp.T @ skew(F) @ spin_q - spin_q.T @ skew(T) @ spin_q
        return found + v_q.T @ turned.curvature(T) @ v_q + np.tensordot(to_spin.T @ T, v_qq, 1)


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
    q, qd, qdd = motion
    arm = strain_arms(body.interface_position, body.points)[k]
    moved = displacement(body.phi[k], -body.Kg_F[k], arm, motion)
    v_qq = -body.Kg_T[k]
    v, v_q = body.psi[k] @ q + 0.5 * (v_qq @ q) @ q, body.psi[k] + v_qq @ q
    growing = v_qq @ qd  # (3, n), the derivative of v' by q
    vd, vdd = v_q @ qd, v_q @ qdd + growing @ qd
    turned = _Turn(v)
    to_spin = turned.to_spin
    spin_q = to_spin @ v_q
    R = turned.rotation()
    w = to_spin @ vd
    spin_rate = to_spin @ vdd + turned.convected(vd)
    by_v, by_vd = turned.convected_slopes(vd)
    w_q = turned.slopes(vd) @ v_q + to_spin @ growing
    wd_q = (turned.slopes(vdd) + by_v) @ v_q + to_spin @ (v_qq @ qdd) + by_vd @ growing
    wd_qd = 2 * to_spin @ growing + by_vd @ v_q
    linear = moved.acceleration - cross(w, moved.rate)

    def in_axes(translation: np.ndarray, rotation: np.ndarray) -> np.ndarray:
        return np.concatenate([R.T @ translation, R.T @ rotation])

    W, U = skew(w), skew(moved.rate)
    linear_q = moved.acceleration_q + U @ w_q - W @ moved.rate_q + skew(linear) @ spin_q
    linear_qd = moved.acceleration_qd + U @ spin_q - W @ moved.dp
    return InterfaceMotion(
        r=body.interface_position[k] + moved.p,
        R=R,
        partial=in_axes(moved.dp, spin_q),
        twist=in_axes(moved.rate, w),
        rate=in_axes(linear, spin_rate),
        twist_q=in_axes(moved.rate_q + U @ spin_q, w_q + W @ spin_q),
        rate_q=in_axes(linear_q, wd_q + skew(spin_rate) @ spin_q),
        rate_qd=in_axes(linear_qd, wd_qd),
        shapes=(moved, turned, to_spin, v_q, v_qq, spin_q),
    )


class _Turn:
    """The rotation of v, and the derivatives of ``W(v) z``; the factors a, b, c with two derivatives by ``v.v``."""

    def __init__(self, v: np.ndarray) -> None:
        self.v = v
        x = v @ v
        k, k1 = 1 + x / 12, 1 / 12
        d, d1, d2 = 4 + k * k * x, k * k + 2 * k * k1 * x, 4 * k * k1 + 2 * k1 * k1 * x
        s, s1, s2 = 4 / d, -4 * d1 / d**2, 8 * d1**2 / d**3 - 4 * d2 / d**2
        self.k, self.s = k, s
        self.a = s * k, s1 * k + s * k1, s2 * k + 2 * s1 * k1
        self.b = s / 6, s1 / 6, s2 / 6
        self.c = s * k * k / 2, s1 * k * k / 2 + s * k * k1, s2 * k * k / 2 + 2 * s1 * k * k1 + s * k1 * k1
        self.to_spin = self.combined(0, np.eye(3))

    def combined(self, order: int, z: np.ndarray) -> np.ndarray:
        """Return W z, or its derivatives by v.v, of z (3,) or (3, k)."""
        v = self.v
        return self.a[order] * z + self.b[order] * np.multiply.outer(v, v @ z) + self.c[order] * (skew(v) @ z)

    def rotation(self) -> np.ndarray:
        """Return the rotation (3, 3)."""
        X = skew(self.k * self.v)
        return np.eye(3) + self.s * (X + X @ X / 2)

    def slopes(self, z: np.ndarray) -> np.ndarray:
        """Return the derivative of ``W z`` by v (3, 3) at a constant z."""
        v, b = self.v, self.b[0]
        found = 2 * np.outer(self.combined(1, z), v) + b * ((v @ z) * np.eye(3) + np.outer(v, z))
        return found - self.c[0] * skew(z)

    def curvature(self, T: np.ndarray) -> np.ndarray:
        """Return the derivative of ``W' T`` by v (3, 3) at a constant T."""
        v, b = self.v, self.b[0]
        first = self.a[1] * T + self.b[1] * (v @ T) * v + self.c[1] * cross(T, v)
        return 2 * np.outer(first, v) + b * (np.outer(v, T) + (v @ T) * np.eye(3)) + self.c[0] * skew(T)

    def convected(self, z: np.ndarray) -> np.ndarray:
        """Return ``W' z`` with v' = z."""
        return self.slopes(z) @ z

    def convected_slopes(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the derivatives of `convected` by v and by z (3, 3)."""
        v, m, zz, b = self.v, self.v @ z, z @ z, self.b
        one, two = self.combined(1, z), self.combined(2, z)
        by_v = 2 * np.outer(one, z) + 4 * m * np.outer(two, v) + np.outer(b[0] * z, z) + b[0] * zz * np.eye(3)
        by_v += 2 * m * (b[1] * (m * np.eye(3) + np.outer(v, z)) - self.c[1] * skew(z))
        by_v += 2 * b[1] * np.outer(m * z + zz * v, v)
        by_z = 2 * np.outer(one, v) + 2 * m * self.combined(1, np.eye(3))
        by_z += b[0] * (m * np.eye(3) + np.outer(z, v) + 2 * np.outer(v, z))
        return by_v, by_z
