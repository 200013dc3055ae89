"""Motion under unbalance over the speed, against closed forms."""

import numpy as np
import pytest
from discs import MASS, X, held, shaft_of_two_stiffnesses
from shafts import OF_UNEQUAL, UNEQUAL
from shafts import floating as shaft_in

import modalprep as mp
from modalprep.multibody.rotors.unbalance import unbalance_response

SPEED = np.array([80.0, 150.0, 400.0])
UNBALANCE = 2e-4  # kg m


def floating(ky, kz, c):
    system = held([1e5, ky, kz, 0, 0, 0])
    return system.with_(loads=tuple(load.with_(damping=[0, c, c, 0, 0, 0]) for load in system.loads))


def across(k, c, speed):
    return UNBALANCE * speed**2 / (k - MASS * speed**2 + 1j * c * speed)


def test_supports_that_differ():
    """``y = U W^2 / (ky - m W^2 + i c W)``; z lags by a quarter: the unbalance begins along y and turns to z."""
    ky, kz, c = 1e6, 5e5, 200.0
    found = unbalance_response(floating(ky, kz, c), "flight", SPEED, {"disc.hub": (0, UNBALANCE, 0)}, axis=X)
    assert found.motion["disc.hub"][:, 1] == pytest.approx(across(ky, c, SPEED), rel=1e-8)
    assert found.motion["disc.hub"][:, 2] == pytest.approx(-1j * across(kz, c, SPEED), rel=1e-8)


def test_rotor_of_beams():
    """In unequal bearings with dampers, the digits of ROSS: amplitudes and phase."""
    speeds = np.array(OF_UNEQUAL["rpm"]) * np.pi / 30
    found = unbalance_response(shaft_in(**UNEQUAL), "flight", speeds, {"shaft.tip": (0, 1e-3, 0)}, axis=X)
    motion = found.motion["shaft.root"]
    assert np.abs(motion[:, 1]) == pytest.approx(OF_UNEQUAL["y"], rel=1e-8)
    assert np.abs(motion[:, 2]) == pytest.approx(OF_UNEQUAL["z"], rel=1e-8)
    assert np.angle(motion[:, 1]) == pytest.approx(OF_UNEQUAL["phase"], rel=1e-8)


def test_the_place_of_the_unbalance_is_its_phase():
    ky, kz, c = 1e6, 5e5, 200.0
    found = unbalance_response(floating(ky, kz, c), "flight", SPEED, {"disc.hub": (0, 0, UNBALANCE)}, axis=X)
    assert found.motion["disc.hub"][:, 1] == pytest.approx(1j * across(ky, c, SPEED), rel=1e-8)


def test_orbits_turn_backward_between_two_critical_speeds():
    ky, kz = 1e6, 5e5
    found = unbalance_response(
        floating(ky, kz, 1e-3), "flight", [100.0, 270.0, 500.0], {"disc.hub": (0, UNBALANCE, 0)}, axis=X
    )
    assert np.sign(found.orbit("disc.hub")[1]).tolist() == [1.0, -1.0, 1.0]


def test_damping_that_turns_does_not_brake_a_steady_whirl():
    """``U W^2 / |k - m W^2 + i outer W|``, whatever the damping of the shaft."""
    k, outer = 1e5, 30.0
    for inner in (0.0, 20.0):
        rotor = shaft_of_two_stiffnesses(k, k, inner, outer)
        found = unbalance_response(rotor, "spin", SPEED, {"mass.c": (0, UNBALANCE, 0)})
        assert found.orbit("mass.c")[0] == pytest.approx(np.abs(across(k, outer, SPEED)), rel=1e-7)


def test_amplification_factor():
    """Of light damping it is ``sqrt(k m) / c``, to the square of the damping; the speeds are 0.2 % apart."""
    k, c = 1e6, 200.0
    speeds = np.sqrt(k / MASS) * np.linspace(0.9, 1.1, 101)
    found = unbalance_response(floating(k, k, c), "flight", speeds, {"disc.hub": (0, UNBALANCE, 0)}, axis=X)
    (peak,) = found.peaks("disc.hub")
    assert peak.speed == pytest.approx(np.sqrt(k / MASS), rel=2e-3)
    assert peak.amplification == pytest.approx(np.sqrt(k * MASS) / c, rel=0.02)


@pytest.mark.parametrize(
    ("unbalance", "says"),
    [
        ({"disc.hup": (0, 1, 0)}, "did you mean 'disc.hub'"),
        ({"disc.hub": (1, 1, 0)}, "along the axis"),
    ],
)
def test_refusals(unbalance, says):
    with pytest.raises(mp.InputError, match=says):
        unbalance_response(floating(1e6, 1e6, 10.0), "flight", [10.0], unbalance, axis=X)
