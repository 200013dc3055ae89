"""Effect of loads on a point or body of the reference implementation: frames, partial velocities, forces."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.multibody.evaluation.state import Frame
from modalprep.multibody.model.loads import Bushing, locate
from modalprep.multibody.model.system import System
from modalprep.multibody.model.time_function import TimeFunction
from modalprep.multibody.reference.equations import BodyState, node_motion
from modalprep.vectors import skew


class Point(NamedTuple):
    """Motion of an interface or of the ground, inertial axes: its frame, its acceleration ``J u' + c`` (6,)."""

    frame: Frame
    J: np.ndarray
    c: np.ndarray


class DenseLoads(NamedTuple):
    """Generalised forces (nu,), power (W) and energies as `forces.Energies`, added mass (nu, nu)."""

    f: np.ndarray
    power: float
    stored: float
    gravity: float
    mass: np.ndarray | float = 0.0


def plus(a: DenseLoads, b: DenseLoads) -> DenseLoads:
    """Return what two loads do together."""
    return DenseLoads(*(x + y for x, y in zip(a, b, strict=True)))


def value_at(function: TimeFunction | None, t: float) -> float:
    """Return a function's value; without a function, zero."""
    return 0.0 if function is None else function(t)[0]


def interface_point(s: BodyState, k: int) -> Point:
    """Return interface k of a body."""
    r, turn, Phi, vel, acc = node_motion(s.body, k, s.V[3:], s.q, s.qd)
    shift = np.block([[np.eye(3), -skew(r)], [np.zeros((3, 3)), np.eye(3)]])
    J = shift @ s.J
    J[:, s.rows] += Phi
    world = np.kron(np.eye(2), s.R)
    V = world @ (shift @ s.V + vel)
    return Point(Frame(s.p + s.R @ r, s.R @ turn, V[:3], V[3:]), world @ J, world @ (shift @ s.c + acc))


def end_point(system: System, states: dict[str, BodyState], text: str, load) -> Point:
    """Return the interface that an end of a load names, or its place on the ground."""
    found = locate(system.bodies, text, text)
    if found is not None:
        return interface_point(states[found[0]], found[1])
    nu = next(iter(states.values())).J.shape[1]
    rotation = load.rotation if isinstance(load, Bushing) else np.eye(3)
    return Point(Frame(load.position, rotation, np.zeros(3), np.zeros(3)), np.zeros((6, nu)), np.zeros(6))


def wrench_at(point: Point, force: np.ndarray, torque: np.ndarray) -> DenseLoads:
    """Return what a force and a torque (inertial axes) do at a point."""
    wrench = np.concatenate([force, torque])
    return DenseLoads(
        point.J.T @ wrench, float(force @ point.frame.velocity + torque @ point.frame.angular_velocity), 0.0, 0.0
    )
