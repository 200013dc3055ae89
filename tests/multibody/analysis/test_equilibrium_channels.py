"""What an equilibrium says by name: places, forces of springs and reactions, by statics."""

import numpy as np
import pytest

import modalprep as mp
from modalprep.examples import uniform_beam
from modalprep.multibody import AxialSpring, HingeElement, TimeFunction

G = 10.0


def bob(name="bob", length=2.0, mass=3.0):
    ends = {"root": np.zeros(3), "tip": np.array([length, 0, 0])}
    return mp.rigid_body(name, mass=mass, centre=np.array([0.5 * length, 0, 0]), inertia=np.eye(3), interfaces=ends)


def test_a_pendulum_on_a_torsion_spring():
    """The hinge carries the weight; the spring's torque is that of the weight about it."""
    spring = HingeElement(stiffness=40.0)
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="bob", elements=spring)
    rest = mp.static_equilibrium(mp.System(bodies={"bob": bob()}, joints=(hinge,), gravity=np.array([0, -G, 0])))
    angle = rest["hinge.angle"]
    assert angle == rest.joints["hinge"][0]
    np.testing.assert_allclose(rest["hinge.force"], [0, 3 * G, 0], atol=1e-8)
    assert rest["hinge.drive"] == pytest.approx(3 * G * np.cos(angle), rel=1e-10)
    np.testing.assert_allclose(rest["bob.tip.position"], [2 * np.cos(angle), 2 * np.sin(angle), 0], atol=1e-12)
    assert rest["bob.tip.position.y"] == rest["bob.tip.position"][1]
    assert abs(rest["hinge.acceleration"]) < 1e-10
    with pytest.raises(mp.InputError, match="the result has no channel 'hinge.speed'"):
        rest["hinge.speed"]


def test_a_rod_on_a_cord():
    """A rod, hinged at its root, level by a vertical cord at its tip: each carries half of the weight."""
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="bob")
    cord = AxialSpring(
        name="cord", between=("ground", "bob.tip"), stiffness=1e3, free_length=1.0, position=np.array([2, 1 + 0.015, 0])
    )
    system = mp.System(bodies={"bob": bob()}, joints=(hinge,), gravity=np.array([0, -G, 0]), loads=(cord,))
    rest = mp.static_equilibrium(system)
    assert rest["cord.tension"] == pytest.approx(15.0, rel=1e-9)  # the cord is 15 mm longer then
    np.testing.assert_allclose(rest["hinge.force"], [0, 15.0, 0], atol=1e-7)


def test_a_clamped_elastic_beam():
    """The clamp carries the load and its moment about the root, wherever the beam bends to."""
    load = mp.PointForce(name="push", at="beam.tip", force=np.array([0, 2.0, 0]))
    wall = mp.Joint(name="wall", type="weld", parent="ground", child="beam")
    rest = mp.static_equilibrium(mp.System(bodies={"beam": uniform_beam(modes=4)}, joints=(wall,), loads=(load,)))
    tip = rest["beam.tip.position"]
    np.testing.assert_allclose(rest["wall.force"], [0, -2.0, 0], atol=1e-8)
    np.testing.assert_allclose(rest["wall.torque"][2], -2.0 * tip[0], rtol=1e-4)
    np.testing.assert_allclose(tip - [10.0, 0, 0], rest["beam.tip.deflection"], atol=1e-12)
    assert np.array_equal(rest["beam.modal"], rest.modal["beam"])


def test_prescribed_hinges_are_held():
    """A hinge that turns is held at the time asked for: no centrifugal force; in a steady motion there is one."""
    motion = TimeFunction("2*t")
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="bob", motion=motion)
    system = mp.System(bodies={"bob": bob()}, joints=(hinge,))
    rest = mp.static_equilibrium(system, t=0.5)
    assert (rest["hinge.angle"], rest["hinge.rate"]) == (1.0, 0.0)
    np.testing.assert_allclose(rest["hinge.force"], 0, atol=1e-12)
    steady = mp.static_equilibrium(system, t=0.5, steady=True)
    pull = -3.0 * 2.0**2 * 1.0 * np.array([np.cos(1.0), np.sin(1.0), 0])  # m w^2 r
    np.testing.assert_allclose(steady["hinge.force"], pull, atol=1e-12)
