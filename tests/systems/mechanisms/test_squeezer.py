"""Andrews' squeezer mechanism against the published solution."""

import numpy as np
import pytest
from systems.shipped import run_shipped

# t = 0.03 s: Test Set for IVP Solvers (Mazzia and Magherini, 2008), "Andrews' squeezing mechanism", as its drivers
# print it; the mechanism is of Schiehlen (ed.), Multibody Systems Handbook (1990)
PUBLISHED = {
    "beta": 15.81077119629904, "Theta": -15.75637105984298, "gamma": 0.04082224013073101, "Phi": -0.5347301163226948,
    "delta": 0.5244099658805304, "Omega": 0.5347301163226948, "epsilon": 1.048080741042263,
}  # fmt: skip


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return next(iter(run_shipped("squeezer", tmp_path_factory.mktemp("squeezer")).runs.values()))


@pytest.mark.parametrize("angle", PUBLISHED)
def test_angles_at_the_end(run, angle):
    # the start is given to 15 digits, errors grow by some 1e5 on the way
    assert run[f"{angle}.angle"][-1] == pytest.approx(PUBLISHED[angle], abs=1e-7)


def test_loops_and_energy(run):
    assert run.stats["energy_error"] < 1e-8
    # of 40 mm, after a projection to 1e-11 of the size
    assert max(np.abs(run[f"pin_{body}.violation"]).max() for body in ("K3", "K4", "K6")) < 1e-11
    # rods K5, K4 and K7, K6 are two equal pairs of 40 and 20 mm between the same two points
    np.testing.assert_allclose(run["Phi.angle"], -run["Omega.angle"], atol=1e-9)
