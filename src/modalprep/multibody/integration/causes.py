"""Which element of a joint changes fastest with the motion."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from modalprep.multibody.model.joint_element import HingeElement
from modalprep.multibody.reference.equations import mass_and_force


def fastest_element(run: Any, t: float) -> tuple[float, str]:
    """Return the highest rate (1/s) at which an element of a joint changes with the motion, and its words."""
    M, _ = mass_and_force(run.system.at(t), run.steps.y[:-1], run.loading.prescribe(t))
    mobility = np.diag(np.linalg.pinv(M))
    found = [
        (rate, f"{words} of joint {joint.name!r}")
        for joint in run.system.joints
        for element, u in zip(joint.elements, run.packed.speeds_of(joint.name), strict=False)
        for rate, words in _rates(element, float(mobility[u]))
    ]
    return max(found, default=(0.0, ""))


def _rates(e: HingeElement, mobility: float) -> Iterator[tuple[float, str]]:
    """Yield the rates of one element, whose coordinate has a mobility (1/kg or 1/(kg m^2))."""
    if e.friction:
        words = f"the friction, of a transition velocity of {e.transition_velocity:g},"
        yield e.friction / e.transition_velocity * mobility, words
    yield e.damping * mobility, "the damping"
    yield np.sqrt(e.stiffness * mobility), "the stiffness"
    if e.limited:
        yield np.sqrt(e.limit_stiffness * mobility), "the stiffness of the limits"
        yield e.limit_damping * mobility, "the damping of the limits"
