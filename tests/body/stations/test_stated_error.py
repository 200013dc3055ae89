"""The error that a body with stations states, against the true one; numbers of stations and derivatives that follow."""

import numpy as np
import pytest
from body.stations.statics import elastica, equilibrium, line_body

import modalprep as mp
from modalprep.body.stations.error import errors_at, station_error, station_errors
from modalprep.formats.modalfile import read_body, write_body
from modalprep.pipeline.building.deflection import deflecting
from modalprep.pipeline.schema.reduction import ReductionTable
from modalprep.report.explain.body import describe_body

L, E = 1.0, 2e11
STEEL = mp.Material(E=E, nu=0.3, rho=7800.0)
STRIP = mp.Beam(material=STEEL, A=4e-5, Iy=1.3e-11, Iz=1.3e-9, J=5e-11, theory="euler-bernoulli")
BAR = mp.Beam(material=STEEL, A=3e-4, Iy=2.5e-9, Iz=2.25e-8, J=7.9e-9, theory="euler-bernoulli")
POINTS = np.linspace([0, 0, 0], [L, 0, 0], 33)


def bar(derivatives, stations=32):
    return line_body(POINTS, BAR, stations=stations, derivatives=derivatives)


@pytest.fixture(scope="module")
def complete():
    """A bar whose basis has all derivatives."""
    return bar(21)


@pytest.mark.parametrize("w", [0.2, 0.6, 0.8])
def test_error_of_the_elastica_is_stated_within_two_times(w):
    body = line_body(POINTS, STRIP, stations=8, derivatives=3)
    load, shorter = elastica(w)
    tip, q = equilibrium(body, force=(0, 0, load * E * STRIP.Iy))
    true = np.hypot(tip[2] - w, L - tip[0] - shorter)
    assert abs(np.log2(station_error(body, q[None])[0] / true)) < 1


@pytest.mark.parametrize("derivatives", [1, 2, 4])
def test_error_of_a_basis_is_stated_within_two_times(complete, derivatives):
    """A bar bent in two planes twists: the true error is that against the basis of all 21 derivatives, at .31 L."""
    force = E * BAR.Iy * np.array([0, 1.0, 1.0])
    expected, _ = equilibrium(complete, force=force)
    body = bar(derivatives)
    tip, q = equilibrium(body, force=force)
    stated = station_errors(body, q[None]).basis[0]
    assert abs(np.log2(stated / np.linalg.norm(tip - expected))) < 1
    assert stated > 2e-6


def test_nothing_is_left_out_of_a_basis_with_all_derivatives(complete):
    assert errors_at(complete, 0.4).basis[0] == 0.0


def test_error_survives_files_and_other_coordinates(tmp_path):
    body = bar(2, stations=8)
    kept = read_body(write_body(body, tmp_path / "bar.h5"))
    turned, _ = np.linalg.qr(np.random.default_rng(0).standard_normal((body.n, body.n)))
    stations = body.stations.in_basis(turned)
    q = np.linspace(1, 0, body.n)[None] / body.K * 3e3
    expected = station_errors(body, q)
    assert expected.basis[0] > 1e-5
    np.testing.assert_allclose(station_errors(kept, q).both, expected.both, rtol=1e-12)
    other = body.with_(stations=stations, phi=body.phi @ turned, psi=body.psi @ turned, shape=body.shape @ turned)
    np.testing.assert_allclose(station_errors(other, q @ turned).basis, expected.basis, rtol=1e-8)


def test_a_file_that_asks_for_less_error_gets_more_derivatives_and_stations():
    asked = []

    def chosen(**keys):
        asked.clear()
        table = ReductionTable(large_deflection=True, **keys)
        return deflecting(table, lambda count: asked.append(count) or count, lambda found, N: bar(found, N))[1]

    body = chosen(deflection_error=1e-9, stations=8)
    assert asked == [6, 12, 21]
    assert "more than the deflection_error of 1e-07 %" in body.notes[-1]
    body = chosen(reach=0.6)
    assert asked == [6]
    assert errors_at(body, 0.6).both[0] < 2e-4
    assert chosen(derivatives=1, stations=4).notes == bar(1, 4).notes
    assert asked == [1]


def test_the_body_says_what_it_leaves():
    body = bar(2, stations=8)
    said = describe_body(body.with_(stations=body.stations.with_(idle_below=1e-3)))[-1]
    assert "Its 8 stations let it deflect by up to its size, where its modes alone are off by more than 0.1 %" in said
    assert "bent by 40 % of it, they leave about 0.04 %" in said


def test_a_body_that_cannot_have_stations_goes_without_them():
    angle = 2 * np.pi * np.arange(16) / 16
    lines = np.stack([np.arange(16), (np.arange(16) + 1) % 16], axis=1)
    points = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    mesh = mp.fe.Mesh(points=points, cells={"line": lines}, groups={"line": {"line": np.arange(16)}})
    ring = mp.assemble(mesh, {"line": BAR}, {"root": mp.Interface(node=1, kind="node")})
    reduction = mp.craig_bampton(ring, modes=3)
    with pytest.raises(mp.InputError, match="closes on itself"):
        mp.flexible_body(ring, reduction, name="ring", stations=4)
    with pytest.warns(mp.ModalprepWarning, match="without stations, so that the modes alone .* closes on itself"):
        body = mp.flexible_body(ring, reduction, name="ring", stations=4, idle_below=1e-4)
    assert body.stations is None
