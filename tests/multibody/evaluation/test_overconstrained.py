"""Closed loops with more conditions than they need move as they should, over revolutions: Bennett's linkage."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import modalprep as mp

A, B, TWIST = 1.0, 1.4, np.radians(30.0)  # sin(twist of b) / b = sin(twist of a) / a (Bennett 1903)
OTHER = np.arcsin(B / A * np.sin(TWIST))


def axis(angle):
    return np.array([0.0, -np.sin(angle), np.cos(angle)])


def about_x(angle):
    return Rotation.from_rotvec([angle, 0, 0]).as_matrix()


def link(length):
    """A uniform rod."""
    across = length**2 / 12
    return mp.rigid_body(
        "rod", mass=1.0, centre=np.array([length / 2, 0, 0]), inertia=np.diag([0.01, across, across]),
        interfaces={"root": np.zeros(3), "tip": np.array([length, 0, 0])},
    )  # fmt: skip


def bennett(pin, **more):
    """Four links of lengths a, b, a, b and twists alternately; the ground is one of them."""
    bodies = {"one": link(A), "two": link(B), "three": link(A)}
    start = 0.8
    between = 2 * np.arctan(np.sin((OTHER + TWIST) / 2) / np.sin((OTHER - TWIST) / 2) / np.tan(start / 2))
    joints = (
        mp.Joint(name="one", type="revolute", parent="ground", child="one", angle=start, rate=1.0, keep_start=True),
        mp.Joint(name="two", type="revolute", parent="one.tip", child="two", axis=axis(TWIST), rotation=about_x(TWIST),
                 angle=between),
        mp.Joint(name="three", type="revolute", parent="two.tip", child="three", axis=axis(OTHER),
                 rotation=about_x(OTHER), angle=-start),
    )  # fmt: skip
    closure = mp.multibody.Closure(
        name="pin", type=pin, a="ground", b="three.tip", position=np.array([-B, 0, 0]), **more
    )
    return mp.System(bodies=bodies, joints=joints, closures=(closure,), gravity=np.array([0, 0, -9.81]))


PINS = {"spherical": {}, "revolute": {"axis": axis(-OTHER), "rotation": about_x(-OTHER - TWIST)}}


@pytest.mark.parametrize("pin", PINS)
@pytest.mark.parametrize("rtol", [1e-5, 1e-8])
def test_bennetts_linkage_turns(pin, rtol):
    """It has one degree of freedom by its lengths and twists alone; energy stays through the collinear positions.

    The closing angles are ``tan(one / 2) tan(two / 2) = sin((b + a) / 2) / sin((b - a) / 2)``, a, b the twists.
    """
    run = mp.simulate(bennett(pin, **PINS[pin]), t_end=5.0, rtol=rtol, output_step=0.02)
    assert run.status == "done"
    assert np.ptp(run["one.angle"]) > 2.0  # through the collinear position at zero
    assert run.stats["energy_error"] < 100 * rtol
    product = np.tan(run["one.angle"] / 2) * np.tan(run["two.angle"] / 2)
    expected = np.sin((OTHER + TWIST) / 2) / np.sin((OTHER - TWIST) / 2)
    away = np.abs(np.sin(run["one.angle"])) > 0.1  # tangents of half turns are large
    np.testing.assert_allclose(product[away], expected, rtol=1e-6)
    np.testing.assert_allclose(run["three.angle"], -run["one.angle"], atol=1e-7)


@pytest.mark.parametrize("method", ["rosenbrock", "generalised_alpha"])
def test_bennetts_linkage_by_implicit_methods(method):
    run = mp.simulate(bennett("spherical"), t_end=2.0, rtol=1e-6, method=method)
    exact = mp.simulate(bennett("spherical"), t_end=2.0, rtol=1e-9)
    assert np.abs(run["one.angle"] - exact["one.angle"]).max() < 1e-3
    assert np.abs(exact["one.angle"][-1] - exact["one.angle"][0]) > 0.1


def test_bennetts_linkage_is_driven():
    """Its first joint follows a law through two revolutions."""
    system = bennett("spherical")
    first = system.joints[0].with_(motion="0.8 + t", angle=0.0, rate=0.0, keep_start=False)
    run = mp.simulate(system.with_(joints=(first, *system.joints[1:])), t_end=4 * np.pi, rtol=1e-7, output_step=0.05)
    assert run.status == "done"
    assert run.stats["energy_error"] < 1e-4
    turned = np.unwrap(run["three.angle"])
    np.testing.assert_allclose(turned, turned[0] - run.time, atol=1e-6)
