"""Spatial vectors (linear, angular) in the axes of moving frames, at their origins (Featherstone 2008, chapter 2)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Tangents(NamedTuple):
    """Forces of inverse dynamics (nu,), and their derivatives (nu, nu) by accelerations, speeds and coordinates.

    `size` (nu,) and `stiffness` (nu, nu) are sums of the absolute values of what makes forces and K: for round-off.
    """

    force: np.ndarray
    M: np.ndarray
    D: np.ndarray
    K: np.ndarray
    size: np.ndarray
    stiffness: np.ndarray


def skewed(v: np.ndarray) -> np.ndarray:
    """Return ``v~`` (3, 3) with ``v~ z = v x z``: `vectors.skew` of one vector, in a fifth of the time.

    Examples
    --------
    >>> skewed(np.array([1.0, 2, 3])) @ np.array([0.0, 0, 1])
    array([ 2., -1.,  0.])
    """
    x, y, z = v.tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def shift(R: np.ndarray, r: np.ndarray) -> np.ndarray:
    """Return X (6, 6), which takes twists to a frame at r with rotation R (3, 3), its axes to these.

    Examples
    --------
    >>> shift(np.eye(3), np.array([2.0, 0, 0])) @ [0, 0, 0, 0, 0, 1.0]
    array([0., 2., 0., 0., 0., 1.])
    """
    X = np.zeros((6, 6))
    X[:3, :3] = X[3:, 3:] = R.T
    X[:3, 3:] = -R.T @ skewed(r)
    return X


def motion_cross(V: np.ndarray) -> np.ndarray:
    """Return ``V x`` (6, 6): what turning with the twist V does to the components of a twist.

    Examples
    --------
    >>> motion_cross(np.array([0, 0, 0, 0, 0, 1.0])) @ [1.0, 0, 0, 0, 0, 0]
    array([0., 1., 0., 0., 0., 0.])
    """
    found = np.zeros((6, 6))
    found[:3, :3] = found[3:, 3:] = skewed(V[3:])
    found[:3, 3:] = skewed(V[:3])
    return found


def turned_wrench(w: np.ndarray) -> np.ndarray:
    """Return the change (6, 6) of a wrench, given in fixed axes at a fixed point, when its frame moves by a twist.

    Force and torque are those of a wrench that moves with its frame: by a displacement d and a rotation x
    ``x cross f`` and ``x cross t + d cross f``.

    Examples
    --------
    >>> turned_wrench(np.array([1.0, 0, 0, 0, 0, 0])) @ [0, 1.0, 0, 0, 0, 0]
    array([ 0.,  0.,  0.,  0.,  0., -1.])
    """
    found = np.zeros((6, 6))
    found[:3, 3:] = found[3:, :3] = -skewed(w[:3])
    found[3:, 3:] = -skewed(w[3:])
    return found


def carried(
    X: np.ndarray,
    V: np.ndarray,
    a: np.ndarray,
    columns: np.ndarray,
    twist: np.ndarray,
    rate: np.ndarray,
    S: np.ndarray,
    first: int,
    V_q: np.ndarray,
    a_q: np.ndarray,
    a_qd: np.ndarray,
) -> tuple[np.ndarray, ...]:
    """Return velocity, acceleration and columns of the next frame of `analysis.tree_tangent`: (6,), (6,), (6, 4 nu).

    Its velocity relative to the last one is `twist`, the rate of that `rate`. The own coordinates of the way, whose
    partial velocities are ``S (6, k)``, begin at `first`; `V_q`, `a_q` and `a_qd` (6, k) are the derivatives of `twist`
    by them, and of `rate` by them and by their speeds.
    """
    V, a = X @ V, X @ a
    turn, V_next = motion_cross(V), V + twist
    columns = X @ columns
    nu, k = columns.shape[1] // 4, S.shape[1]
    if k > 0:
        by_turn, onward = turn @ S, motion_cross(V_next)
        V_x = by_turn + V_q
        a_x = motion_cross(a) @ S + a_q - motion_cross(twist) @ by_turn + turn @ V_q
        columns[:, first : first + k] = S
        columns[:, nu + first : nu + first + k] = V_x
        columns[:, 2 * nu + first : 2 * nu + first + k] = a_x + onward @ V_x
        columns[:, 3 * nu + first : 3 * nu + first + k] = by_turn + a_qd + onward @ S
    return V_next, a + rate + turn @ twist, columns


def inertia_columns(
    V: np.ndarray,
    columns: np.ndarray,
    by_spin: np.ndarray,
    mass: np.ndarray,
    by_q: np.ndarray,
    by_qd: np.ndarray,
    first: int,
) -> np.ndarray:
    """Return the derivatives (6 + n, 3 nu) of a body's force by coordinates, speeds and accelerations.

    By those of its frame, and by its own modes from `first` on; `by_spin` as in `BodyForce`.
    """
    rows, nu, n = mass.shape[0], columns.shape[1] // 4, by_q.shape[1]
    M = mass[:, :6]
    v, w = skewed(V[:3]), skewed(V[3:])
    spin = by_spin - 2.0 * (mass[:, :3] @ v) - mass[:, 3:6] @ w
    turning = np.empty((3, 2 * nu))
    turning[:, :nu] = columns[3:, nu : 2 * nu]
    turning[:, nu:] = columns[3:, :nu]
    found = np.empty((rows, 3 * nu))
    found[:, : 2 * nu] = M @ columns[:, 2 * nu :] + spin @ turning
    found[:, 2 * nu :] = M @ columns[:, :nu]
    if n > 0:
        found[:, first : first + n] += by_q
        found[:, nu + first : nu + first + n] += by_qd
        found[:, 2 * nu + first : 2 * nu + first + n] += mass[:, 6:]
    return found


def add_rows(first: int, force: np.ndarray, size: np.ndarray, columns: np.ndarray, found: Tangents) -> None:
    """Add forces (k,) of the speeds from `first` on, their sizes and derivatives (k, 3 nu), to what was found."""
    nu, k = columns.shape[1] // 3, columns.shape[0]
    found.force[first : first + k] += force
    found.size[first : first + k] += size
    found.K[first : first + k] += columns[:, :nu]
    found.D[first : first + k] += columns[:, nu : 2 * nu]
    found.M[first : first + k] += columns[:, 2 * nu :]


def inward(
    X: np.ndarray, S: np.ndarray, first: int, w: np.ndarray, size: np.ndarray, columns: np.ndarray, found: Tangents
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a wrench (6,), its size and its derivatives (6, 3 nu) on the last frame, from those on the next one.

    Adds its rows ``S' w`` to what was found.
    """
    k = S.shape[1]
    if k > 0:
        own = S.T
        add_rows(first, own @ w, np.abs(own) @ size, own @ columns, found)
        columns = columns.copy()
        columns[:, first : first + k] += turned_wrench(w) @ S
    back = X.T
    return back @ w, np.abs(back) @ size, back @ columns


def single_axis_way(
    base: np.ndarray, back: np.ndarray, arm: np.ndarray, along: float, about: float, x: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return rotation, place and `shift` of a link that moves by x along and about an axis, z of the joint's frame.

    ``base`` and ``back`` (3, 3) turn from the joint's axes to those of the last frame, and from the link's to those of
    the joint; `arm` is the position of the joint.
    """
    c, s = np.cos(about * x), np.sin(about * x)
    R = base @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ back
    r = arm + along * x * base[:, 2]
    return R, r, shift(R, r)
