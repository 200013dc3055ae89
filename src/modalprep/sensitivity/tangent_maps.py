"""Changes of the coordinates of a state as the solver keeps them, and as turns and displacements in body axes.

The derivatives of the equations of motion are by increments in the axes of the bodies; steps of a run add multiples of
the rates of quaternions, four numbers each, which need not have length one within a step. Rotations depend on the
direction of a quaternion alone.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import scipy

from modalprep.multibody.model.joint_types import KINDS
from modalprep.multibody.packing.packed import Packed
from modalprep.vectors import skew


class StepMap(ABC):
    """The map of changes ``[state | accelerations | those of the method]`` (nz,) of one step."""

    @abstractmethod
    def forward(self, dz: np.ndarray, dp: np.ndarray) -> np.ndarray:
        """Return the changes (nz, k) after the step, with those before it and (np, k) of the parameters."""

    def reverse(self, bar: np.ndarray, bar_p: np.ndarray) -> np.ndarray:
        """Return the gradient (nz,) by what was before; that by the parameters is added."""
        return reversed_map(self.forward, bar, bar_p)


def reversed_map(
    forward: Callable[[np.ndarray, np.ndarray], np.ndarray], bar: np.ndarray, bar_p: np.ndarray
) -> np.ndarray:
    """Return the gradient by the first argument of a linear map of two; that by the second is added to `bar_p`.

    Examples
    --------
    >>> by_p = np.zeros(1)
    >>> reversed_map(lambda x, p: 2 * x + np.ones((2, 1)) @ p, np.array([1.0, 3.0]), by_p), by_p
    (array([2., 6.]), array([4.]))
    """
    first = len(bar)
    one = np.eye(first + len(bar_p))
    found = forward(one[:first], one[first:]).T @ bar
    bar_p += found[first:]
    return found[:first]


class Free(NamedTuple):
    """A joint with a quaternion: the indices of its translation, its quaternion, and their speeds."""

    place: slice
    quaternion: slice
    speed: slice
    spin: slice


class Kinematics(NamedTuple):
    """Derivatives at a state of coordinates x (nx,) with speeds u (nu,).

    Attributes
    ----------
    increments : (nu, nx)
        Increments in body axes by changes of the coordinates.
    rates_x, rates_u : (nx, nx), (nx, nu)
        Rates of the coordinates by coordinates and speeds.
    """

    increments: np.ndarray
    rates_x: np.ndarray
    rates_u: np.ndarray


class Layout:
    """Where the joints with quaternions of a system stand, and all other coordinates.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.multibody.model.system import System
    >>> from modalprep.multibody.packing.tree import pack
    >>> ball = Joint(name="ball", type="spherical", parent="ground", child="arm")
    >>> layout = Layout(pack(System(bodies={"arm": uniform_beam(modes=1)}, joints=(ball,))))
    >>> found = layout.kinematics(np.array([1.0, 0, 0, 0, 0.1, 0, 0, 0, 0]))
    >>> found.increments @ np.array([0, 0.5, 0, 0, 0.2])
    array([1. , 0. , 0. , 0.2])
    """

    def __init__(self, packed: Packed) -> None:
        self.nx, self.nu = packed.nx, packed.nu
        self.free: list[Free] = []
        self.plain = np.zeros((self.nx, self.nu))
        for row, code in zip(packed.model.links, packed.types, strict=True):
            kind, x, u = KINDS[code], int(row["x"]), int(row["u"])
            modes = np.arange(int(row["modes"]))
            self.plain[int(row["xq"]) + modes, int(row["uq"]) + modes] = 1.0
            if kind.quaternion < 0:
                own = np.arange(kind.speeds)
                self.plain[x + own, u + own] = 1.0
                continue
            n = kind.translations
            q = x + kind.quaternion
            self.free.append(Free(slice(x, q), slice(q, q + 4), slice(u, u + n), slice(u + n, u + n + 3)))

    def kinematics(self, y: np.ndarray) -> Kinematics:
        """Return the derivatives at a state (nx + nu,), quaternions of any length."""
        increments, rates_u = self.plain.T.copy(), self.plain.copy()
        rates_x = np.zeros((self.nx, self.nx))
        u = y[self.nx :]
        for place, quaternion, speed, spin in self.free:
            e = y[quaternion]
            E = turned(e)
            turns = 2 * E.T / (e @ e)
            increments[spin, quaternion] = turns
            rates_u[quaternion, spin] = E / 2
            rates_x[quaternion, quaternion] = rate_matrix(u[spin])
            if place.stop > place.start:
                R = rotation(e)
                increments[speed, place] = R.T
                rates_u[place, speed] = R
                rates_x[place, quaternion] = -R @ skew(u[speed]) @ turns
        return Kinematics(increments, rates_x, rates_u)

    def directions(self, y: np.ndarray) -> np.ndarray:
        """Return the changes of the coordinates (nx, nu) by increments in body axes, quaternions keeping their length.

        It is the inverse of `Kinematics.increments` but for the lengths of quaternions.
        """
        found = self.plain.copy()
        for place, quaternion, speed, spin in self.free:
            found[quaternion, spin] = turned(y[quaternion]) / 2
            if place.stop > place.start:
                found[place, speed] = rotation(y[quaternion])
        return found

    def exponential(self, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return what increments (nu,) become by a motion by the exponential of d (nu,), and its tangent: (nu, nu).

        Increments in the axes of the moved bodies are ``A x + T dd``: ``A = exp(-ad d)``, ``T = sum (-ad d)^k/(k+1)!``.
        """
        carried, tangent = np.eye(self.nu), np.eye(self.nu)
        for own in self.free:
            turns = np.arange(own.spin.start, own.spin.stop)
            travels = np.arange(own.speed.start, own.speed.stop)
            rows = np.concatenate([travels, turns])
            ad = np.zeros((len(rows), len(rows)))
            ad[-3:, -3:] = skew(d[own.spin])
            if len(travels):
                ad[:3, :3], ad[:3, 3:] = skew(d[own.spin]), skew(d[own.speed])
            both = np.zeros((2 * len(ad), 2 * len(ad)))
            both[: len(ad), : len(ad)], both[: len(ad), len(ad) :] = -ad, np.eye(len(ad))
            found = scipy.linalg.expm(both)
            carried[np.ix_(rows, rows)] = found[: len(ad), : len(ad)]
            tangent[np.ix_(rows, rows)] = found[: len(ad), len(ad) :]
        return carried, tangent

    def normalised(self, y: np.ndarray, dy: np.ndarray) -> np.ndarray:
        """Return the change (ny, k) of a state whose quaternions are scaled to length one."""
        found = dy.copy()
        for own in self.free:
            e = y[own.quaternion]
            length = np.linalg.norm(e)
            found[own.quaternion] = (dy[own.quaternion] - np.outer(e, e @ dy[own.quaternion]) / length**2) / length
        return found


