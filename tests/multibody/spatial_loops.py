"""Single closed loops of joints in space, drawn where they are closed: there bodies have the axes of space."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from closures import closure_of
from compare import assert_close
from multibody.trees import axes_of

import modalprep as mp


class Pair(NamedTuple):
    """A joint of a loop in its drawn position: type, a point of its axis, its axis, the second of a universal joint."""

    type: str
    place: np.ndarray
    axis: np.ndarray
    second: np.ndarray | None = None


def rod(start, end, mass=1.0, thickness=0.1):
    """A uniform rod between two points, with some inertia about itself."""
    along = end - start
    inertia = mass / 12 * (along @ along * np.eye(3) - np.outer(along, along)) + mass * thickness**2 * np.eye(3)
    frames = {"root": np.zeros(3), "tip": along}
    return mp.rigid_body("rod", mass=mass, centre=along / 2, inertia=inertia, interfaces=frames)


def spatial_loop(pairs, bodies, *, rates=None, gravity=(0, 0, -9.81)):
    """The ground, bodies and the ground again: the last pair closes the loop, `rates` are those of the first joints.

    bodies : function of the places at which a body begins and ends.
    """
    names = [f"b{i}" for i in range(1, len(pairs))]
    found = {name: bodies(a.place, b.place) for name, a, b in zip(names, pairs[:-1], pairs[1:], strict=True)}
    joints = []
    for i, (name, pair) in enumerate(zip(names, pairs[:-1], strict=True)):
        options = {"position": pair.place} if i == 0 else {}
        options |= axes_of(pair.type, pair.axis, pair.second)
        if rates is not None and i < len(rates) and pair.type in ("revolute", "prismatic"):
            options |= {"rate" if pair.type == "revolute" else "speed": rates[i]}
        parent = "ground" if i == 0 else f"{names[i - 1]}.tip"
        joints.append(mp.Joint(name=f"j{i}", type=pair.type, parent=parent, child=name, **options))
    last = pairs[-1]
    place = {"a": f"{names[-1]}.tip", "b": "ground", "position": last.place}
    closure = closure_of(name="pin", type=last.type, axis=last.axis, second_axis=last.second, **place)
    return mp.System(bodies=found, joints=tuple(joints), closures=(closure,), gravity=np.array(gravity, dtype=float))


def bricard(angle):
    """Trihedral linkage of Bricard (1927): six links of one metre, twists of a right angle to either side in turn.

    Angles alternate, ``cos one + cos other + cos one cos other = 0``.
    """
    other = np.arccos(-np.cos(angle) / (1 + np.cos(angle)))
    pose, pairs = np.eye(4), []
    for twist, turn in [(np.pi / 2, angle), (-np.pi / 2, other)] * 3:
        pairs.append(Pair("revolute", pose[:3, 3].copy(), pose[:3, 2].copy()))
        pose = pose @ _screw(2, turn, 0.0) @ _screw(0, twist, 1.0)
    assert_close(pose, np.eye(4), 1e-14)  # round-off of twelve products
    return pairs


def bennett(a, b, twist, angle):
    """Four links of lengths a, b, a, b: the sines of their twists are in proportion (Bennett 1903)."""
    other = np.arcsin(b / a * np.sin(twist))
    half = np.sin((other + twist) / 2) / np.sin((other - twist) / 2) / np.tan(angle / 2)
    between, pose, pairs = 2 * np.arctan(half), np.eye(4), []
    for turn, along, bent in [(angle, a, twist), (between, b, other), (-angle, a, twist), (-between, b, other)]:
        pairs.append(Pair("revolute", pose[:3, 3].copy(), pose[:3, 2].copy()))
        pose = pose @ _screw(2, turn, 0.0) @ _screw(0, bent, along)
    assert_close(pose, np.eye(4), 1e-12)  # round-off by the flattest link
    return pairs


def planar(points, turn):
    """Revolute pairs normal to a plane that is turned in space, through points (x, y) of it."""
    return [Pair("revolute", turn @ np.array([x, y, 0.0]), turn[:, 2]) for x, y in points]


def _screw(k, angle, along):
    """Turn about axis k and go along it."""
    c, s = np.cos(angle), np.sin(angle)
    found, (a, b) = np.eye(4), [(1, 2), (2, 0), (0, 1)][k]
    found[a, a], found[a, b], found[b, a], found[b, b], found[k, 3] = c, -s, s, c, along
    return found
