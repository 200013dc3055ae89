"""A pendulum on a cart of nearly no mass: the light cart of the IFToMM benchmark library."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

import modalprep as mp

G, LIGHT = 9.81, 1e-6  # m/s^2, kg; the pendulum has 1 kg at 1 m
T_END = 10.0  # s, about four swings there and back


def light_cart(**options):
    """Simulate from rest with the rod level."""
    ends = {"root": np.zeros(3), "tip": np.array([1.0, 0, 0])}
    bodies = {
        "cart": mp.rigid_body("cart", mass=LIGHT, centre=np.zeros(3), inertia=1e-9 * np.eye(3), interfaces=ends),
        "rod": mp.rigid_body("rod", mass=1.0, centre=ends["tip"], inertia=1e-12 * np.eye(3), interfaces=ends),
    }
    joints = (
        mp.Joint(name="rail", type="prismatic", parent="ground", child="cart", axis=ends["tip"]),
        mp.Joint(name="pin", type="revolute", parent="cart.root", child="rod"),
    )
    system = mp.System(bodies=bodies, joints=joints, gravity=np.array([0, -G, 0]))
    return mp.simulate(system, t_end=T_END, output_step=0.05, **options)


def exact(times):
    """Return the angle from the vertical: the time by quadrature of the energy, with cos(angle) = sin(a)^2.

    The cart follows at once: angle'^2 (1 - cos^2 / (1 + LIGHT)) = 2 G cos.
    """

    def slowness(a):
        s = np.sin(a)
        return 2 * np.sqrt((1 - s**4 / (1 + LIGHT)) / (2 * G * (1 + s**2)))

    def after(a):
        return quad(slowness, 0, a, epsabs=1e-13, epsrel=1e-12, limit=200)[0]

    quarter = after(np.pi / 2)

    def angle(t):
        t = min(t % (4 * quarter), 4 * quarter - t % (4 * quarter))  # it swings back as it came
        down = min(t, 2 * quarter - t)
        found = np.arccos(np.sin(brentq(lambda a: after(a) - down, 0, np.pi / 2, xtol=1e-14)) ** 2)
        return found if t <= quarter else -found

    return np.array([angle(t) for t in times])


@pytest.mark.parametrize("rtol", [1e-3, 1e-5, 1e-7])
def test_a_cart_without_mass_is_as_accurate_as_the_tolerance(rtol):
    """It reaches 4429 m/s for a millisecond at the bottom, where an error of a speed relative to that would be large.

    It was 1100 times the tolerance at 1e-5.
    """
    run = light_cart(rtol=rtol)
    angle, expected = run["pin.angle"] + np.pi / 2, exact(run.time)
    error = np.hypot(np.sin(angle) - np.sin(expected), np.cos(angle) - np.cos(expected))
    assert np.sqrt(np.mean(error**2)) < 10 * rtol
    assert run.stats["energy_error"] < 3 * rtol


@pytest.mark.parametrize(
    ("method", "rtol"), [("rosenbrock", 1e-5), *(("generalised_alpha", 10.0**-k) for k in (2, 3, 4, 5))]
)
def test_a_method_of_low_order_says_that_it_does_not_follow(method, rtol):
    """So close to no mass the implicit methods of order 2 and 3 need far more steps: the motion is 9 to 70 rtol off."""
    run = light_cart(method=method, rtol=rtol)
    assert run.stats["energy_error"] > 3 * rtol
    (note,) = run.notes
    assert "lower rtol until they no longer change" in note
