"""Derivatives of closed loops: of the rates and accelerations of their conditions, and of the forces they exert.

A condition is a product of vectors of the ends. Each vector is followed with its rate and its second derivative in
time, and with what coordinates and speeds change these by (theory 5.8).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from modalprep.multibody.analysis.tree_tangent import Moving, TreeTangent
from modalprep.multibody.elements.slopes import EndSlopes, opposite, stacked
from modalprep.multibody.evaluation.loops import Loops
from modalprep.multibody.kernels.closed_loops.constraints import ANGLE, COUPLER, DISTANCE
from modalprep.multibody.packing.constraints import Row
from modalprep.vectors import cross, skew


class Conditions(NamedTuple):
    """Derivatives (m, nu) of conditions: G, and by the coordinates and speeds of their rates and accelerations.

    The derivative of a rate by the speeds is G too.
    """

    G: np.ndarray
    rate_x: np.ndarray
    acceleration_x: np.ndarray
    acceleration_u: np.ndarray


class _Vector(NamedTuple):
    """A vector in time (3,), inertial axes, and its derivatives (3, nu); that of the rate by the speeds is `x`."""

    value: np.ndarray
    rate: np.ndarray
    acceleration: np.ndarray
    x: np.ndarray
    rate_x: np.ndarray
    acceleration_x: np.ndarray
    acceleration_u: np.ndarray

    def minus(self, other: _Vector) -> _Vector:
        return _Vector(*(a - b for a, b in zip(self, other, strict=True)))

    def dot(self, other: _Vector) -> tuple:
        """Return the product, its rate and acceleration, and their derivatives, as `_Vector` has them."""
        a, b = self, other
        return (
            a.value @ b.value,
            a.rate @ b.value + a.value @ b.rate,
            a.value @ b.acceleration + b.value @ a.acceleration + 2 * a.rate @ b.rate,
            a.value @ b.x + b.value @ a.x,
            a.rate @ b.x + b.rate @ a.x + a.value @ b.rate_x + b.value @ a.rate_x,
            _twice(a, b, "x", "rate_x", "acceleration_x"),
            a.value @ b.acceleration_u + b.value @ a.acceleration_u + 2 * (a.rate @ b.x + b.rate @ a.x),
        )


def _twice(a: _Vector, b: _Vector, x: str, rate: str, acceleration: str) -> np.ndarray:
    found = 2 * (a.rate @ getattr(b, rate) + b.rate @ getattr(a, rate))
    found += a.acceleration @ getattr(b, x) + b.acceleration @ getattr(a, x)
    return found + a.value @ getattr(b, acceleration) + b.value @ getattr(a, acceleration)


class _End:
    """An end of a closure: its frame and the columns of its rotation, inertial axes."""

    def __init__(self, frame: Moving) -> None:
        R, w = frame.R, frame.V[3:]
        self.frame = frame
        by_x, by_u = frame.acceleration_slopes()
        self.turn, self.w, self.alpha = R @ frame.J[3:], R @ w, R @ frame.a[3:]
        self.w_x = R @ frame.V_x[3:] - skew(self.w) @ self.turn
        self.alpha_x, self.alpha_u = R @ by_x[3:] - skew(self.alpha) @ self.turn, R @ by_u[3:]
        v, a = R @ frame.V[:3], R @ (frame.a[:3] + cross(w, frame.V[:3]))
        self.origin = _Vector(
            frame.p,
            v,
            a,
            R @ frame.J[:3],
            R @ frame.V_x[:3] - skew(v) @ self.turn,
            R @ by_x[:3] - skew(a) @ self.turn,
            R @ by_u[:3],
        )

    def fixed(self, e: np.ndarray) -> _Vector:
        """Return a vector that is fixed in the end's axes."""
        v = self.frame.R @ e
        d, V, W = cross(self.w, v), skew(v), skew(self.w)
        x, rate_x = -V @ self.turn, -V @ self.w_x - W @ V @ self.turn
        return _Vector(
            v,
            d,
            cross(self.alpha, v) + cross(self.w, d),
            x,
            rate_x,
            -V @ self.alpha_x + skew(self.alpha) @ x - skew(d) @ self.w_x + W @ rate_x,
            -V @ self.alpha_u - skew(d) @ self.turn + W @ x,
        )


