"""Inputs and outputs of linearised systems by name."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
import scipy

from modalprep.errors import InputError
from modalprep.multibody.evaluation.evaluate import build_equations
from modalprep.multibody.evaluation.evaluator import Evaluator
from modalprep.multibody.kernels.interfaces import add_wrench, carried, node_acceleration, node_state, world
from modalprep.multibody.model.joint_types import KINDS
from modalprep.multibody.model.loads import locate
from modalprep.multibody.results.recovered import AppliedLoad
from modalprep.multibody.results.recovered_state import RECOVERY, RecoveredState
from modalprep.suggest import suggestion

AXES = ("x", "y", "z")
MOTIONS = ("position", "rotation", "velocity", "angular_velocity", "acceleration", "angular_acceleration")


class Input:
    """An input: a hinge force, or a component of a force or torque on an interface in inertial axes.

    ``hinge`` or ``hinge.2`` (N or N m in the joint's second speed), ``body.interface.force.x`` (N), ``.torque.z``
    (N m).

    Raises
    ------
    InputError
        When the name is not known in the system.
    """

    def __init__(self, evaluator: Evaluator, name: str) -> None:
        self.evaluator = evaluator
        self.tau = np.zeros(evaluator.nu)
        self.wrench = np.zeros(6)
        self.link, self.node = -1, 0
        joint, _, number = name.partition(".")
        parts = name.rsplit(".", 2)
        if joint in [j.name for j in evaluator.system.joints] and (not number or number.isdigit()):
            self.tau[_speed(evaluator, joint, number, name)] = 1.0
        elif len(parts) == 3 and parts[1] in ("force", "torque") and parts[2] in AXES:
            self.link, self.node = _interface(evaluator, parts[0], name)
            self.at = parts[0]
            self.wrench[3 * (parts[1] == "torque") + AXES.index(parts[2])] = 1.0
        else:
            raise InputError(
                f"input {name!r}: name a joint ('hinge', 'hinge.2'), 'body.interface.force.x' or "
                "'body.interface.torque.x'"
            )

    def apply(self, size: float) -> np.ndarray:
        """Apply it between `Evaluator.load` and `Evaluator.accelerations`; returns its hinge forces (nu,)."""
        if self.link >= 0:
            p = self.evaluator
            w = tuple((size * self.wrench).tolist())
            add_wrench(p.packed.model, p.data, self.link, self.node, w[:3], w[3:])
            p.applied.append((self.at, size * self.wrench))
        return size * self.tau


def needs_accelerations(name: str) -> bool:
    """Return whether an output depends on the accelerations of the system, beside its state.

    Examples
    --------
    >>> needs_accelerations("arm.tip.acceleration.x"), needs_accelerations("arm.tip.velocity.x")
    (True, False)
    """
    return f".{RECOVERY}." in name or name.rpartition(".")[0].endswith((".acceleration", ".angular_acceleration"))


def output(evaluator: Evaluator, name: str, y: np.ndarray) -> Callable[[np.ndarray], float]:
    """Return the function of the state that a name denotes; rotations are relative to state y.

    ``hinge.angle``, ``.rate``, ``.displacement``, ``.speed`` (``.angle.2`` the second), ``body.modal.3``,
    ``body.stress.point.xx``, ``body.recovery.name.place.component``, ``body.interface.position.x``, ``.rotation``,
    ``.velocity``, ``.angular_velocity``, ``.acceleration`` and ``.angular_acceleration`` in inertial axes; to be called
    after `Evaluator.accelerations`.

    Raises
    ------
    InputError
        When the name is not known in the system.
    """
    first, _, rest = name.partition(".")
    parts = name.rsplit(".", 2)
    if first in evaluator.system.bodies and rest.startswith(f"{RECOVERY}."):
        return _recovered(evaluator, name)
    if len(parts) == 3 and parts[1] in MOTIONS and parts[2] in AXES:
        return _motion(evaluator, *_interface(evaluator, parts[0], name), parts[1], AXES.index(parts[2]), y)
    if first in evaluator.system.bodies and rest.startswith("modal."):
        indices = evaluator.coordinates("body", first)
        number = rest.removeprefix("modal.")
        if number.isdigit() and 1 <= int(number) <= len(indices):
            return lambda y, k=indices[int(number) - 1]: y[k]
    if first in evaluator.system.bodies and rest.startswith("stress."):
        return _stress(evaluator, first, rest.removeprefix("stress."), name)
    if first in [joint.name for joint in evaluator.system.joints]:
        known = _hinges(evaluator, first)
        if rest not in known:
            raise InputError(f"output {name!r}: {suggestion(rest, known, f'joint {first} has')}")
        return lambda y, k=known[rest]: y[k]
    raise InputError(
        f"output {name!r}: name 'joint.angle', 'body.modal.1', 'body.recovery.name.place.component', or "
        "'body.interface.position.x' with one of "
        f"{', '.join(MOTIONS)}"
    )


def _interface(evaluator: Evaluator, text: str, name: str) -> tuple[int, int]:
    found = locate(evaluator.system.bodies, text, repr(name))
    if found is None:
        raise InputError(f"{name!r}: the ground does not move; name 'body.interface'")
    return evaluator.packed.link_of(found[0]), found[1]


def _speed(evaluator: Evaluator, joint: str, number: str, name: str) -> int:
    rows = evaluator.packed.speeds_of(joint)
    if not number and len(rows) == 1:
        return rows[0]
    if not number.isdigit() or not 1 <= int(number) <= len(rows):
        raise InputError(f"input {name!r}: joint {joint!r} has {len(rows)} speeds; write {joint}.1 and so on")
    return rows[int(number) - 1]


def _hinges(evaluator: Evaluator, joint: str) -> dict[str, int]:
    """Return the indices in the state of a joint's coordinates and speeds by name."""
    found: dict[str, list[int]] = {}
    for i in evaluator.packed.links_of(joint):
        kind, row = KINDS[evaluator.packed.types[i]], evaluator.packed.model.links[i]
        if kind.named:
            position, rate = ("angle", "rate") if evaluator.packed.turns(i) else ("displacement", "speed")
            found.setdefault(position, []).append(int(row["x"]))
            found.setdefault(rate, []).append(evaluator.nx + int(row["u"]))
        elif kind.quaternion >= 0:
            first = evaluator.nx + int(row["u"]) + kind.translations
            found["angular_velocity"] = [first, first + 1, first + 2]
    single = {name: indices[0] for name, indices in found.items() if len(indices) == 1}
    return single | {f"{name}.{k + 1}": i for name, indices in found.items() for k, i in enumerate(indices)}


def _stress(evaluator: Evaluator, body: str, component: str, name: str) -> Callable[[np.ndarray], float]:
    points = evaluator.system.bodies[body].stress
    modal = evaluator.coordinates("body", body)
    rows = {f"{p}.{c}": row for p, at in points.items() for c, row in zip(at.components, at.modes, strict=True)}
    if component not in rows:
        raise InputError(f"output {name!r}: {suggestion(component, rows, f'the linear stresses of {body} are')}")
    return lambda y, row=rows[component]: row @ y[modal]


def _recovered(evaluator: Evaluator, name: str) -> Callable[[np.ndarray], float]:
    """Return a recovered quantity, with the loads of the inputs."""
    seen = RecoveredState(evaluator.system, evaluator.packed, evaluator.loops)
    value = seen.reader(name, "output")
    assert value is not None  # the name is that of a recovery
    eq = build_equations(evaluator.packed, evaluator.loading, evaluator.data)

    def read(y: np.ndarray) -> float:
        ydot = np.concatenate([np.zeros(evaluator.nx), evaluator.udot, [0.0]])
        applied = [AppliedLoad(at, wrench[None, :3], wrench[None, 3:]) for at, wrench in evaluator.applied]
        seen.observe(eq, evaluator.t, np.append(y, 0.0), ydot, applied)
        return value(y)

    return read


def _motion(
    evaluator: Evaluator, link: int, node: int, what: str, axis: int, y: np.ndarray
) -> Callable[[np.ndarray], float]:
    model, data = evaluator.packed.model, evaluator.data
    if what in ("acceleration", "angular_acceleration"):
        return _acceleration(evaluator, link, node, what == "angular_acceleration", axis)
    quantity = ("position", "rotation", "velocity", "angular_velocity").index(what)

    def state() -> tuple:
        return node_state(model, data, link, node)

    if what != "rotation":
        return lambda y: state()[quantity][axis]
    evaluator.load(y)
    world(model, data)
    start = state()[1]
    return lambda y: _turned(start, state()[1])[axis]


@lru_cache(maxsize=64)  # the three axes of an interface are read one after another
def _turned(start: tuple, now: tuple) -> np.ndarray:
    """Return the rotation vector (3,) between two orientations."""
    turn = np.reshape(now, (3, 3)) @ np.reshape(start, (3, 3)).T
    return scipy.spatial.transform.Rotation.from_matrix(turn).as_rotvec()


def _acceleration(evaluator: Evaluator, link: int, node: int, turn: bool, axis: int) -> Callable[[np.ndarray], float]:
    """Return the acceleration relative to the ground, which may rotate."""
    at = (evaluator.packed.model, evaluator.data, link, node)
    ground = np.array([0, 0, evaluator.packed.model.ground_rate])

    def relative(y: np.ndarray) -> float:
        position, _, velocity, spin = node_state(*at)
        own = np.cross(ground, spin) if turn else carried(evaluator.data, position, velocity)
        return node_acceleration(*at, 1.0)[turn][axis] - own[axis]

    return relative
