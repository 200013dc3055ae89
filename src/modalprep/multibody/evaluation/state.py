"""What callbacks see of a running system, and what they return."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody.kernels.data import COORDINATES, MODES, PRESCRIBED, SPEEDS, XQ, U, X
from modalprep.multibody.model.loads import Callback, locate
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.tree import Packed
from modalprep.suggest import refuse_unknown


class Frame(NamedTuple):
    """Motion of an interface in inertial axes."""

    position: np.ndarray  # (3,) m
    rotation: np.ndarray  # (3, 3) interface (the body's axes, turned with it) to inertial
    velocity: np.ndarray  # (3,) m/s
    spin: np.ndarray  # (3,) rad/s


class JointState(NamedTuple):
    """Coordinates and speeds of a joint, travels before turns: m or rad; a quaternion where it is spherical or free."""

    position: np.ndarray
    rate: np.ndarray


class Wrench(NamedTuple):
    """Force (N) and torque (N m), inertial axes, on an interface of a body."""

    body: str
    interface: int
    force: np.ndarray
    torque: np.ndarray


class State:
    """The system at one time: ``state["body.interface"]`` is a `Frame`, ``state.joint(name)`` a `JointState`."""

    def __init__(
        self, system: System, packed: Packed, y: np.ndarray, motion: np.ndarray, frame: Callable[[str, int], Frame]
    ) -> None:
        self.system, self.packed, self._y, self._motion, self._frame = system, packed, y, motion, frame
        self._seen: dict[tuple[str, int], Frame] = {}

    @property
    def coordinates(self) -> np.ndarray:
        """All coordinates (nx,) in the order of the packed system."""
        return self._y[: self.packed.nx]

    def modal(self, body: str) -> np.ndarray:
        """Return the modal coordinates (n,) of a body.

        Returns
        -------
        (n,) float
            m sqrt(kg).
        """
        row = self.packed.tree.ints[self.packed.link_of(body)]
        return self._y[row[XQ] : row[XQ] + row[MODES]]

    def __getitem__(self, name: str) -> Frame:
        """Return the motion of ``body.interface``.

        Returns
        -------
        Frame
            Position (m), rotation, velocity (m/s) and spin (rad/s), inertial axes.
        """
        found = locate(self.system.bodies, name, "state")
        if found is None:
            raise InputError("state: the ground does not move")
        if found not in self._seen:
            self._seen[found] = self._frame(*found)
        return self._seen[found]

    def joint(self, name: str) -> JointState:
        """Return coordinates and speeds of a joint.

        Returns
        -------
        JointState
            Coordinates (m, rad) and speeds (m/s, rad/s).
        """
        known = [joint.name for joint in self.system.joints]
        refuse_unknown(name, known, "state: joint")
        position, rate = [], []
        for i in self.packed.links_of(name):
            row, kind = self.packed.tree.ints[i], self.packed.types[i]
            if kind in PRESCRIBED:
                position.append(self._motion[i, :1])
                rate.append(self._motion[i, 1:2])
            first = self.packed.nx + row[U]
            position.append(self._y[row[X] : row[X] + COORDINATES[kind]])
            rate.append(self._y[first : first + SPEEDS[kind]])
        return JointState(np.concatenate(position), np.concatenate(rate))


def callback_loads(system: System, packed: Packed, t: float, state: State) -> tuple[list[Wrench], np.ndarray]:
    """Return the wrenches and the hinge forces (nu,) of all callbacks.

    Raises
    ------
    InputError
        When a callback names what is not there, or returns the wrong number of values or no finite ones.
    """
    wrenches, tau = [], np.zeros(packed.nu)
    for load in system.loads:
        if isinstance(load, Callback):
            for where, value in _called(load, t, state).items():
                what = f"callback {load.name!r}: load on {where!r}"
                values = np.atleast_1d(np.asarray(value, dtype=float))
                if not np.all(np.isfinite(values)):
                    raise InputError(f"{what} is not finite at t = {t:g} s")
                if where in [joint.name for joint in system.joints]:
                    rows = packed.speeds_of(where)
                    tau[rows] += _sized(values, len(rows), what)
                else:
                    wrenches.append(_wrench(system, where, values, what))
    return wrenches, tau


def _called(load: Callback, t: float, state: State) -> Mapping[str, Any]:
    found = load.function(t, state)
    if not isinstance(found, Mapping):
        raise InputError(
            f"callback {load.name!r} returned {type(found).__name__}; return a dictionary of loads by "
            "'body.interface' or joint"
        )
    return found


def _sized(values: np.ndarray, count: int, what: str) -> np.ndarray:
    if len(values) != count:
        raise InputError(f"{what} has {len(values)} numbers; give {count}")
    return values


def _wrench(system: System, where: str, values: np.ndarray, what: str) -> Wrench:
    if len(values) not in (3, 6):
        raise InputError(f"{what} has {len(values)} numbers; give a force (3), or a force and a torque (6)")
    found = locate(system.bodies, where, what)
    if found is None:
        raise InputError(f"{what} has no effect; name 'body.interface' or a joint")
    return Wrench(*found, values[:3], np.resize(np.append(values[3:], np.zeros(3)), 3))
