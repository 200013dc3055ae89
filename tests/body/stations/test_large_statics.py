"""Large deflections of one body in statics: closed forms and published values (the theory page has the equations)."""

import numpy as np
import pytest
from body.stations.statics import elastica, equilibrium, line_body

import modalprep as mp
from modalprep.body.recovery import at_rest
from modalprep.body.stations.error import station_error
from modalprep.body.stations.shape import station_points

L, EI = 1.0, 2e11 * 0.02 * 0.002**3 / 12
STEEL = mp.Material(E=2e11, nu=0.3, rho=7800.0)
STRIP = mp.Beam(
    material=STEEL, A=4e-5, Iy=EI / 2e11, Iz=0.002 * 0.02**3 / 12, J=4 * EI / 2e11, theory="euler-bernoulli"
)


def cantilever(stations):
    points = np.zeros((49, 3))
    points[:, 0] = np.linspace(0, L, 49)
    return line_body(points, STRIP, modes=4, stations=stations, derivatives=3)


@pytest.fixture(scope="module")
def strip():
    return cantilever(16)


@pytest.mark.parametrize(("w", "limit"), [(0.2, 1e-4), (0.4, 2e-4), (0.6, 5e-4)])
def test_tip_force_bends_as_the_elastica(strip, w, limit):
    """The limits are twice what stations at twice the distance leave, over 4: .05 (turn / N)^2 of the length."""
    load, shorter = elastica(w)
    tip, _ = equilibrium(strip, force=(0, 0, load * EI / L**2))
    np.testing.assert_allclose([tip[2], L - tip[0]], [w, shorter], atol=limit * L)


@pytest.mark.parametrize(("degrees", "limit"), [(90, 1e-3), (180, 3e-3)])
def test_tip_moment_bends_to_an_arc(strip, degrees, limit):
    angle = np.radians(degrees)
    tip, _ = equilibrium(strip, torque=(0, -angle * EI / L, 0))
    np.testing.assert_allclose(tip, [np.sin(angle) / angle, 0, (1 - np.cos(angle)) / angle], atol=limit)


def test_error_falls_with_the_square_of_the_distance_and_is_stated():
    """At .4 L; the statement is to be within 2 times."""
    load, shorter = elastica(0.4)
    errors, stated = [], []
    for stations in (4, 8):
        body = cantilever(stations)
        tip, q = equilibrium(body, force=(0, 0, load * EI / L**2))
        errors.append(np.hypot(tip[2] - 0.4, L - tip[0] - shorter))
        stated.append(station_error(body, q[None])[0])
    assert 3.5 < errors[0] / errors[1] < 4.5
    assert np.all(np.abs(np.log2(np.divide(stated, errors))) < 1)


def test_mesh_nodes_follow_the_arc(strip):
    """All nodes lie on the circle of the moment, of radius L / angle."""
    angle = np.pi / 2
    _, q = equilibrium(strip, torque=(0, -angle * EI / L, 0))
    s = angle * strip.points[:, 0] / L
    arc = np.stack([np.sin(s), 0 * s, 1 - np.cos(s)], axis=1) * L / angle
    np.testing.assert_allclose(station_points(strip, q[None])[0], arc, atol=2e-3 * L)


def test_bend_of_45_degrees():
    """Bathe and Bolourchi (1979), R = 100, 1 x 1, E = 1e7, 600 out of the plane.

    With the torsion of the square, J = .1406, the tip ends at (-13.73, -23.82, 53.61): two codes, elements of the
    geometrically exact beam. The published values differ by the J of their authors.
    """
    angle = np.linspace(0, np.pi / 4, 49)
    points = 100 * np.stack([np.sin(angle), 1 - np.cos(angle), 0 * angle], axis=1)
    soft = mp.Material(E=1e7, nu=0.0, rho=1.0)
    section = mp.Beam(material=soft, A=1.0, Iy=1 / 12, Iz=1 / 12, J=0.1406, theory="euler-bernoulli")
    tip, _ = equilibrium(line_body(points, section, stations=24), force=(0, 0, 600.0))
    moved = tip - points[-1]
    length = 100 * np.pi / 4
    np.testing.assert_allclose(moved, [-23.82, -13.73, 53.61], atol=3e-3 * length)


@pytest.mark.parametrize(("w", "axial"), [(0.4, 0.02), (0.6, 0.05)])
def test_section_forces_and_stress_are_in_the_axes_of_the_parts(w, axial):
    """Elastica: moment ``P x`` at the root, shear ``P cos`` and axial force ``P sin`` of the end slope at the tip.

    Moments and shear to 5e-4 of the largest. Axial forces, small beside them, have few shapes of the basis.
    """
    points = np.zeros((49, 3))
    points[:, 0] = np.linspace(0, L, 49)
    forces = mp.fe.Recover(kind="section_force", group="line", method="displacement")
    body = line_body(points, STRIP, modes=8, derivatives=3, recover={"beam": forces}, fibre=(0.0, 0.001))
    load, shorter = elastica(w)
    P = load * EI / L**2
    _, q = equilibrium(body, force=(0, 0, P))
    found = body.recovered(at_rest(q[None], len(body.interface_name)))
    moment, sine = P * (L - shorter), load * (1 - shorter) ** 2 / 2
    assert found["beam.1.start.My"][0] == pytest.approx(-moment, rel=5e-4)
    assert found["beam.48.end.Vz"][0] == pytest.approx(P * np.sqrt(1 - sine**2), rel=2e-3)
    assert found["beam.48.end.N"][0] == pytest.approx(P * sine, abs=axial * P)
    assert abs(body.stresses(q)["root.xx"]) == pytest.approx(moment * 0.001 / (EI / 2e11), rel=5e-3)
