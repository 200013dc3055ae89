"""A block of gel in free flight: efficient variables against joint ones, and what nothing from outside changes."""

import numpy as np
import pytest
from systems.shipped import shipped

import modalprep as mp
from modalprep.multibody.free_body.flight import simulate_free_system
from modalprep.multibody.free_body.free_flyer import closure_defect


def test_efficient_variables_fly_as_joints_do(tmp_path):
    system, table = shipped("free-flyer", tmp_path)
    system = system.conventional()
    assert system.bodies["gel"].m == pytest.approx(90.0, rel=1e-12)
    assert closure_defect(system.bodies["gel"]) < 1e-12
    efficient = simulate_free_system(system, t_end=0.5, output_step=0.1, rtol=table.rtol, variables=table.variables)
    joints = mp.simulate(system, t_end=0.5, output_step=0.1, rtol=table.rtol, method="explicit")
    assert np.abs(joints["gel.modal"]).max() > 0.1
    for name in ("gel.tip.position", "gel.modal", "momentum.angular", "energy.strain"):
        scale = np.abs(joints[name]).max()
        np.testing.assert_allclose(efficient[name], joints[name], atol=1e-6 * scale, err_msg=name)
    for name in ("momentum.linear", "momentum.angular"):
        assert np.abs(efficient[name] - efficient[name][0]).max() < 1e-8 * np.abs(efficient["momentum.angular"]).max()
    assert efficient.stats["energy_error"] < 1e-8
