"""Small swings of a hanging chain: rods against their own frequencies and the Bessel function."""

import tomllib

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.special import jn_zeros
from systems.shipped import PIPELINES, run_shipped

import modalprep as mp
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.pipeline import Pipeline
from modalprep.pipeline.systems.systems import read_system

# CASES 11.5, all digits given
RODS = {1: [1.224745], 5: [1.203829, 2.857081], 10: [1.202777, 2.786739]}  # and 20 in test_chains


def hanging(count):
    """The chain of the pipeline file with another number of the same rods, straight down; and its length."""
    path = PIPELINES / "hanging-chain.toml"
    data = tomllib.loads(path.read_text())
    data["chains"]["chain"] |= {"count": count, "first": {"start": {"angle": "90 deg"}}}
    return read_system(Pipeline.model_validate(data).with_chains(), path, None, Reporter(quiet=True)), 0.05 * count


@pytest.mark.parametrize("count", RODS)
def test_frequencies_of_rods(count):
    system, length = hanging(count)
    found = np.sort(mp.system_modes(system).frequency)[: len(RODS[count])] * 2 * np.pi / np.sqrt(9.81 / length)
    np.testing.assert_allclose(found, RODS[count], atol=6e-7)


def test_more_rods_come_to_the_continuous_chain():
    """Half the zeros of J0; the error falls by four when the rods are halved."""
    error = []
    for count in (5, 10):
        system, length = hanging(count)
        found = np.sort(mp.system_modes(system).frequency)[:2] * 2 * np.pi / np.sqrt(9.81 / length)
        error.append(found - jn_zeros(0, 2) / 2)
    np.testing.assert_allclose(error[0] / error[1], 4.0, rtol=0.1)


def test_swing_of_the_lower_end(tmp_path):
    """Against the linear equations of 20 rods in their angles to the vertical, written out; 3 degrees are small."""
    (run,) = run_shipped("hanging-chain", tmp_path).runs.values()
    n, m, length, g = 20, 0.05, 0.05, 9.81
    below = n - 1 - np.maximum.outer(np.arange(n), np.arange(n))
    M = m * length**2 * (below + np.where(np.eye(n), 1 / 3, 1 / 2))
    K = np.diag(m * g * length * (np.diag(below) + 0.5))
    square, modes = eigh(K, M)
    start = modes.T @ M @ np.full(n, np.radians(3))
    tip = length * (np.cos(np.outer(run.time, np.sqrt(square))) * start @ modes.T).sum(axis=1)
    np.testing.assert_allclose(run["chain20.tip.position.x"], -tip, atol=0.02 * np.radians(3))
    assert run.stats["energy_error"] < 1e-8
