"""Kinematics of stations: a chain of frames whose twists relative to each other are linear in the modes (theory 4.10).

With the parent a of a frame p, ``rho = d + rho_q q`` and ``th = th_q q`` in the axes of a,

    R_p = R_a exp(th~)     r_p = r_a + R_a V(th) rho     V = 1 + b th~ + c th~ th~

``b = (1 - cos|th|) / |th|^2, c = (|th| - sin|th|) / |th|^3``. Interfaces are the last frames, without mass.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.body.exponential import angle_functions
from modalprep.body.stations.record import Stations
from modalprep.vectors import cross, skew


class Chain(NamedTuple):
    """Constants of the frames: N parts, then the interfaces.

    Attributes
    ----------
    parent : (k,) int
        -1: the body's own frame.
    d : (k, 3)
        From the parent's origin, undeformed, m.
    rho_q, th_q : (k, 3, n)
        Relative displacement along the chord and relative rotation, in the parent's axes.
    """

    parent: np.ndarray
    d: np.ndarray
    rho_q: np.ndarray
    th_q: np.ndarray


class Frames(NamedTuple):
    """Frames at a deflection, in the axes of the body: place, rotation and partial velocities.

    Attributes
    ----------
    r, R : (k, 3), (k, 3, 3)
    Jr, Jw : (k, 3, n)
        Velocity and angular velocity per modal rate.
    """

    r: np.ndarray
    R: np.ndarray
    Jr: np.ndarray
    Jw: np.ndarray


def chain(stations: Stations, position: np.ndarray, phi: np.ndarray, psi: np.ndarray) -> Chain:
    """Return the frames of the stations and of interfaces at ``position (n_if, 3)``, which move by phi and turn by psi.

    Examples
    --------
    >>> from modalprep.examples import large_cantilever
    >>> body = large_cantilever(modes=2, stations=4)
    >>> chain(body.stations, body.interface_position, body.phi, body.psi).d[:, 0].round(3)
    array([1.25, 2.5 , 2.5 , 2.5 , 0.  , 1.25])
    """
    return _chain(stations, position, np.concatenate([stations.moved, phi]), np.concatenate([stations.turned, psi]))


def chain_outside(stations: Stations, position: np.ndarray) -> Chain:
    """Return the frames as `chain` does, moved by the derivatives outside the basis (m of them).

    Examples
    --------
    >>> from modalprep.examples import large_cantilever
    >>> body = large_cantilever(modes=2, stations=4)
    >>> chain_outside(body.stations, body.interface_position).d.shape
    (6, 3)
    """
    outside = stations.outside
    assert outside is not None
    moved = np.concatenate([outside.moved, outside.phi])
    return _chain(stations, position, moved, np.concatenate([outside.turned, outside.psi]))


def _chain(stations: Stations, position: np.ndarray, moved: np.ndarray, turned: np.ndarray) -> Chain:
    """Return the frames whose vectors move (k, 3, n) and turn (k, 3, n) them by so much."""
    parent = np.concatenate([stations.parent, stations.owner])
    at = np.concatenate([stations.centre, position])
    held = (parent >= 0)[:, None, None]
    d = at - np.where(held[..., 0], at[parent], 0.0)
    before = np.where(held, moved[parent], 0.0)
    turned_before = np.where(held, turned[parent], 0.0)
    th_q = turned - turned_before
    rho_q = moved - before + skew(d) @ (turned_before + th_q / 2)
    return Chain(parent, d, rho_q, th_q)


def frames(chain: Chain, q: np.ndarray) -> Frames:
    """Return the frames at a deflection ``q (n,)``.

    Examples
    --------
    >>> from modalprep.examples import large_cantilever
    >>> body = large_cantilever(modes=2, stations=4)
    >>> frames(chain(body.stations, body.interface_position, body.phi, body.psi), np.zeros(body.n)).r[-1].round(9)
    array([10.,  0.,  0.])
    """
    k, n = len(chain.parent), len(q)
    r, R = np.zeros((k, 3)), np.zeros((k, 3, 3))
    Jr, Jw = np.zeros((2, k, 3, n))
    for p, a in enumerate(chain.parent.tolist()):
        E, V, D, arm = _step(chain, p, q)
        slope = V @ chain.rho_q[p] + D @ chain.th_q[p]
        turn = V @ chain.th_q[p]
        Ra = R[a] if a >= 0 else np.eye(3)
        R[p] = Ra @ E
        r[p], Jr[p], Jw[p] = Ra @ arm, Ra @ slope, Ra @ turn
        if a >= 0:
            Jr[p] += Jr[a] - skew(r[p]) @ Jw[a]
            Jw[p] += Jw[a]
            r[p] += r[a]
    return Frames(r, R, Jr, Jw)


def _step(chain: Chain, p: int, q: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return ``exp(th~), V, d(V rho) / d th`` and ``V rho`` of frame p."""
    th, rho = chain.th_q[p] @ q, chain.d[p] + chain.rho_q[p] @ q
    a, b, c, b1, c1, *_ = angle_functions(float(th @ th))
    T = skew(th)
    u = cross(th, rho)
    w = cross(th, u)
    D = -b * skew(rho) - c * (skew(u) + T @ skew(rho)) + 2 * np.outer(b1 * u + c1 * w, th)
    return np.eye(3) + a * T + b * T @ T, np.eye(3) + b * T + c * T @ T, D, rho + b * u + c * w


