"""Drives of prescribed joints in loops: closed forms, and the multiplier of a coupler that drives the joint instead."""

import numpy as np
import pytest
from multibody.mechanisms import link

import modalprep as mp
from modalprep.examples import uniform_beam
from modalprep.multibody.model.constraints import Closure, Coupler

G = 9.81
DOWN = np.array([0, -G, 0])
ROD = link("rod", 1.0, (0.5, 0), 0.1, tip=(1, 0))
COUNTER = Coupler(name="counter", factors={"p": 1.0, "q": 1.0})  # the second rod does not turn
LAW = mp.multibody.TimeFunction("0.3 + sin(2*t)/2")


def hinge(name, parent, child, **options):
    return mp.Joint(name=name, type="revolute", parent=parent, child=child, **options)


def two_rods(*, first=None, second=None, closures=(), bodies=(ROD, ROD), **options):
    joints = hinge("p", "ground", "a", **(first or {})), hinge("q", "a.tip", "b", **(second or {}))
    bodies = dict(zip("ab", bodies, strict=True))
    return mp.System(bodies=bodies, joints=joints, closures=closures, gravity=DOWN, **options)


@pytest.mark.parametrize("method", ["explicit", "rosenbrock", "generalised_alpha"])
def test_what_a_coupler_does_at_a_driven_joint_is_not_of_its_drive(method):
    """At a rate of 1 rad/s the kinetic energy stays, so the drive takes m g (s / 2 + s) cos t; the hinge carries b too.

    The rods are of length s = 1 m. The coupler keeps b level on a's end, which accelerates by -s sin t upwards.
    """
    system = two_rods(first={"motion": "t"}, closures=(COUNTER,))
    run = mp.simulate(system, t_end=0.2, output_step=0.02, method=method)
    lever = np.cos(run.time)
    np.testing.assert_allclose(run["p.drive"], 1.5 * G * lever, rtol=1e-7)
    np.testing.assert_allclose(run["power.input"], 1.5 * G * lever, rtol=1e-7)
    coupler = 0.5 * (G - np.sin(run.time))
    np.testing.assert_allclose(run["counter.multiplier"], coupler, rtol=1e-6)
    np.testing.assert_allclose(run["p.torque"][:, 2], 1.5 * G * lever + coupler, rtol=1e-6)
    assert run.stats["energy_error"] < 1e-5  # that of the work, which the implicit methods add up by parabolas


def four_bar(friction=0.0):
    """Crank of .5 m, coupler and rocker of 1 m on a base of 1 m; the pin slides with friction along the rocker."""
    crank = link("crank", 1.0, (0.25, 0), 0.02, tip=(0.5, 0))
    joints = (
        hinge("p", "ground", "crank", angle=1.0),
        hinge("q", "crank.tip", "coupler", angle=-0.4),
        hinge("r", "ground", "rocker", angle=1.2, position=np.array([1.0, 0, 0])),
    )
    line = {"type": "point_on_line", "axis": np.array([1.0, 0, 0]), "friction_coefficient": friction}
    options = line if friction else {"type": "revolute"}
    pin = Closure(name="pin", a="rocker.tip", b="coupler.tip", **options)
    bodies = {"crank": crank, "coupler": ROD, "rocker": ROD}
    return mp.System(bodies=bodies, joints=joints, closures=(pin,), gravity=DOWN)


def screw():
    """A nut that turns and slides by two laws, geared to a rod on it."""
    nut = mp.Joint(name="p", type="cylindrical", parent="ground", child="a", angle=0.3)
    gear = Coupler(name="gear", factors={"p.1": 2.0, "p.2": -0.5, "q": 1.0}, value="0.2*t**2")
    joints = nut, hinge("q", "a.tip", "b")
    return mp.System(bodies={"a": ROD, "b": ROD}, joints=joints, closures=(gear,), gravity=DOWN)


STOP = mp.multibody.HingeElement(upper=-0.4, limit_stiffness=200.0, damping=0.5)
CASES = {
    "coupler": lambda: two_rods(first={"angle": 0.3}, closures=(COUNTER,)),
    "driven coupler": lambda: two_rods(
        first={"angle": 0.3}, closures=(Coupler(name="c", factors={"p": 2.0, "q": 1.0}, value="0.6 + sin(3*t)"),)
    ),
    "coupler and limit": lambda: two_rods(
        first={"angle": 0.3}, second={"angle": -0.3, "elements": STOP}, closures=(COUNTER,)
    ),
    "limit": lambda: two_rods(first={"angle": 0.3}, second={"angle": -0.5, "elements": STOP}),
    "loop": four_bar,
    "loop with friction": lambda: four_bar(0.3),
    "screw": screw,
    "flexible": lambda: two_rods(first={"angle": 0.3}, closures=(COUNTER,), bodies=(uniform_beam(modes=2), ROD)),
}


@pytest.mark.parametrize("case", CASES)
def test_a_drive_is_the_multiplier_of_a_coupler_that_drives_the_joint(case):
    """A second way through the solver: the joint is free, and a coupler of it alone has the law for its value."""
    system, rtol = CASES[case](), 1e-8
    free = next(joint for joint in system.joints if joint.name == "p")
    laws = (LAW, mp.multibody.TimeFunction("t**2/3")) if free.type == "cylindrical" else (LAW,)
    moved = tuple(j.with_(angle=0.0, motion=laws) if j.name == "p" else j for j in system.joints)
    one = mp.simulate(system.with_(joints=moved), t_end=0.5, output_step=0.05, rtol=rtol, method="explicit")
    driven = free.with_(angle=LAW(0.0)[0], rate=LAW(0.0)[1], keep_start=True)
    names = [f"p.{k}" for k in range(1, len(laws) + 1)] if len(laws) > 1 else ["p"]
    drives = [
        Coupler(name=f"drive{k}", factors={name: 1.0}, value=law)
        for k, (name, law) in enumerate(zip(names, laws, strict=True))
    ]
    joints = tuple(driven if j.name == "p" else j for j in system.joints)
    other = system.with_(joints=joints, closures=(*system.closures, *drives))
    two = mp.simulate(other, t_end=0.5, output_step=0.05, rtol=rtol, method="explicit")
    expected = np.stack([two[f"drive{k}.multiplier"] for k in range(len(laws))], axis=1)
    np.testing.assert_allclose(
        one["p.drive"].reshape(expected.shape), expected, rtol=0, atol=1e3 * rtol * np.abs(expected).max()
    )
    np.testing.assert_allclose(
        one["power.input"], two["power.input"], rtol=0, atol=1e3 * rtol * np.abs(two["power.input"]).max()
    )
    assert max(run.stats["energy_error"] for run in (one, two)) < 100 * rtol
