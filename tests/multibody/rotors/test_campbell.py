"""Campbell diagrams: closed forms of a disc, the digits of a rotor of beams, modes that are followed by their shape."""

import numpy as np
import pytest
from discs import ACROSS, MASS, POLAR, X, disc, held, shaft_of_two_stiffnesses, tilting
from shafts import AT_REST, OF_UNEQUAL, SPIN, SPINNING, UNEQUAL, floating

import modalprep as mp
from modalprep.multibody.rotors.campbell import campbell
from modalprep.multibody.rotors.whirl import whirl_modes

K = 2000.0  # N m/rad


def test_critical_speeds_of_a_disc():
    """``A w^2 -+ P W w = K`` with ``w = order W``: ``W^2 = K / (order (order A -+ P))``."""
    across = 0.3  # above the polar moment: the forward critical speed exists
    rotor = tilting(K, K, disc(across=across))
    found = campbell(rotor, "spin", np.linspace(0.0, 160.0, 5), orders=(1.0, 2.0))
    expected = {
        (kind, order): np.sqrt(K / (order * (order * across + sign * POLAR)))
        for kind, sign in (("backward", 1), ("forward", -1))
        for order in (1.0, 2.0)
    }
    assert {(each.kind, each.order): each.speed for each in found.critical} == pytest.approx(expected, rel=1e-6)


def test_modes_keep_their_column_where_they_cross():
    """Bouncing does not know of the speed; the wobble of the disc, ``P / A`` times the speed, passes through it."""
    speed = np.linspace(50.0, 500.0, 10)
    found = campbell(held([1e5, 1e6, 1e6, 0, 0, 0]), "flight", speed, axis=X, modes=4)
    bounce, wobble = np.sqrt(1e6 / MASS), POLAR / ACROSS * speed
    columns = found.eigenvalue.imag
    assert sum(np.allclose(column, bounce, rtol=1e-8) for column in columns.T) == 2
    assert sum(np.allclose(column, wobble, rtol=1e-8) for column in columns.T) == 1
    assert found.certainty.min() > 0.99


def test_rotor_of_beams():
    """Example 5.9.1 of Friswell and others; the digits are those of ROSS with the same elements."""
    found = campbell(floating(), "flight", [0.0, SPIN], axis=X, modes=4)
    assert found.eigenvalue.imag[0] == pytest.approx(np.repeat(AT_REST[:2], 2), rel=1e-7)
    for kind, values in SPINNING.items():
        own = [k for k, each in enumerate(found.at[1].kind) if each == kind][:2]
        assert found.at[1].eigenvalue.imag[own] == pytest.approx(values, rel=1e-7)


def test_rotor_of_beams_in_unequal_bearings():
    """Example 5.9.2 with dampers: coordinates that turn see periodic supports; ROSS has coordinates of the ground."""
    found = whirl_modes(floating(**UNEQUAL), "flight", SPIN, axis=X, modes=5)
    assert found.eigenvalue.imag == pytest.approx(OF_UNEQUAL["frequency"], rel=1e-9)  # the digits printed
    assert found.logarithmic_decrement == pytest.approx(OF_UNEQUAL["decrement"], rel=1e-8)
    assert found.kind == ("backward", "forward", "backward", "forward", "backward")


def test_stiffness_that_grows_with_the_speed():
    """``k + a W^2 = m W^2``."""
    k, a = 1e5, 4.0
    found = campbell(
        lambda w: shaft_of_two_stiffnesses(k + a * w**2, k + a * w**2), "spin", np.linspace(10, 200, 4), modes=2
    )
    forward = [each.speed for each in found.critical if each.kind == "forward"]
    assert forward == pytest.approx([np.sqrt(k / (MASS - a))], rel=1e-7)


def test_first_unstable_speed():
    """Damping that turns with the shaft: the limit is at 250 rad/s, the next speed is 260."""
    rotor = shaft_of_two_stiffnesses(1e5, 1e5, 20.0, 30.0)
    assert campbell(rotor, "spin", np.arange(100.0, 301.0, 40.0), modes=2).first_unstable == 260.0
    assert campbell(rotor, "spin", [100.0, 200.0], modes=2).first_unstable is None


def test_speeds_must_ascend():
    with pytest.raises(mp.InputError, match="ascends from zero"):
        campbell(tilting(K, K), "spin", [100.0, 50.0])
