"""Motions on which the step control is measured: chains, loops, spins, slews, impacts; soft, stiff and rigid."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import peers_flexible
from integrators import chain, link

import modalprep as mp
from modalprep.examples import uniform_beam
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.load import load
from modalprep.pipeline.systems.read import read_system

PIPELINES = Path(__file__).parents[1] / "pipelines"
GRAVITY = np.array([0, -9.81, 0])
SPIN_UP = [(15, "0.4*(t**2/2 + (7.5/pi)**2*(cos(pi*t/7.5) - 1))"), (np.inf, "6*t - 45")]  # Simo and Vu-Quoc (1986)
BACK = np.diag([-1.0, -1.0, 1.0])  # half a turn about z


class Motion(NamedTuple):
    """A system, the channel that is followed (m), its time (s), and its events."""

    system: mp.System
    followed: str
    t_end: float
    events: tuple[mp.Event, ...] = ()


def rod(length: float, mass: float = 1.0, name: str = "rod") -> mp.body.RigidBody:
    """Return a slender rod from its root to its tip."""
    ends = {"root": np.zeros(3), "tip": np.array([length, 0, 0])}
    inertia = mass * np.diag([1e-3 * length**2, length**2 / 12, length**2 / 12])
    return mp.rigid_body(name, mass=mass, centre=np.array([length / 2, 0, 0]), inertia=inertia, interfaces=ends)


def hinge(name: str, parent: str, child: str, **options) -> mp.Joint:
    """Return a hinge about z."""
    return mp.Joint(name=name, type="revolute", parent=parent, child=child, **options)


def swing(modes: int) -> Motion:
    """Return five links that fall from level."""
    case = peers_flexible.swing(modes)
    return Motion(peers_flexible.system(case), "b4.tip.position", case.t_end)


def slider_crank(modes: int) -> Motion:
    """Return a flexible slider crank that falls."""
    case = peers_flexible.slider_crank(modes)
    return Motion(peers_flexible.system(case), "b0.tip.position", case.t_end)


def rigid_slider_crank() -> Motion:
    """Return the same of rigid rods."""
    system = peers_flexible.system(peers_flexible.slider_crank(6))
    return Motion(system.with_(bodies={"b0": rod(0.3), "b1": rod(0.5)}), "b0.tip.position", 1.0)


def double_pendulum() -> Motion:
    """Return two rigid rods."""
    joints = hinge("a", "ground", "upper"), hinge("b", "upper.tip", "lower", angle=0.5)
    system = mp.System(bodies={"upper": rod(1.0), "lower": rod(1.0)}, joints=joints, gravity=GRAVITY)
    return Motion(system, "lower.tip.position", 2.0)


def spin_up() -> Motion:
    """Return the beam of Simo and Vu-Quoc (1986)."""
    turn = hinge("hub", "ground", "beam", motion=mp.multibody.TimeFunction(SPIN_UP))
    return Motion(mp.System(bodies={"beam": uniform_beam(modes=6)}, joints=(turn,)), "beam.tip.position", 20.0)


def soft_arms() -> Motion:
    """Return two soft arms on a ball joint, in little gravity."""
    first = mp.Joint(
        name="first", type="spherical", parent="ground", child="upper", angular_velocity=np.array([0, 0.2, 0.1])
    )
    joints, arm = (first, hinge("second", "upper.tip", "lower", angle=0.4)), uniform_beam(modes=3)
    system = mp.System(bodies={"upper": arm, "lower": arm}, joints=joints, gravity=0.05 * GRAVITY)
    return Motion(system, "lower.tip.position", 10.0)


def stiff_arm() -> Motion:
    """Return an arm a thousand times as stiff, damped."""
    arm = uniform_beam(modes=3)
    arm = arm.with_(K=arm.K * 1e6, D=0.02 * np.sqrt(arm.K * 1e6))
    system = mp.System(bodies={"arm": arm}, joints=(hinge("hinge", "ground", "arm"),), gravity=GRAVITY)
    return Motion(system, "arm.tip.position", 2.0)


def thin_pendulum() -> Motion:
    """Return half a metre of 3 mm by 3 mm."""
    return Motion(chain(link(0.5, 12, 0.003), 1), "b0.tip.position", 1.5)


def spinning_panels() -> Motion:
    """Return a free hub that spins with two flexible panels."""
    joints = (
        mp.Joint(
            name="flight", type="free", parent="ground", child="hub.centre", angular_velocity=np.array([0.1, 0.05, 0.5])
        ),
        mp.Joint(name="right", type="weld", parent="hub.right", child="right.root"),
        mp.Joint(name="left", type="weld", parent="hub.left", child="left.root", rotation=BACK),
    )
    panel = uniform_beam(modes=6)
    system = mp.System(bodies={"hub": hub(200.0), "right": panel, "left": panel}, joints=joints)
    return Motion(system, "right.tip.position", 10.0)


def hub(mass: float) -> mp.body.RigidBody:
    """Return a rigid bus of 1 m with ports on both sides."""
    ports = {"centre": np.zeros(3), "right": np.array([0.5, 0, 0]), "left": np.array([-0.5, 0, 0])}
    return mp.rigid_body(
        "hub", mass=mass, centre=np.zeros(3), inertia=mass * np.diag([0.3, 0.3, 0.4]), interfaces=ports
    )


def hinge_springs() -> Motion:
    """Return four links held by springs and dampers in their hinges."""
    spring = mp.multibody.HingeElement(stiffness=2000.0, damping=0.5)
    parents = ["ground", *(f"b{i}.tip" for i in range(3))]
    joints = tuple(hinge(f"j{i}", parent, f"b{i}", elements=spring if i else ()) for i, parent in enumerate(parents))
    beam = link(0.3, 6, 0.01)
    system = mp.System(bodies={f"b{i}": beam for i in range(4)}, joints=joints, gravity=GRAVITY)
    return Motion(system, "b3.tip.position", 0.6)


def impacts() -> Motion:
    """Return a rigid rod that a wall throws back, with a soft, damped link at its tip."""
    joints = hinge("a", "ground", "rod", angle=-0.3), hinge("b", "rod.tip", "link")
    wall = mp.multibody.Closure(
        name="wall", type="point_on_plane", a="ground", b="rod.tip", axis=np.array([1.0, 0, 0]),
        position=np.array([-0.05, 0, 0]), active=False,
    )  # fmt: skip
    beam = link(0.4, 6, 0.01)
    soft = 0.1 * beam.K
    bodies = {"rod": rod(0.5, 3.0), "link": beam.with_(K=soft, D=0.02 * np.sqrt(soft))}
    system = mp.System(bodies=bodies, joints=joints, closures=(wall,), gravity=GRAVITY)
    hit = mp.Event(name="hit", when="wall.gap", direction=-1, impacts=("wall",), restitution=0.6)
    return Motion(system, "link.tip.position", 0.5, (hit,))


def shipped(name: str, followed: str, t_end: float) -> Motion:
    """Return the system of a pipeline file; its bodies are made in a folder that goes again."""
    path = PIPELINES / f"{name}.toml"
    with tempfile.TemporaryDirectory() as folder:
        system = read_system(load(path), Path(folder), Reporter(quiet=True))
    return Motion(system, followed, t_end)


MOTIONS: dict[str, Callable[[], Motion]] = {
    "chain of 5, 6 modes": lambda: swing(6),
    "slider crank, 6 modes": lambda: slider_crank(6),
    "slider crank, 12 modes": lambda: slider_crank(12),
    "rigid slider crank": rigid_slider_crank,
    "rigid double pendulum": double_pendulum,
    "spin-up beam": spin_up,
    "soft arms": soft_arms,
    "stiff arm": stiff_arm,
    "thin pendulum": thin_pendulum,
    "hub with two panels": spinning_panels,
    "hinge springs": hinge_springs,
    "impacts": impacts,
}
LONG: dict[str, Callable[[], Motion]] = {
    "chain of 5, 12 modes": lambda: swing(12),
    "slewing satellite": lambda: shipped("slewing-satellite", "right.tip.position", 20.0),
    "bracket pendulum": lambda: shipped("bracket-pendulum", "lower.bolt_b.position", 1.0),
}  # their fine runs take minutes
