"""How the forces of elements change with the motion of what they act on: what an element's `tangent` returns."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from modalprep.vectors import skew


class EndSlopes(NamedTuple):
    """Wrenches on the ends of an element, inertial axes, and their derivatives by the motion of the ends.

    Attributes
    ----------
    ends : sequence of str
        ``body.interface`` or ``ground``.
    wrench : (6 k,)
        Force and torque on each end, at its origin.
    by_pose : (6 k, 6 k)
        By displacements and rotations of the ends.
    by_rate : (6 k, 6 k)
        By their velocities and angular velocities.
    """

    ends: Sequence[str]
    wrench: np.ndarray
    by_pose: np.ndarray
    by_rate: np.ndarray


class BodySlopes(NamedTuple):
    """Force and torque at the origin of a body and on its modes (6 + n,), and derivatives; all in axes of the body.

    Derivatives by displacement and rotation of the body, by its velocity and its acceleration (6 + n, 6 each), which
    are relative to the ground and less gravity, and by its modal coordinates (6 + n, n).
    """

    body: str
    force: np.ndarray
    by_pose: np.ndarray
    by_rate: np.ndarray | float = 0.0
    by_acceleration: np.ndarray | float = 0.0
    by_q: np.ndarray | float = 0.0


def stacked(count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return zeros for the fields of `EndSlopes` with `count` ends."""
    return np.zeros(6 * count), np.zeros((6 * count, 6 * count)), np.zeros((6 * count, 6 * count))


def opposite(force: np.ndarray, by_place: np.ndarray, by_speed: np.ndarray) -> tuple:
    """Return wrench and derivatives of a force on the second of two points, the opposite on the first.

    `by_place` and `by_speed` (3, 3) are its derivatives by the place and velocity of the second against the first.
    """
    wrench, by_pose, by_rate = stacked(2)
    for one in (0, 6):
        sign = 1.0 if one else -1.0
        wrench[one : one + 3] = sign * force
        for other in (0, 6):
            both = sign * (1.0 if other else -1.0)
            by_pose[one : one + 3, other : other + 3] = both * by_place
            by_rate[one : one + 3, other : other + 3] = both * by_speed
    return wrench, by_pose, by_rate


def turning(wrench: np.ndarray) -> np.ndarray:
    """Return the derivative by the rotation of its axes of a wrench that turns with them (6, 6).

    Examples
    --------
    >>> turning(np.array([1.0, 0, 0, 0, 0, 0])) @ [0, 0, 0, 0, 0, 1.0]
    array([0., 1., 0., 0., 0., 0.])
    """
    found = np.zeros((6, 6))
    found[:3, 3:], found[3:, 3:] = -skew(wrench[:3]), -skew(wrench[3:])
    return found
