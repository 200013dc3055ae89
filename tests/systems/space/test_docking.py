"""Capture of a satellite with a flexible panel: momentum, energy lost, what the panel does afterwards."""

import numpy as np
import pytest
from systems.shipped import run_shipped

from modalprep.multibody.evaluation.evaluator import Evaluator
from modalprep.multibody.packing.tree import pack
from modalprep.multibody.reference.constraints import dense_constraints
from modalprep.multibody.reference.equations import mass_and_force


@pytest.fixture(scope="module")
def docked(tmp_path_factory):
    return run_shipped("docking", tmp_path_factory.mktemp("docking"))


def test_momenta_stay(docked):
    (run,) = docked.runs.values()
    for name in ("momentum.linear", "momentum.angular"):
        scale = np.abs(run[name][0]).max()
        np.testing.assert_allclose(run[name], np.tile(run[name][0], (len(run.time), 1)), atol=1e-8 * scale)
    assert run.stats["energy_error"] < 1e-8


def test_energy_lost_and_time_of_contact(docked):
    """0.252 m at 0.05 m/s; ``r S^-1 r / 2`` by dense equations of the flexible system."""
    (run,) = docked.runs.values()
    (impact,) = run.impacts["contact"]
    assert impact.t == pytest.approx(5.04, rel=1e-9)
    row = np.searchsorted(run.time, impact.t)
    system = docked.system
    evaluator, packed = Evaluator(system), pack(system)
    before = impact.y.copy()  # the satellite and its panel rest, the chaser flies on
    before[packed.nx :] = evaluator.start[packed.nx :]
    still = np.zeros((len(packed.links), 3))
    rows = dense_constraints(system, packed, evaluator.loops, before, still, 0.0)
    own = evaluator.loops.closing.of(0)
    M, _ = mass_and_force(system, before)
    G, r = rows.G[own], rows.rate[own]
    lost = r @ np.linalg.solve(G @ np.linalg.solve(M, G.T), r) / 2
    assert impact.energy_loss == pytest.approx(lost, rel=1e-8)
    assert np.diff(run["energy.kinetic"][row : row + 2])[0] == pytest.approx(-lost, rel=1e-8)


def test_the_ports_stay_together_and_the_panel_swings(docked):
    (run,) = docked.runs.values()
    after = run.time > 5.04 + 1e-9
    apart = (run["chaser.port.position"] - run["satellite.port.position"])[after]
    np.testing.assert_allclose(np.linalg.norm(apart, axis=1), np.linalg.norm(apart[0]), atol=1e-9)
    swing = run["panel.tip.deflection.z"]
    assert np.abs(swing[~after]).max() < 1e-9
    assert np.abs(swing[after]).max() > 5e-3
