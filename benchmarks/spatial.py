"""Closed loops of rigid bodies that leave every plane, drawn where they are closed, for `scissor.py`."""

from __future__ import annotations

import numpy as np

import modalprep as mp
from modalprep.multibody.model.constraints import Closure

X, Y, Z = np.eye(3)
GRAVITY = np.array([0, 0, -9.81])
A, B, C, D = np.array([[0, 0, 0], [0, 0.4, 0.3], [1.5, 0.2, 1.0], [1.6, -0.5, 0.1]])  # of a crank, coupler, rocker


def rod(start: np.ndarray, end: np.ndarray) -> mp.body.FlexibleBody:
    """Return a rod of 1 kg between two points, in the axes of space."""
    along = end - start
    inertia = (along @ along * np.eye(3) - np.outer(along, along)) / 12 + 0.01 * np.eye(3)
    ends = {"root": np.zeros(3), "tip": along}
    return mp.rigid_body("rod", mass=1.0, centre=along / 2, inertia=inertia, interfaces=ends)


def four_bar() -> mp.System:
    """Return a crank and a rocker on skew axes, and a coupler on ball joints: one of the tree, the other closes it."""
    bodies = {"crank": rod(A, B), "coupler": rod(B, C), "rocker": rod(D, C)}
    joints = (
        mp.Joint(name="crank", type="revolute", parent="ground", child="crank", axis=X, position=A),
        mp.Joint(name="ball", type="spherical", parent="crank.tip", child="coupler"),
        mp.Joint(name="rocker", type="revolute", parent="ground", child="rocker", axis=Y, position=D),
    )
    pin = Closure(name="pin", type="spherical", a="rocker.tip", b="coupler.tip")
    return mp.System(bodies=bodies, joints=joints, closures=(pin,), gravity=GRAVITY)


def slider_crank() -> mp.System:
    """Return a crank with a rod on a universal joint, whose end slides along a tilted line."""
    bodies = {"crank": rod(A, B), "rod": rod(B, C)}
    joints = (
        mp.Joint(name="crank", type="revolute", parent="ground", child="crank", axis=X, position=A),
        mp.Joint(name="cross", type="universal", parent="crank.tip", child="rod", axis=Y, second_axis=Z),
    )
    line = Closure(name="line", type="point_on_line", a="ground", b="rod.tip", axis=X + 0.2 * Y, position=C)
    return mp.System(bodies=bodies, joints=joints, closures=(line,), gravity=GRAVITY)


def bennett(a: float = 1.0, b: float = 1.5, twist: float = 0.6, angle: float = 0.8) -> mp.System:
    """Return four links with sines of their twists in proportion to their lengths (Bennett 1903), closed by a hinge."""
    other = np.arcsin(b / a * np.sin(twist))
    between = 2 * np.arctan(np.sin((other + twist) / 2) / np.sin((other - twist) / 2) / np.tan(angle / 2))
    turn, place, axes, places = np.eye(3), np.zeros(3), [], []
    for about_z, along, about_x in ((angle, a, twist), (between, b, other), (-angle, a, twist), (-between, b, other)):
        axes.append(turn[:, 2])
        places.append(place)
        turn = turn @ _turn(about_z, 2)
        place = place + along * turn[:, 0]
        turn = turn @ _turn(about_x, 0)
    bodies = {f"b{k}": rod(places[k], places[k + 1]) for k in range(3)}
    joints = tuple(
        mp.Joint(name=f"j{k}", type="revolute", parent=parent, child=f"b{k}", axis=axes[k])
        for k, parent in enumerate(("ground", "b0.tip", "b1.tip"))
    )
    hinge = Closure(name="hinge", type="revolute", a="b2.tip", b="ground", axis=axes[3], position=places[3])
    return mp.System(bodies=bodies, joints=joints, closures=(hinge,), gravity=GRAVITY)


def hexapod() -> mp.System:
    """Return a platform on six telescopic legs, each on a universal joint; five hold it by closures."""
    angles, shifts = np.arange(6) * np.pi / 3, np.array([1, -1] * 3)
    feet = [1.5 * np.array([np.cos(x), np.sin(x), 0]) for x in angles + 0.1 * shifts]
    tops = [np.array([0.8 * np.cos(x), 0.8 * np.sin(x), 1.5]) for x in angles - 0.3 * shifts]
    ends = {f"p{k}": top - tops[0] for k, top in enumerate(tops)}
    platform = mp.rigid_body("plate", mass=10.0, centre=1.5 * Z - tops[0], inertia=10 * np.eye(3), interfaces=ends)
    bodies, joints, closures = {}, [], []
    for k, (foot, top) in enumerate(zip(feet, tops, strict=True)):
        middle, along = (foot + top) / 2, top - foot
        across = np.cross(along, X)
        bodies |= {f"low{k}": rod(foot, middle), f"high{k}": rod(middle, top)}
        foot_at = {"axis": across, "second_axis": np.cross(along, across), "position": foot}
        joints += [
            mp.Joint(name=f"foot{k}", type="universal", parent="ground", child=f"low{k}", **foot_at),
            mp.Joint(name=f"leg{k}", type="prismatic", parent=f"low{k}.tip", child=f"high{k}", axis=along),
        ]
        closures.append(Closure(name=f"top{k}", type="spherical", a=f"high{k}.tip", b=f"platform.p{k}"))
    joints.append(mp.Joint(name="top", type="spherical", parent="high0.tip", child="platform"))
    system = {"bodies": bodies | {"platform": platform}, "joints": tuple(joints)}
    return mp.System(**system, closures=tuple(closures[1:]), gravity=GRAVITY)


def _turn(angle: float, k: int) -> np.ndarray:
    """Return the rotation about axis k."""
    c, s, (i, j) = np.cos(angle), np.sin(angle), [(1, 2), (2, 0), (0, 1)][k]
    found = np.eye(3)
    found[i, i], found[i, j], found[j, i], found[j, j] = c, -s, s, c
    return found
