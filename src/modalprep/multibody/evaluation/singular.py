"""Why motions have no inertia, in one sentence."""

from __future__ import annotations

import numpy as np

from modalprep.multibody.model.system import System
from modalprep.multibody.packing.packed import Packed

LOCKED = 1e-3  # cosine of the second angle of a gimbal


def without_inertia(system: System, packed: Packed, y: np.ndarray, body: str) -> str:
    """Return the sentence of a rigid body that moves without any inertia at a state: a locked gimbal, or no inertia."""
    return gimbal_lock(system, packed, y) or (
        f"body {body!r} can turn or move without any mass or inertia that resists; give it an inertia about "
        "its centre of mass, or a joint that does not leave that motion free"
    )


def gimbal_lock(system: System, packed: Packed, y: np.ndarray) -> str:
    """Return the sentence of a gimbal whose first and third axes are parallel at a state; "" where there is none."""
    for joint in system.joints:
        places = packed.coordinates_of(joint.name) if joint.type == "gimbal" else []
        if len(places) == 3 and abs(np.cos(y[places[1]])) < LOCKED:
            return (
                f"gimbal {joint.name!r} is locked: its second angle is {np.degrees(y[places[1]]):.4g} deg, where its "
                "first and third axes are parallel; use a spherical joint, or other axes"
            )
    return ""