def conditions(tree: TreeTangent, loops: Loops, kept: np.ndarray) -> Conditions:
    """Return the derivatives of the conditions that are `kept`."""
    if not len(kept):  # all closures are inactive
        return Conditions(*np.zeros((4, 0, tree.packed.nu)))
    ends: dict[int, _End] = {}
    found = []
    for i in kept.tolist():
        row = loops.closing.rows[i]
        if row.kind == COUPLER:
            found.append(_coupler(loops, i, tree.packed.nu))
            continue
        own = 2 * row.closure, 2 * row.closure + 1
        for k in own:
            if k not in ends:
                ends[k] = _End(_frame(tree, loops.arrays.ends[k]))
        found.append(_condition(row, *(ends[k] for k in own)))
    return Conditions(*(np.array(part) for part in zip(*found, strict=True)))


def _frame(tree: TreeTangent, end: Any) -> Moving:
    if end["link"] < 0:
        return tree.on_ground(end["position"])
    return tree.interface(int(end["link"]), int(end["interface"]))


def _coupler(loops: Loops, i: int, nu: int) -> tuple[np.ndarray, ...]:
    G = np.zeros(nu)
    for term in loops.arrays.terms[loops.arrays.terms["row"] == i]:
        if term["x"] >= 0:
            G[term["u"]] += term["factor"]
    return G, *np.zeros((3, nu))


def _condition(row: Row, a: _End, b: _End) -> tuple[np.ndarray, ...]:
    apart = b.origin.minus(a.origin)
    if row.kind == DISTANCE:
        return _distance(apart)
    return a.fixed(row.in_a).dot(b.fixed(row.in_b) if row.kind == ANGLE else apart)[3:]


def _distance(apart: _Vector) -> tuple[np.ndarray, ...]:
    """Return the derivatives of the root of the square of a vector."""
    square, rate, acceleration, x, rate_x, acceleration_x, acceleration_u = apart.dot(apart)
    L = np.sqrt(square)
    G, speed = x / (2 * L), rate / (2 * L)
    second = (acceleration / 2 - speed**2) / L
    speed_x = (rate_x / 2 - speed * G) / L
    by_u = (acceleration_u / 2 - 2 * speed * G) / L
    return G, speed_x, (acceleration_x / 2 - 2 * speed * speed_x - second * G) / L, by_u


def exerted(tree: TreeTangent, loops: Loops, kept: np.ndarray, multiplier: np.ndarray) -> list[EndSlopes]:
    """Return the forces of the conditions that are `kept`, with multipliers (m,), and their derivatives."""
    found = []
    for i, size in zip(kept.tolist(), multiplier, strict=True):
        row = loops.closing.rows[i]
        if row.kind != COUPLER:
            closure = loops.system.closures[row.closure]
            frames = [_frame(tree, loops.arrays.ends[2 * row.closure + k]) for k in range(2)]
            found.append(EndSlopes((closure.a, closure.b), *(size * part for part in _line(row, *frames))))
    return found


def _line(row: Row, a: Moving, b: Moving) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the wrenches (12,) of a multiplier of one on both ends, and their derivatives."""
    r = b.p - a.p
    if row.kind == DISTANCE:
        L = float(np.linalg.norm(r))
        line = r / L
        return opposite(line, (np.eye(3) - np.outer(line, line)) / L, np.zeros((3, 3)))
    wrench, by_pose, by_rate = stacked(2)
    e = a.R @ row.in_a
    E = skew(e)
    if row.kind == ANGLE:
        h = b.R @ row.in_b
        wrench[3:6], wrench[9:] = cross(e, h), cross(h, e)
        by_pose[9:, 3:6], by_pose[9:, 9:] = -skew(h) @ E, E @ skew(h)
        by_pose[3:6] = -by_pose[9:]
        return wrench, by_pose, by_rate
    wrench[:3], wrench[3:6], wrench[6:9] = -e, cross(e, r), e
    by_pose[6:9, 3:6], by_pose[:3, 3:6] = -E, E
    by_pose[3:6, :3], by_pose[3:6, 3:6], by_pose[3:6, 6:9] = -E, skew(r) @ E, E
    return wrench, by_pose, by_rate
