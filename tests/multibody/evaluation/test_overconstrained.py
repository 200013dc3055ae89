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


def leg(along):
    """A rod of one metre along an axis."""
    return mp.rigid_body(
        "leg", mass=1.0, centre=along / 2, inertia=(np.eye(3) - np.outer(along, along)) / 12,
        interfaces={"root": np.zeros(3), "tip": along},
    )  # fmt: skip


def sarrus(angle, rate):
    """A plate on two pairs of legs that fold in planes across each other: it can only rise and sink."""
    x, y = np.eye(3)[:2]
    plate = mp.rigid_body(
        "plate", mass=2.0, centre=np.array([0.5, 0, 0]), inertia=np.diag([0.1, 0.1, 0.2]),
        interfaces={"root": np.zeros(3), "edge": np.array([0.5, -0.5, 0])},
    )  # fmt: skip
    bodies = {"a1": leg(x), "a2": leg(x), "plate": plate, "b1": leg(y), "b2": leg(y)}
    joints = [
        ("a1", "ground", y, angle - np.pi, rate, np.array([-0.5, 0, 0])),
        ("a2", "a1.tip", y, np.pi - 2 * angle, -2 * rate, np.zeros(3)),
        ("plate", "a2.tip", y, angle, rate, np.zeros(3)),
        ("b1", "ground", x, np.pi - angle, -rate, np.array([0, -0.5, 0])),
        ("b2", "b1.tip", x, 2 * angle - np.pi, 2 * rate, np.zeros(3)),
    ]
    tree = tuple(
        mp.Joint(name=child, type="revolute", parent=parent, child=child, axis=about, angle=start, rate=speed,
                 position=place)
        for child, parent, about, start, speed, place in joints
    )  # fmt: skip
    closure = mp.multibody.Closure(name="loop", type="revolute", a="plate.edge", b="b2.tip", axis=x)
    return mp.System(bodies=bodies, joints=tree, closures=(closure,), gravity=np.array([0, 0, -9.81]))


@pytest.mark.parametrize("rtol", [1e-5, 1e-8])
def test_sarruss_linkage_lifts_its_plate_straight(rtol):
    """Thrown up from 0.6 rad to nearly stretched legs, and back: the plate stays level, and energy stays."""
    run = mp.simulate(sarrus(0.6, 2.0), t_end=0.6, rtol=rtol, output_step=0.01)
    assert run.status == "done"
    assert run.stats["energy_error"] < 100 * rtol
    turned = run["plate.orientation"]
    np.testing.assert_allclose(np.abs(turned[:, 0]), 1.0, atol=1e-12)
    np.testing.assert_allclose(run["plate.origin"][:, :2], [[-0.5, 0.0]] * len(run.time), atol=1e-8)
    np.testing.assert_allclose(run["plate.origin"][:, 2], 2 * np.sin(np.pi + run["a1.angle"]), atol=1e-8)
    assert np.ptp(run["plate.origin"][:, 2]) > 0.2
