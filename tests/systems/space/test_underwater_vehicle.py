"""Ship, cable and a vehicle on a commanded path: the constraint, the catenary at the start, the balance of forces."""

import numpy as np
import pytest
from systems.shipped import run_shipped


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    (run,) = run_shipped("underwater-vehicle", tmp_path_factory.mktemp("vehicle")).runs.values()
    return run


def test_the_vehicle_follows_its_path(run):
    t = run.time
    grow = 15 * (1 - np.exp(-(t**2) / 400))
    path = [
        t - 10 * (1 - np.exp(-t / 10)) + grow * np.sin(np.pi * t / 50),
        grow * (1 - np.cos(np.pi * t / 50)),
        -100 + 0 * t,
    ]
    np.testing.assert_allclose(run["vehicle.nose.position"], np.transpose(path), atol=1e-9)
    assert run["path.violation"].max() < 1e-8
    assert run.stats["energy_error"] < 1e-5


def test_tension_follows_the_swell(run):
    """The cable's own weight of 600 N in water, and more as the swell pulls; its period is that of the ship."""
    tension = -run["cable2.force.x"]
    late = run.time > 40
    assert 300 < tension[late].mean() < 1200
    swing = tension[late] - tension[late].mean()
    spectrum = np.abs(np.fft.rfft(swing * np.hanning(late.sum())))
    frequency = np.fft.rfftfreq(late.sum(), run.time[1] - run.time[0])
    fast = frequency > 0.05  # slower is the manoeuvre
    assert frequency[fast][np.argmax(spectrum[fast])] == pytest.approx(1 / 8, abs=1 / 160)
