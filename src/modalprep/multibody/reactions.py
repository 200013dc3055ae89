"""What joints carry and how interfaces accelerate: channels of one evaluated state."""

from __future__ import annotations

import numpy as np

from modalprep.multibody import kernel
from modalprep.multibody.dense import BodyState, node_motion
from modalprep.multibody.layout import Packed, Scratch
from modalprep.multibody.system import System


def joint_wrenches(
    system: System, packed: Packed, reactions: np.ndarray, states: dict[str, BodyState]
) -> dict[str, np.ndarray]:
    """Return ``joint.force`` (N) and ``joint.torque`` (N m): what a parent exerts on its child, at the child's root.

    In the axes of the parent's interface (inertial for the ground), hinge forces of springs and actuators included.

    Parameters
    ----------
    reactions : (nl, 6)
        Of `kernel.reactions`.
    states : dict of BodyState
        Motion of the bodies by name.
    """
    found = {}
    for joint in system.joints:
        child, parent = system.child(joint), system.parent(joint)
        i = packed.link_of(child)
        to_parent = states[child].R @ packed.align(i)
        if parent is not None:
            s = states[parent[0]]
            turn = node_motion(s.body, parent[1], s.V[3:], s.q, s.qd)[1]
            to_parent = (s.R @ turn).T @ to_parent
        found[f"{joint.name}.force"] = to_parent @ reactions[i, :3]
        found[f"{joint.name}.torque"] = to_parent @ reactions[i, 3:]
    return found


def interface_accelerations(system: System, packed: Packed, W: np.ndarray, F: Scratch | None) -> dict[str, np.ndarray]:
    """Return ``body.interface.acceleration`` (m/s^2, inertial), after `kernel.forward` and `kernel.world`."""
    found = {}
    for name, body in system.bodies.items():
        for k, interface in enumerate(body.interface_name):
            linear, _ = kernel.node_acceleration(packed.tree, packed.flex, W, F, packed.link_of(name), k, 1.0)
            found[f"{name}.{interface}.acceleration"] = np.array(linear) + system.gravity
    return found
