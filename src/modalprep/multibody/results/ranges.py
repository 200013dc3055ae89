"""Joints that leave the range that they are meant for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from modalprep.multibody.model.joint import Joint
from modalprep.multibody.model.joint_types import TRANSLATIONS

ROUNDING = 1e-9  # rad or m, of a joint that starts at its limit


def left_ranges(joints: Iterable[Joint], time: np.ndarray, coordinates: Mapping[str, np.ndarray]) -> tuple[str, ...]:
    """Return a note for each joint that is outside of its range at one of the times.

    Parameters
    ----------
    time : (nt,)
        s.
    coordinates : {joint: (nt,)}
        rad or m, of the joints that have a range.

    Examples
    --------
    >>> elbow = Joint(name="elbow", type="revolute", parent="ground", child="arm", range=(-1, 1))
    >>> for note in left_ranges([elbow], np.arange(3.0), {"elbow": np.array([0.0, 1.5, 1.25])}): print(note)
    joint 'elbow' leaves its range of -1 to 1 rad at t = 1 s, by up to 0.5 rad at t = 1 s; nothing stops it there:
    limits with a stiffness do
    """
    ranged = [joint for joint in joints if joint.range is not None]
    return tuple(note for joint in ranged if (note := _note(joint, time, coordinates[joint.name])))


def range_channel(joint: Joint) -> str:
    """Return the channel of the one coordinate of a joint.

    Examples
    --------
    >>> range_channel(Joint(name="slide", type="prismatic", parent="ground", child="arm", range=(0, 1)))
    'slide.displacement'
    """
    return f"{joint.name}.{'displacement' if joint.type in TRANSLATIONS else 'angle'}"


def _note(joint: Joint, time: np.ndarray, value: np.ndarray) -> str:
    low, high = joint.range or (-np.inf, np.inf)
    beyond = np.maximum(low - value, value - high)
    most = int(np.argmax(beyond))
    if not beyond[most] > ROUNDING:
        return ""
    unit = "m" if joint.type in TRANSLATIONS else "rad"
    return (
        f"joint {joint.name!r} leaves its range of {low:.4g} to {high:.4g} {unit} at t = "
        f"{time[np.argmax(beyond > ROUNDING)]:.4g} s, by up to {beyond[most]:.3g} {unit} at t = {time[most]:.4g} s; "
        "nothing stops it there: limits with a stiffness do"
    )