def turned(e: np.ndarray) -> np.ndarray:
    """Return E (4, 3) of a quaternion w, x, y, z, with which its rate is ``E w / 2`` (angular velocity in its axes).

    Examples
    --------
    >>> turned(np.array([1.0, 0, 0, 0])) @ np.array([1.0, 2, 3])
    array([0., 1., 2., 3.])
    """
    w, x, y, z = e
    return np.array([[-x, -y, -z], [w, -z, y], [z, w, -x], [-y, x, w]])


def rate_matrix(w: np.ndarray) -> np.ndarray:
    """Return the matrix (4, 4) that makes the rate of a quaternion from it, at an angular velocity in its axes.

    Examples
    --------
    >>> e, w = np.array([0.5, 0.1, -0.7, 0.5]), np.array([1.0, 2, 3])
    >>> bool(np.allclose(rate_matrix(w) @ e, turned(e) @ w / 2))
    True
    """
    found = np.zeros((4, 4))
    found[0, 1:], found[1:, 0], found[1:, 1:] = -w / 2, w / 2, -skew(w) / 2
    return found


def rotation(e: np.ndarray) -> np.ndarray:
    """Return the rotation matrix of a quaternion of any length.

    Examples
    --------
    >>> rotation(np.array([2.0, 0, 0, 2.0])).round(12) @ np.array([1.0, 0, 0])
    array([0., 1., 0.])
    """
    w, x, y, z = e / np.linalg.norm(e)
    v = skew(np.array([x, y, z]))
    return np.eye(3) + 2 * w * v + 2 * v @ v
