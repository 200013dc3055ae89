"""A chain between two posts: the catenary, at rest and after its fall."""

import numpy as np
import pytest
from scipy.optimize import brentq
from systems.shipped import run_shipped, shipped

import modalprep as mp

SPAN, WEIGHT, LENGTH = 10.0, 10.0, 12.0  # m, N/m, m
# catenary y = a cosh(x / a): length 2 a sinh(SPAN / 2 a), horizontal force w a, tension w y
A = brentq(lambda a: 2 * a * np.sinh(SPAN / (2 * a)) - LENGTH, 1.0, 100.0)
HORIZONTAL, SAG, TENSION = WEIGHT * A, A * np.cosh(SPAN / (2 * A)) - A, WEIGHT * A * np.cosh(SPAN / (2 * A))
# a chain of n rods differs by O(1/n^2) = 6e-4
ACCURACY = 1e-3


def test_rest(tmp_path):
    system, _ = shipped("catenary", tmp_path)
    rest = mp.static_equilibrium(system)
    angle = np.cumsum([rest.joints[f"chain{k}"][0] for k in range(1, 41)])
    assert rest.stable
    assert 0.3 * np.sin(angle[:20]).sum() == pytest.approx(SAG, rel=ACCURACY)
    force = rest.closures["post.force"]
    assert np.abs(force[[0, 2]]) == pytest.approx([HORIZONTAL, 60.0], rel=ACCURACY)
    assert np.linalg.norm(force) == pytest.approx(TENSION, rel=ACCURACY)
    assert force[2] == pytest.approx(60.0, rel=1e-9)  # half the weight, exactly


def test_the_chain_settles(tmp_path):
    (run,) = run_shipped("catenary", tmp_path).runs.values()
    assert run["chain20.tip.position.z"][-1] == pytest.approx(-SAG, rel=5e-3)
    np.testing.assert_allclose(run["chain40.tip.position"][:, [0, 2]], [[SPAN, 0]] * len(run.time), atol=1e-9)
    assert run.stats["energy_error"] < 1e-5
