"""The start values of joints that a state has."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from modalprep.multibody.model.joint_types import KINDS
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.tree import pack


def with_start_values(system: System, y: np.ndarray) -> System:
    """Return a system whose joints start at a state ``y (nx + nu,)``; modes start at rest.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> arm = System(bodies={"arm": uniform_beam(modes=1)}, joints=(hinge,))
    >>> with_start_values(arm, np.array([0.5, 0.0, 2.0, 0.0])).joints[0].angle
    0.5
    """
    packed = pack(system)
    found: dict[str, dict[str, Any]] = {joint.name: {} for joint in system.joints}
    for i, (link, (code, x, u, _)) in enumerate(zip(packed.links, packed.columns, strict=True)):
        kind = KINDS[code]
        own = found[link.joint.name]
        if kind.named:
            place, rate = ("angle", "rate") if packed.turns(i) else ("displacement", "speed")
            own.setdefault(place, []).append(float(y[x]))
            own.setdefault(rate, []).append(float(y[packed.nx + u]))
        elif kind.quaternion >= 0:
            q = x + kind.quaternion
            turning = packed.nx + u + kind.translations
            own["rotation"] = Rotation.from_quat(y[q : q + 4], scalar_first=True).as_matrix()
            own["angular_velocity"] = y[turning : turning + 3]
            if kind.translations:
                own["position"] = y[x:q]
                own["velocity"] = y[packed.nx + u : turning]
    return system.with_(joints=tuple(joint.with_(**_plain(found[joint.name])) for joint in system.joints))


def _plain(values: dict[str, Any]) -> dict[str, Any]:
    """Return single numbers in place of lists of one."""
    return {
        key: each[0] if isinstance(each, list) and len(each) == 1 else np.array(each) for key, each in values.items()
    }
