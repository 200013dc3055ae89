"""Recovered quantities of bodies as channels: from their motion and the loads on their interfaces (theory 4.9)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import scipy

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.recovery import BodyMotion, at_rest
from modalprep.multibody.model.constraints import Coupler
from modalprep.multibody.model.loads import AxialSpring, PointForce
from modalprep.multibody.model.system import System

MOST = 1000  # numbers of a recovery with a history each; larger ones have envelopes and films
Channels = Mapping[str, np.ndarray]


class AppliedLoad(NamedTuple):
    """Force (N) and torque (N m) on ``body.interface`` that no load of the system is: (nt, 3), inertial axes."""

    at: str
    force: np.ndarray
    torque: np.ndarray


def recovery_channels(
    system: System, time: np.ndarray, channels: Channels, applied: Sequence[AppliedLoad] = ()
) -> dict[str, np.ndarray]:
    """Return ``<body>.interface_loads`` and ``<body>.recovery.<name>.<place>.<component>`` of every body.

    Examples
    --------
    >>> from modalprep.body.recovery import Recovery
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> root = Recovery(kind="force", places=("a",), components=("N",), units=("N",), q=np.array([[[2.0]]]))
    >>> arm = uniform_beam(modes=1).with_(recovery={"root": root})
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> system = System(bodies={"arm": arm}, joints=(hinge,))
    >>> recovery_channels(system, np.zeros(2), {"arm.modal": np.array([[1.0], [3.0]])})
    {'arm.recovery.root.a.N': array([2., 6.])}
    """
    found: dict[str, np.ndarray] = {}
    for name, body in system.bodies.items():
        complete = f"{name}.modal_acceleration" in channels
        if complete:
            found[f"{name}.interface_loads"] = interface_loads(system, name, time, channels, applied)
        small = {
            key: block
            for key, block in body.recovery.items()
            if body.n and block.q.size <= MOST * body.n and (complete or not block.moves)
        }
        if small:
            rows = body.with_(recovery=small).recovered(body_motion(body, name, {**channels, **found}))
            found |= {f"{name}.recovery.{key}": values for key, values in rows.items()}
    return found


def body_motion(body: FlexibleBody, name: str, channels: Channels) -> BodyMotion:
    """Return the motion of a body in a run, of the `channels` of the result; at rest but for q where it has no more.

    Parameters
    ----------
    body : FlexibleBody
    name : str
        Of the body in the system.
    channels : {name: (nt,) or (nt, k)}
        ``Result.channels``.

    Returns
    -------
    BodyMotion
        In the axes of the body.
    """
    q = channels[f"{name}.modal"]
    if f"{name}.modal_acceleration" not in channels:
        return at_rest(q, len(body.interface_name))
    parts = ("modal_rate", "modal_acceleration", "frame_acceleration", "frame_angular_velocity")
    qd, qdd, A, omega = (channels[f"{name}.{part}"] for part in parts)
    loads = channels[f"{name}.interface_loads"].reshape(len(q), len(body.interface_name), 6)
    return BodyMotion(q, qd, qdd, A, omega, channels[f"{name}.frame_angular_acceleration"], loads)


def interface_loads(
    system: System, body: str, time: np.ndarray, channels: Channels, applied: Sequence[AppliedLoad] = ()
) -> np.ndarray:
    """Return force and moment on each interface of a body ``(nt, 6 n_if)``, in its axes, N and N m.

    Of the joints to its children, closures, axial springs, point forces and those `applied`; interfaces turn with the
    body. What acts
    on the root is left out: its column of every recovery matrix is zero.
    """
    names = system.bodies[body].interface_name
    total = np.zeros((len(time), len(names), 6))
    given = [(at, force, torque, None) for at, force, torque in applied]
    for at, force, torque, point in [*_loads(system, body, time, channels), *given]:
        owner, _, interface = at.rpartition(".")
        if owner == body and interface in names[1:]:
            arm = np.zeros_like(force) if point is None else point - channels[f"{at}.position"]
            both = _to_body(channels, body, force), _to_body(channels, body, torque + np.cross(arm, force))
            total[:, names.index(interface)] += np.hstack(both)
    return total.reshape(len(time), 6 * len(names))


def _loads(system: System, body: str, time: np.ndarray, channels: Channels):
    """Yield interface, force and torque (nt, 3), inertial axes, and the point (nt, 3) where they act or None.

    Of joints those of the body alone.
    """
    for joint in system.joints:
        parent = system.parent(joint)
        if parent is not None and parent[0] == body:
            owner, index = parent
            at = f"{owner}.{system.bodies[owner].interface_name[index]}"
            child = system.child(joint)
            root = f"{child}.{system.bodies[child].interface_name[0]}.position"
            force, torque = (_to_world(channels, owner, channels[f"{joint.name}.{x}"]) for x in ("force", "torque"))
            yield at, -force, -torque, channels[root]
    for closure in system.closures:
        if not isinstance(closure, Coupler):
            force, torque = (_of_end(channels, closure.a, channels[f"{closure.name}.{x}"]) for x in ("force", "torque"))
            point = channels.get(f"{closure.b}.position", np.broadcast_to(closure.position, force.shape))
            yield closure.b, force, torque, None
            yield closure.a, -force, -torque, point
    for load in system.loads:
        if isinstance(load, PointForce):
            force, torque = (_at_times(three, time) for three in (load.force, load.torque))
            if load.axes == "body":
                force, torque = (_of_end(channels, load.at, x) for x in (force, torque))
            yield load.at, force, torque, None
        elif isinstance(load, AxialSpring):
            yield from _spring(load, channels)


def _spring(load: AxialSpring, channels: Channels):
    tension = channels[f"{load.name}.tension"]
    a, b = (channels.get(f"{end}.position", load.position + np.zeros((len(tension), 3))) for end in load.between)
    length = np.linalg.norm(b - a, axis=1, keepdims=True)
    force = tension[:, None] * (b - a) / np.where(length > 0, length, 1.0)
    yield load.between[0], force, np.zeros_like(force), None
    yield load.between[1], -force, np.zeros_like(force), None


def _at_times(three: tuple, time: np.ndarray) -> np.ndarray:
    return np.array([[f(t)[0] for f in three] for t in time.tolist()]).reshape(len(time), 3)


def _of_end(channels: Channels, end: str, vector: np.ndarray) -> np.ndarray:
    """Turn vectors (nt, 3) from the axes of an interface's body, or of the ground, to inertial axes."""
    owner = end.rpartition(".")[0]
    return _to_world(channels, owner, vector) if owner else vector


def _to_world(channels: Channels, body: str, vector: np.ndarray) -> np.ndarray:
    return _turned(channels, body, vector, inverse=False)


def _to_body(channels: Channels, body: str, vector: np.ndarray) -> np.ndarray:
    return _turned(channels, body, vector, inverse=True)


def _turned(channels: Channels, body: str, vector: np.ndarray, inverse: bool) -> np.ndarray:
    if not len(vector):
        return vector
    turn = scipy.spatial.transform.Rotation.from_quat(channels[f"{body}.orientation"], scalar_first=True)
    return turn.apply(np.array(vector), inverse=inverse)  # scipy takes no read-only arrays
