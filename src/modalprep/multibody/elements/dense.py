"""What the reference implementation of a force element reads and returns: points, bodies, generalised forces."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.multibody.model.loads import locate
from modalprep.multibody.model.system import System
from modalprep.multibody.model.time_function import TimeFunction
from modalprep.vectors import on_both, skew


class Frame(NamedTuple):
    """Motion of an interface in inertial axes.

    Attributes
    ----------
    position : (3,)
        m
    rotation : (3, 3)
        From the interface's axes, which are the body's and turn with the interface, to inertial axes.
    velocity : (3,)
        m/s
    angular_velocity : (3,)
        rad/s
    """

    position: np.ndarray
    rotation: np.ndarray
    velocity: np.ndarray
    angular_velocity: np.ndarray


class Point(NamedTuple):
    """Motion of an interface or of the ground, inertial axes: its frame, its acceleration ``J u' + c`` (6,)."""

    frame: Frame
    J: np.ndarray
    c: np.ndarray


@dataclass
class LinkState:
    """Motion of a link: world rotation R and position p of its frame, the following in its own axes.

    Velocity ``V = (v, w)`` (6,); `J` (6, nu) and `c` (6,) give its spatial specific acceleration ``J u' + c``.
    """

    R: np.ndarray
    p: np.ndarray
    V: np.ndarray
    J: np.ndarray
    c: np.ndarray

    def turned(self, R: np.ndarray) -> LinkState:
        """Return the same point's motion in axes turned by R (new axes to these), fixed to it."""
        X = on_both(R.T)
        return LinkState(self.R @ R, self.p, X @ self.V, X @ self.J, X @ self.c)

    def moved(self, r: np.ndarray, partial: np.ndarray, velocity: np.ndarray, acceleration: np.ndarray) -> LinkState:
        """Return the motion of a frame at r that itself moves: partial velocities (6, nu), velocity and acceleration.

        The acceleration (6,) is that seen when this frame's acceleration is zero: with the centripetal and Coriolis
        terms of its angular velocity.
        """
        shift = np.block([[np.eye(3), -skew(r)], [np.zeros((3, 3)), np.eye(3)]])
        return LinkState(
            self.R,
            self.p + self.R @ r,
            shift @ self.V + velocity,
            shift @ self.J + partial,
            shift @ self.c + acceleration,
        )


@dataclass
class BodyState(LinkState):
    """Motion of a link that carries a body, in the user's axes: q, q', the places of its modal speeds in u."""

    body: FlexibleBody
    q: np.ndarray
    qd: np.ndarray
    rows: slice


class Scene(NamedTuple):
    """A state of the system: the motion of its bodies, and of its interfaces by ``interface(body, number)``."""

    system: System
    states: dict[str, BodyState]
    interface: Callable[[str, int], Point]
    t: float

    @property
    def nothing(self) -> DenseLoads:
        """A load without effect."""
        return DenseLoads(np.zeros(next(iter(self.states.values())).J.shape[1]), 0.0, 0.0, 0.0)

    def end(self, text: str, position: np.ndarray | None = None, rotation: np.ndarray | None = None) -> Point:
        """Return the interface that an end of an element names, or its frame on the ground."""
        found = locate(self.system.bodies, text, text)
        if found is not None:
            return self.interface(*found)
        place = np.zeros(3) if position is None else position
        turn = np.eye(3) if rotation is None else rotation
        still = Frame(place, turn, np.zeros(3), np.zeros(3))
        return Point(still, np.zeros((6, len(self.nothing.f))), np.zeros(6))


class DenseLoads(NamedTuple):
    """Generalised forces (nu,), power (W) and energies as `registry.Energies`, added mass (nu, nu)."""

    f: np.ndarray
    power: float
    stored: float
    gravity: float
    mass: np.ndarray | float = 0.0


def plus(a: DenseLoads, b: DenseLoads) -> DenseLoads:
    """Return what two loads do together."""
    return DenseLoads(a.f + b.f, a.power + b.power, a.stored + b.stored, a.gravity + b.gravity, a.mass + b.mass)


def value_at(function: TimeFunction | None, t: float) -> float:
    """Return a function's value; without a function, zero."""
    return 0.0 if function is None else function(t)[0]


def wrench_at(point: Point, force: np.ndarray, torque: np.ndarray) -> DenseLoads:
    """Return what a force and a torque (inertial axes) do at a point."""
    wrench = np.concatenate([force, torque])
    return DenseLoads(
        point.J.T @ wrench, float(force @ point.frame.velocity + torque @ point.frame.angular_velocity), 0.0, 0.0
    )
