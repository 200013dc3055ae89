"""What callbacks see of a running system, and what they return."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody.elements.dense import Frame
from modalprep.multibody.evaluation.coordinates import Coordinates
from modalprep.multibody.model.loads import GROUND, Callback, locate
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.packed import Packed
from modalprep.suggest import suggestion

FAR_OFF = 1e30  # of a coordinate or speed in SI units


class Wrench(NamedTuple):
    """Force (N) and torque (N m), inertial axes, on an interface of a body."""

    body: str
    interface: int
    force: np.ndarray
    torque: np.ndarray


class State(Coordinates):
    """The system at one time: ``state["body.interface"]`` is a `Frame`, ``state.joint(name)`` a `JointState`."""

    def __init__(
        self, system: System, packed: Packed, y: np.ndarray, motion: np.ndarray, frame: Callable[[str, int], Frame]
    ) -> None:
        super().__init__(system, packed, y, motion)
        self._frame = frame
        self._seen: dict[tuple[str, int], Frame] = {}

    @property
    def coordinates(self) -> np.ndarray:
        """All coordinates (nx,) in the order of the packed system."""
        return self._y[: self.packed.nx]

    @property
    def vector(self) -> np.ndarray:
        """All coordinates and speeds (nx + nu,) in the order of the packed system."""
        return self._y

    @property
    def far_off(self) -> bool:
        """Whether this is a trial of an unstable step, which will be rejected."""
        return not np.all(np.abs(self._y) < FAR_OFF)

    def __getitem__(self, name: str) -> Frame:
        """Return the motion of ``body.interface``.

        Returns
        -------
        Frame
            Position (m), rotation, velocity (m/s) and angular velocity (rad/s), inertial axes.
        """
        found = locate(self.system.bodies, name, "state")
        if found is None:
            raise InputError("state: the ground does not move")
        return self.frame(*found)

    def frame(self, body: str, interface: int) -> Frame:
        """Return the motion of an interface of a body by its number.

        Returns
        -------
        Frame
            As of ``state["body.interface"]``.
        """
        found = self._seen.get((body, interface))
        if found is None:
            found = self._seen[body, interface] = self._frame(body, interface)
        return found


def callback_loads(system: System, packed: Packed, t: float, state: State) -> tuple[list[Wrench], np.ndarray]:
    """Return the wrenches and the hinge forces (nu,) of all callbacks.

    Raises
    ------
    InputError
        When a callback names what is not there, or returns the wrong number of values or no finite ones.
    """
    wrenches = []
    tau = np.zeros(packed.nu)
    for load in system.loads:
        if isinstance(load, Callback):
            for where, value in _called(load, t, state).items():
                what = f"callback {load.name!r}: load on {where!r}"
                _refuse_unknown_place(system, where, what)
                values = np.atleast_1d(np.asarray(value, dtype=float))
                if not np.all(np.isfinite(values)) and not state.far_off:
                    raise InputError(f"{what} is not finite at t = {t:g} s")
                if packed.links_of(where):
                    rows = packed.speeds_of(where)
                    tau[rows] += _sized(values, len(rows), what)
                else:
                    wrenches.append(_wrench(system, where, values, what))
    return wrenches, tau


def _refuse_unknown_place(system: System, where: str, what: str) -> None:
    joints = {joint.name for joint in system.joints}
    if where not in joints and where.partition(".")[0] not in system.bodies and where != GROUND:
        ends = [f"{name}.{interface}" for name, body in system.bodies.items() for interface in body.interface_name]
        raise InputError(f"{what} acts on nothing; {suggestion(where, [*joints, *ends], 'there are')}")


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
