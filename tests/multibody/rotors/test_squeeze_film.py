"""Squeeze-film damper against the integral of the pressure of its film."""

from typing import Any

import numpy as np
import pytest
from discs import MASS, X, held

import modalprep as mp
from modalprep.multibody.rotors.squeeze_film import squeeze_film_damper
from modalprep.multibody.rotors.unbalance import unbalance_response

SPEED, LENGTH, DIAMETER, CLEARANCE, VISCOSITY = 600.0, 0.02, 0.1, 1e-4, 0.01
FILM: Any = {"length": LENGTH, "diameter": DIAMETER, "clearance": CLEARANCE, "viscosity": VISCOSITY}


def force_of_the_film(shift, velocity, cavitated):
    """Integral of the pressure of Reynolds' equation without the flow round the film: ``-mu L^3 h' / h^3`` over z."""
    angle = np.arange(100_000) * 2 * np.pi / 100_000
    normal = np.array([np.cos(angle), np.sin(angle)])
    pressure = VISCOSITY * LENGTH**3 * (velocity @ normal) / (CLEARANCE - shift @ normal) ** 3
    if cavitated:
        pressure = np.maximum(pressure, 0.0)
    return -(normal @ pressure) * DIAMETER / 2 * angle[1]


@pytest.mark.parametrize("cavitated", [True, False])
@pytest.mark.parametrize("eccentricity", [0.0, 0.3, 0.8])
def test_pressure_on_a_circular_orbit(eccentricity, cavitated):
    """At any angle of the orbit; about the centre in any direction. Sums over kinks of the pressure: 1e-8."""
    K, C = squeeze_film_damper([SPEED], eccentricity=eccentricity, cavitated=cavitated, **FILM).at(SPEED)
    radius = CLEARANCE * eccentricity
    for angle in (0.0, 1.0, 4.0):
        shift = radius * np.array([np.cos(angle), np.sin(angle)])
        velocity = SPEED * (radius or 1e-3 * CLEARANCE) * np.array([-np.sin(angle), np.cos(angle)])
        expected = force_of_the_film(shift, velocity, cavitated)
        scale = np.abs(expected).max()
        assert -(K @ shift + C @ velocity) == pytest.approx(expected, rel=1e-7, abs=1e-7 * scale)


def test_unbalance_that_the_damper_carries():
    """A centring spring and the film: ``U W^2 = |k + K - m W^2 + i W C| c e`` has the orbit that was assumed."""
    spring, eccentricity = 2e5, 0.4
    damper = squeeze_film_damper([SPEED], eccentricity=eccentricity, **FILM)
    K, C = (matrix[0, 0] for matrix in damper.at(SPEED))
    orbit = eccentricity * CLEARANCE
    unbalance = abs(spring + K - MASS * SPEED**2 + 1j * SPEED * C) * orbit / SPEED**2
    rotor = held([1e5, spring, spring, 0, 0, 0])
    rotor = rotor.with_(loads=(*rotor.loads, damper.load("damper", "disc.hub", SPEED)))
    found = unbalance_response(rotor, "flight", [SPEED], {"disc.hub": (0, unbalance, 0)}, axis=X)
    assert found.orbit("disc.hub")[0] == pytest.approx([orbit], rel=1e-8)


def test_refusals():
    with pytest.raises(mp.InputError, match="from 0 to below 1, not 1"):
        squeeze_film_damper([SPEED], eccentricity=1.0, **FILM)
    with pytest.raises(mp.InputError, match="positive clearance, not 0"):
        squeeze_film_damper([SPEED], **FILM | {"clearance": 0.0})
    with pytest.warns(mp.ModalprepWarning, match="0.8 of its diameter"):
        squeeze_film_damper([SPEED], **FILM | {"length": 0.08})
