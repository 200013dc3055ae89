"""Spin-up of a cantilever plate about its clamped edge: lag of a free corner, with and without geometric stiffness."""

import numpy as np
import pytest
from systems.shipped import run_shipped

# a Ritz series whose strips along x stretch (theory of Banerjee and Kane, J. Appl. Mech. 56 (1989) 887), computed for
# this test: regression values, not published; m, at T/4, T/2, 3T/4
CORNER = {3.75: -0.05594, 7.5: -0.10030, 11.25: -0.04100}
LEAST, LEAST_TIME = -0.102718, 6.735
FREQUENCIES = [3.8350, 12.9443, 23.8377, 43.6714]  # rad/s
# 12 x 8 shells bend 0.13 % more by a given load (first frequency 0.07 % lower); strips carry another 0.1 % (gamma = 2)
RELATIVE = 3e-3


@pytest.fixture(scope="module")
def plate(tmp_path_factory):
    return run_shipped("spinup-plate", tmp_path_factory.mktemp("plate"))


def at(run, time):
    return np.interp(time, run.time, run["plate.corner.deflection.z"])


def test_frequencies_at_rest(plate):
    body = plate.system.bodies["plate"]
    found = 2 * np.pi * body.frequency[:4]
    np.testing.assert_allclose(found, FREQUENCIES, rtol=5e-3)  # order h^2: the fourth has two waves on eight elements
    assert body.m == pytest.approx(3000 * 1.8288 * 1.2192 * 2.54e-3, rel=1e-12)


def test_corner_lags_and_comes_back(plate):
    run = next(iter(plate.runs.values()))
    assert run.status == "done"
    assert run.stats["energy_error"] < 1e-6
    for time, expected in CORNER.items():
        assert at(run, time) == pytest.approx(expected, rel=RELATIVE)
    corner = run["plate.corner.deflection.z"]
    assert corner.min() == pytest.approx(LEAST, rel=RELATIVE)
    assert run.time[corner.argmin()] == pytest.approx(LEAST_TIME, abs=0.02)  # output step
    assert np.abs(corner[run.time > 15]).max() < 0.01 * -LEAST


def test_conventional_theory_diverges(plate):
    run = list(plate.runs.values())[1]
    assert run.status == "diverged"
    # -0.257 m by the same series; growth by exp(sqrt(w^2 - 3.83^2) t) of a frequency off by 0.07 %
    assert at(run, 7.5) == pytest.approx(-0.257, rel=1e-2)
    assert run.time[-1] < 11.25  # where the series has -733 m