def accelerations(chain: Chain, at: Frames, q: np.ndarray, qd: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return what the frames accelerate and turn faster by, both (k, 3), where q'' and the body's own motion are zero.

    Examples
    --------
    >>> from modalprep.examples import large_cantilever
    >>> body = large_cantilever(modes=1, stations=4)
    >>> link = chain(body.stations, body.interface_position, body.phi, body.psi)
    >>> q, qd = np.array([2.0] + [0.0] * (body.n - 1)), np.ones(body.n)
    >>> more, less = (frames(link, q + s * 1e-5 * qd) for s in (1, -1))
    >>> found = accelerations(link, frames(link, q), q, qd)
    >>> bool(np.allclose(found[0], (more.Jr - less.Jr) @ qd / 2e-5, atol=1e-8))
    True
    """
    k = len(chain.parent)
    linear, angular = np.zeros((k, 3)), np.zeros((k, 3))
    for p, a in enumerate(chain.parent.tolist()):
        speed, turning, bulging, spinning = _relative(chain, p, q, qd)
        if a < 0:
            linear[p], angular[p] = bulging, spinning
            continue
        R, w = at.R[a], at.Jw[a] @ qd
        arm = at.r[p] - at.r[a]
        linear[p] = linear[a] + cross(angular[a], arm) + cross(w, cross(w, arm) + 2 * (R @ speed)) + R @ bulging
        angular[p] = angular[a] + cross(w, R @ turning) + R @ spinning
    return linear, angular


def _relative(chain: Chain, p: int, q: np.ndarray, qd: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return rates of ``V rho`` and of the rotation of frame p in its parent's axes, and their rates without q''."""
    th, rho = chain.th_q[p] @ q, chain.d[p] + chain.rho_q[p] @ q
    v, s = chain.th_q[p] @ qd, chain.rho_q[p] @ qd
    _, b, c, b1, c1, b2, c2, _, _ = angle_functions(float(th @ th))
    x = 2 * float(th @ v)
    y = 2 * float(v @ v)
    bd, cd = b1 * x, c1 * x
    bdd, cdd = b2 * x**2 + b1 * y, c2 * x**2 + c1 * y
    u, ud = cross(th, rho), cross(v, rho)
    w, wdd = cross(th, u), 2 * cross(v, ud)
    wd = cross(v, u) + cross(th, ud)
    us, usd = cross(th, s), cross(v, s)
    ws = cross(th, us)
    wsd = cross(v, us) + cross(th, usd)
    speed = s + b * us + c * ws + bd * u + b * ud + cd * w + c * wd
    bulging = 2 * (bd * us + b * usd + cd * ws + c * wsd)
    bulging = bulging + bdd * u + 2 * bd * ud + cdd * w + 2 * cd * wd + c * wdd
    across = cross(th, v)
    twice = cross(th, across)
    turning = v + b * across + c * twice
    spinning = bd * across + cd * twice + c * cross(v, across)
    return speed, turning, bulging, spinning
