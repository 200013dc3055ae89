"""The linear equations of a system about a steady rotation of one joint, at equal angles of a turn.

They repeat themselves after a turn, since the coordinates of the rotor turn with it and its supports do not. Where all
supports are the same in every direction across the axis, or the rotor does not turn, they are constant.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from modalprep.errors import InputError, SimulationError
from modalprep.multibody.analysis.inputs_outputs import AXES
from modalprep.multibody.analysis.linearise import linearise
from modalprep.multibody.analysis.state_space import StateSpace
from modalprep.multibody.analysis.steady import steady_state
from modalprep.multibody.analysis.tangent import Tangent, slowest
from modalprep.multibody.evaluation.evaluator import Evaluator
from modalprep.multibody.model.joint import Joint
from modalprep.multibody.model.joint_types import KINDS
from modalprep.multibody.model.system import System
from modalprep.multibody.model.time_function import TimeFunction
from modalprep.suggest import refuse_other, refuse_unknown
from modalprep.vectors import VectorLike, vector

SPINS = ("revolute", "cylindrical", "spherical", "free")
ANGLES = (5, 8, 16, 32, 64)  # of a turn
UNSTEADY = 1e-6  # of the square of the speed: the acceleration of a steady motion is below it
CONSTANT = 1e-8  # change of the equations with the angle, of their largest entries, below which it is round-off


@dataclass(frozen=True, eq=False, kw_only=True)
class Turn:
    """Linear equations ``E z' = F z`` at equal angles of a turn, and the motion ``C x`` of the interfaces.

    ``z = (x, u)``, coordinates and speeds that turn with the rotor, both scaled: coordinates by their stiffness, time
    by `rate`. One angle alone where E and F are constant.

    Attributes
    ----------
    speed : float
        rad/s.
    axis : (3,)
        Unit vector of the spin, inertial.
    rate : float
        1/s, of the order of the slowest vibration: the unit of time of E and F.
    E, F : (angles, 2 n, 2 n)
    C : (angles, 6 ni, n)
        Displacement (m), then rotation (rad) times the size of the system (m), of each interface, inertial axes.
    interfaces : tuple of str
        ``body.interface``.
    on_rotor : (ni,) bool
        Whether they are of bodies that turn with the joint.
    size : float
        m.
    notes : tuple of str
    """

    speed: float
    axis: np.ndarray
    rate: float
    E: np.ndarray
    F: np.ndarray
    C: np.ndarray
    interfaces: tuple[str, ...]
    on_rotor: np.ndarray
    size: float
    notes: tuple[str, ...]


class Spinning:
    """A system without weight whose joint turns at a steady speed.

    Parameters
    ----------
    joint : str
        A revolute, cylindrical, spherical or free joint.
    speed : float
        rad/s.
    axis : (3,) or None
        Of the spin, in the parent's frame; default: the axis of the joint, or the direction of its angular velocity.

    Raises
    ------
    InputError
        When there is no such joint, it cannot spin, or has no axis.
    SimulationError
        When there is no steady state.
    """

    def __init__(self, system: System, joint: str, speed: float, axis: VectorLike | None = None) -> None:
        refuse_other("the rotor's system", System, system)
        own = _spin_joint(system, joint)
        self.speed = float(speed)
        self.axis = _axis(own, axis)
        self.is_prescribed = own.motion is not None
        self.system = system.with_(
            gravity=np.zeros(3),
            joints=tuple(_spinning(each, self.axis, self.speed) if each is own else each for each in system.joints),
        )
        self.evaluator = Evaluator(self.system)
        self.y = steady_state(self.system)
        self.joint = own
        self.has_weight = bool(np.any(system.gravity))

    def at(self, angle: float) -> tuple[np.ndarray, float]:
        """Return the state with the joint turned by an angle (rad), and the time for which functions of time hold."""
        y = self.y.copy()
        packed = self.evaluator.packed
        for i, (link, (code, x, _, _)) in enumerate(zip(packed.links, packed.columns, strict=True)):
            if link.joint.name != self.joint.name:
                continue
            kind = KINDS[code]
            if kind.quaternion >= 0:
                q = slice(x + kind.quaternion, x + kind.quaternion + 4)
                turned = Rotation.from_rotvec(angle * self.axis) * Rotation.from_quat(y[q], scalar_first=True)
                y[q] = turned.as_quat(scalar_first=True)
            elif packed.turns(i):
                y[x] += angle
        return y, angle / self.speed if self.is_prescribed and self.speed else 0.0

    def orientation(self, body: str) -> np.ndarray:
        """Return that of a body at the start (3, 3), its axes to the inertial ones."""
        packed, data = self.evaluator.packed, self.evaluator.data
        self.evaluator.load(self.y)
        link = packed.link_of(body)
        own, align = (
            each.reshape(3, 3) for each in (data.links["orientation"][link], packed.model.links["align"][link])
        )
        return own @ align.T

    def linear(self, angle: float, outputs: list[str]) -> StateSpace:
        """Return the linear equations at an angle (rad) of the rotor."""
        y, t = self.at(angle)
        return linearise(self.system, y, t, outputs=outputs)


def _spin_joint(system: System, name: str) -> Joint:
    refuse_unknown(name, [joint.name for joint in system.joints], "the rotor's joint")
    joint = next(joint for joint in system.joints if joint.name == name)
    if joint.type not in SPINS:
        raise InputError(f"joint {name!r} is {joint.type}; a rotor spins in one of {', '.join(SPINS)}")
    return joint


def _axis(joint: Joint, axis: VectorLike | None) -> np.ndarray:
    """Return the direction of the spin in the parent's frame."""
    fixed = joint.type in ("revolute", "cylindrical")
    if fixed and axis is not None:
        raise InputError(f"joint {joint.name!r} has an axis of its own; leave out the axis of the rotor")
    found = joint.axis if fixed else joint.rotation @ joint.angular_velocity if axis is None else vector(axis)
    size = np.linalg.norm(found)
    if not size:
        raise InputError(f"joint {joint.name!r} is {joint.type} and does not turn at the start; give the rotor's axis")
    return found / size


