"""Inputs and outputs of linearised systems by name."""

from __future__ import annotations

from collections.abc import Callable
from itertools import chain
from typing import NamedTuple

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody.analysis.tree_tangent import TreeTangent
from modalprep.multibody.evaluation.evaluate import build_equations
from modalprep.multibody.evaluation.evaluator import Evaluator
from modalprep.multibody.kernels.interfaces import add_wrench
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
        self.speed, self.link, self.node = -1, -1, 0
        joint, _, number = name.partition(".")
        parts = name.rsplit(".", 2)
        if evaluator.packed.links_of(joint) and (not number or number.isdigit()):
            self.speed = _speed(evaluator, joint, number, name)
        elif len(parts) == 3 and parts[1] in ("force", "torque") and parts[2] in AXES:
            self.link, self.node = _interface(evaluator, parts[0], name)
            self.at = parts[0]
            self.wrench = np.zeros(6)
            self.wrench[3 * (parts[1] == "torque") + AXES.index(parts[2])] = 1.0
        else:
            raise InputError(
                f"input {name!r}: name a joint ('hinge', 'hinge.2'), 'body.interface.force.x' or "
                "'body.interface.torque.x'"
            )

    @property
    def tau(self) -> np.ndarray:
        """Joint forces (nu,) of a unit input."""
        tau = np.zeros(self.evaluator.nu)
        if self.speed >= 0:
            tau[self.speed] = 1.0
        return tau

    def apply(self, size: float) -> np.ndarray:
        """Apply it between `Evaluator.load` and `Evaluator.accelerations`; returns its hinge forces (nu,)."""
        if self.link >= 0:
            p = self.evaluator
            w = tuple((size * self.wrench).tolist())
            add_wrench(p.packed.model, p.data, self.link, self.node, w[:3], w[3:])
            p.applied.append((self.at, size * self.wrench))
        return size * self.tau


def input_of(evaluator: Evaluator, name: str) -> Input:
    """Return the input that a name denotes, made at the first call.

    Raises
    ------
    InputError
        When the name is not known in the system.
    """
    known = evaluator.inputs
    if name not in known:
        known[name] = Input(evaluator, name)
    return known[name]


class Output(NamedTuple):
    """An output near a state; `value` is to be called after `Evaluator.accelerations`.

    Attributes
    ----------
    slopes : callable or None
        ``slopes(tree)`` returns its derivatives (3, nu) by the coordinates, speeds and accelerations of the tree.
    value : callable or None
        ``value(y)`` of what is recovered, which has no derivatives of its own.
    """

    slopes: Callable[[TreeTangent], np.ndarray] | None = None
    value: Callable[[np.ndarray], float] | None = None


def output(evaluator: Evaluator, name: str) -> Output:
    """Return the output that a name denotes; rotations are relative to the state.

    Coordinates and speeds by their names (``hinge.angle``, ``.rate``, ``.displacement``, ``.speed``, ``.angle.2`` the
    second, ``ball.rotation.1``, ``.angular_velocity.1``, ``body.modal.3``, ``.modal_rate.3``),
    ``body.stress.point.xx``, ``body.recovery.name.place.component``, ``body.interface.position.x``, ``.rotation``,
    ``.velocity``, ``.angular_velocity``, ``.acceleration`` and ``.angular_acceleration`` in inertial axes.

    Raises
    ------
    InputError
        When the name is not known in the system.
    """
    first, _, rest = name.partition(".")
    parts = name.rsplit(".", 2)
    if first in evaluator.system.bodies and rest.startswith(f"{RECOVERY}."):
        return Output(value=_recovered(evaluator, name))
    if len(parts) == 3 and parts[1] in MOTIONS and parts[2] in AXES:
        place = _interface(evaluator, parts[0], name)
        return Output(lambda tree: _motion(tree, *place, parts[1])[:, AXES.index(parts[2])])
    for part, names in enumerate(evaluator.names):
        known = {name, name.removesuffix(".1")}.intersection(names)
        if known:
            return _linear(evaluator, part, [names.index(known.pop())])
    if first in evaluator.system.bodies and rest.startswith("stress."):
        row = _stress(evaluator, first, rest.removeprefix("stress."), name)
        return _linear(evaluator, 0, _speeds_of(evaluator, ("body", first)), row)
    if first in [joint.name for joint in evaluator.system.joints]:
        known = [each.removeprefix(f"{first}.") for each in chain(*evaluator.names) if each.startswith(f"{first}.")]
        raise InputError(f"output {name!r}: {suggestion(rest, known, f'joint {first} has')}")
    raise InputError(
        f"output {name!r}: name 'joint.angle', 'body.modal.1', 'body.recovery.name.place.component', or "
        "'body.interface.position.x' with one of "
        f"{', '.join(MOTIONS)}"
    )


def _linear(evaluator: Evaluator, part: int, of: list[int], row: np.ndarray | float = 1.0) -> Output:
    """Return a sum of coordinates (part 0) or speeds (part 1)."""
    slopes = np.zeros((3, evaluator.nu))
    slopes[part, of] = row
    return Output(lambda tree: slopes)


def _speeds_of(evaluator: Evaluator, owner: tuple[str, str]) -> list[int]:
    return [k for k, own in enumerate(evaluator.owner) if own == owner]


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


def _stress(evaluator: Evaluator, body: str, component: str, name: str) -> np.ndarray:
    """Return the row (n,) of a stress by the modal coordinates."""
    points = evaluator.system.bodies[body].stress
    rows = {f"{p}.{c}": row for p, at in points.items() for c, row in zip(at.components, at.modes, strict=True)}
    if component not in rows:
        raise InputError(f"output {name!r}: {suggestion(component, rows, f'the linear stresses of {body} are')}")
    return rows[component]


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


def _motion(tree: TreeTangent, link: int, node: int, what: str) -> np.ndarray:
    """Return the derivatives (3, 3, nu) of a motion of an interface, by coordinates, speeds and accelerations."""
    at = tree.seen(link, node)
    turns = 3 * what.startswith(("rotation", "angular"))
    own = slice(turns, turns + 3)
    none = np.zeros_like(at.J)
    by = {"position": (at.J, none, none), "velocity": (at.V_x, at.J, none), "acceleration": (at.a_x, at.a_u, at.J)}
    parts = by["position" if what == "rotation" else what.removeprefix("angular_")]
    return np.stack([part[own] for part in parts])
