"""Tables of the modes: effective masses against closed forms and the table of the reduction, CSV files as shown."""

import numpy as np
import pytest
from report.body_page.test_section import downloads

from modalprep.body.mass import mass_matrix
from modalprep.examples import cantilever_model, uniform_beam
from modalprep.reduction.craig_bampton import craig_bampton
from modalprep.reduction.table import DIRECTIONS
from modalprep.report.body_page.modes import floating, mode_tables, participation, totals
from modalprep.report.page import write_page


@pytest.fixture(scope="module")
def beam():
    return uniform_beam(modes=6)


def column(rows, name):
    return np.array([float(row[rows[0].index(name)] or "nan") for row in rows[1:]])


def test_effective_masses_of_a_cantilever(beam):
    """Blevins, Formulas for Dynamics: 61.3, 18.8 and 6.47 % of the mass in the bending modes of a cantilever."""
    share = participation(beam)[:, 1] ** 2 / beam.m
    np.testing.assert_allclose(np.sort(share)[::-1][:3], [0.6131, 0.1883, 0.0647], rtol=2e-3)


def test_sums_of_all_modes_are_the_totals_and_the_residual_is_the_rest():
    """With all vectors kept but the clamped node's own, mass and inertia are complete but for that node's share."""
    from modalprep.body.build import flexible_body

    model = cantilever_model(elements=4)
    body = flexible_body(model, craig_bampton(model, modes=24, truncation=()), name="beam")
    shares, masses, factors = mode_tables(body)
    np.testing.assert_allclose(masses.total[2:], np.sum([row[2:] for row in masses.rows], axis=0), rtol=1e-12)
    whole, residual = np.array(masses.below[0][2:]), np.array(masses.below[1][2:])
    np.testing.assert_allclose(whole, totals(body))
    np.testing.assert_allclose(masses.total[2:] + residual, whole, rtol=1e-12)
    assert np.all(residual >= -1e-9 * whole)
    assert 0 < residual[0] / body.m < 1 / 8 + 1e-9  # at most half an element at the clamp
    np.testing.assert_allclose(np.array([row[2:] for row in factors.rows]) ** 2, [row[2:] for row in masses.rows])
    np.testing.assert_allclose(np.array(shares.total[5:]) / 100 * whole, masses.total[2:])


def test_floating_frequencies_are_those_of_the_free_beam(beam):
    """The full mass matrix with the rigid motions, by another eigensolver."""
    M = mass_matrix(beam, np.zeros(beam.n))
    w2 = np.sort(np.linalg.eigvals(np.linalg.solve(M, np.diag(np.append(np.zeros(6), beam.K)))).real)
    np.testing.assert_allclose(floating(beam), np.sqrt(w2[6:]) / (2 * np.pi), rtol=1e-6)


def test_modes_of_another_frame_have_no_participation(beam):
    moved = beam.with_(interface_position=beam.interface_position + 1.0)
    assert [table.name for table in mode_tables(moved)] == ["modes"]


def test_csv_files_hold_what_the_page_shows(beam, tmp_path):
    page = write_page(beam, tmp_path / "p.html")
    found = downloads(page.read_text(encoding="utf-8"))
    assert {"modes.csv", "effective-mass.csv", "participation-factors.csv", "mode-selection.csv", "mac.csv"} <= set(
        found
    )
    modes, chosen = found["modes.csv"], found["mode-selection.csv"]
    np.testing.assert_array_equal(column(modes[:-1], "Hz"), beam.frequency)  # all digits
    np.testing.assert_array_equal(column(chosen, "Hz"), beam.modes.frequency)
    for k, name in enumerate(DIRECTIONS):
        np.testing.assert_array_equal(column(chosen, f"{name} %"), 100 * beam.modes.fraction[:, k])
        np.testing.assert_allclose(column(modes, f"{name} %")[-1], column(modes[:-1], f"{name} %").sum())
    np.testing.assert_allclose(np.diag(np.array(found["mac.csv"][1:], dtype=float)[:, 1:]), 1.0)


def test_every_table_of_the_page_has_its_csv_file(beam, tmp_path):
    import re

    text = write_page(beam, tmp_path / "p.html").read_text(encoding="utf-8")
    tables = re.findall(r'<div class="table" id="([^"]*)"', text)
    assert {f"{name}.csv" for name in tables} <= set(downloads(text))