def _spinning(joint: Joint, axis: np.ndarray, speed: float) -> Joint:
    """Return the joint that turns at a speed (rad/s)."""
    if joint.motion is not None:
        if joint.type != "revolute":
            raise InputError(f"joint {joint.name!r}: the motion of a {joint.type} joint is prescribed; leave it free")
        return joint.with_(motion=TimeFunction(f"{speed!r}*t"))
    if joint.type in ("revolute", "cylindrical"):
        return joint.with_(rate=speed)
    return joint.with_(angular_velocity=speed * joint.rotation.T @ axis)


def turn(spinning: Spinning) -> Turn:
    """Return the linear equations over a turn, at as many angles as they need.

    Raises
    ------
    SimulationError
        When they change too fast with the angle, or do not exist.
    """
    bodies = spinning.system.bodies
    interfaces = tuple(f"{name}.{end}" for name, body in bodies.items() for end in body.interface_name)
    outputs = [f"{end}.{what}.{axis}" for end in interfaces for what in ("position", "rotation") for axis in AXES]
    constant = True
    for count in ANGLES if spinning.speed else (1,):
        found = [spinning.linear(2 * np.pi * k / count, outputs) for k in range(count)]
        rate, S = _scales(found[0].equations)
        pencils = [_pencil(each.equations, rate, S) for each in found]
        E, F = (np.array(each) for each in zip(*pencils, strict=True))
        constant = _varies(E, F) <= CONSTANT
        if constant or _is_resolved(E, F):
            break
    else:
        raise SimulationError(f"the equations of the rotor are not resolved by {ANGLES[-1]} angles of a turn")
    linear = found[0]
    size = spinning.evaluator.size
    units = np.tile(np.repeat([1.0, size], 3), len(interfaces))[:, None]
    return Turn(
        speed=spinning.speed,
        axis=_inertial_axis(spinning, linear),
        rate=rate,
        E=E[:1] if constant else E,
        F=F[:1] if constant else F,
        C=np.array([each.C[:, : len(S)] for each in found]) * units * S,
        interfaces=interfaces,
        on_rotor=_on_rotor(spinning, interfaces),
        size=size,
        notes=(*linear.notes, *_notes(spinning, linear, rate)),
    )


def _notes(spinning: Spinning, linear: StateSpace, rate: float) -> list[str]:
    """Return what is left out, and whether the rotation is a steady motion."""
    notes = []
    if spinning.has_weight:
        notes.append("weight is left out of the whirl: the rotor is taken as straight between its supports")
    acceleration = np.abs(linear.udot / spinning.evaluator.scale).max(initial=0.0)
    if acceleration > UNSTEADY * max(spinning.speed, rate) ** 2:
        notes.append(
            "the rotor does not turn steadily about its axis, as one that is not balanced does not: motions are those "
            "about this rotation, small ones"
        )
    return notes


def _on_rotor(spinning: Spinning, interfaces: tuple[str, ...]) -> np.ndarray:
    """Return which interfaces (ni,) are of the child of the joint, or of what hangs on it."""
    turning = {_body(spinning.joint.child)}
    for _ in spinning.system.joints:  # as many as it may be links away
        turning |= {_body(joint.child) for joint in spinning.system.joints if _body(joint.parent) in turning}
    return np.array([_body(name) in turning for name in interfaces])


def _body(end: str) -> str:
    return end.partition(".")[0]


def _inertial_axis(spinning: Spinning, linear: StateSpace) -> np.ndarray:
    """Return the unit vector of the spin in inertial axes, about which the angle of a hinge turns its child."""
    joint = spinning.joint
    if joint.parent == "ground":
        return spinning.axis
    body = _body(joint.child)
    child = f"{body}.{spinning.system.bodies[body].interface_name[0]}"
    angle = f"{joint.name}.angle"
    if angle not in linear.states:
        raise InputError(f"the rotor's joint {joint.name!r} hangs on a body; it has to be a hinge that no loop moves")
    rows = [linear.outputs.index(f"{child}.rotation.{axis}") for axis in AXES]
    axis = linear.C[rows, linear.states.index(angle)]
    return axis / np.linalg.norm(axis)


def _scales(t: Tangent) -> tuple[float, np.ndarray]:
    """Return a rate (1/s) of the order of the slowest vibration, and the units of the coordinates (n,)."""
    rate = slowest(t)
    return rate, 1 / np.sqrt(np.abs(np.diag(t.K)) + rate**2 * np.diag(t.M))


def _pencil(t: Tangent, rate: float, S: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return E and F (2 n, 2 n) in these units."""
    one = np.eye(len(S))
    M, D, K = (X * S * S[:, None] for X in (rate**2 * t.M, rate * t.D, t.K))
    E = np.block([[one, np.zeros_like(M)], [np.zeros_like(M), M]])
    F = np.block([[t.N * S / (S[:, None] * rate), one], [-K, -D]])
    return E, F


def _varies(*matrices: np.ndarray) -> float:
    """Return by how much matrices change with the angle, relative to their largest entries."""
    return max(float(np.ptp(each, axis=0).max(initial=0.0) / np.abs(each).max()) for each in matrices)


def _is_resolved(*matrices: np.ndarray) -> bool:
    """Whether the harmonics of the matrices over a turn end below half of those that the angles tell apart."""
    for each in matrices:
        harmonics = np.abs(np.fft.rfft(each, axis=0)).reshape(len(each) // 2 + 1, -1).max(axis=1) / len(each)
        if harmonics[len(harmonics) // 2 + 1 :].max(initial=0.0) > CONSTANT * np.abs(each).max():
            return False
    return True
