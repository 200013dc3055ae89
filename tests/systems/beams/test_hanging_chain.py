"""Small swings of a hanging chain: rods against their own frequencies and the Bessel function."""

import tomllib

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.special import jn_zeros
from systems.shipped import PIPELINES, run_shipped

import modalprep as mp
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.load import Loaded
from modalprep.pipeline.schema.pipeline import Pipeline
from modalprep.pipeline.systems.read import read_system


def equations(n, m=0.05, length=0.05, g=9.81):
    """Mass and stiffness (n, n) of equal rods that hang, in their small angles to the vertical: Lagrange by hand."""
    below = n - 1 - np.maximum.outer(np.arange(n), np.arange(n))
    M = m * length**2 * (below + np.where(np.eye(n), 1 / 3, 1 / 2))
    return M, np.diag(m * g * length * (np.diag(below) + 0.5))


def hanging(count):
    """The chain of the pipeline file with another number of the same rods, straight down; and its length."""
    path = PIPELINES / "hanging-chain.toml"
    data = tomllib.loads(path.read_text())
    data["chains"]["chain"] |= {"count": count, "first": {"start": {"angle": "90 deg"}}}
    return read_system(
        Loaded(path, Pipeline.model_validate(data).with_chains()), None, Reporter(quiet=True)
    ), 0.05 * count


@pytest.mark.parametrize("count", [1, 5, 10])
def test_frequencies_of_rods(count):
    M, K = equations(count)
    found = np.sort(mp.system_modes(hanging(count)[0]).frequency) * 2 * np.pi
    np.testing.assert_allclose(found, np.sqrt(eigh(K, M, eigvals_only=True)), rtol=1e-6)  # differences in the angles


def test_more_rods_come_to_the_continuous_chain():
    """Half the zeros of J0; the error falls by four when the rods are halved."""
    error = []
    for count in (5, 10):
        system, length = hanging(count)
        found = np.sort(mp.system_modes(system).frequency)[:2] * 2 * np.pi / np.sqrt(9.81 / length)
        error.append(found - jn_zeros(0, 2) / 2)
    np.testing.assert_allclose(np.log2(error[0] / error[1]), 2.0, atol=0.2)


def test_swing_of_the_lower_end(tmp_path):
    """Against the linear equations of 20 rods in their angles to the vertical, written out; 3 degrees are small."""
    (run,) = run_shipped("hanging-chain", tmp_path).runs.values()
    M, K = equations(20)
    square, modes = eigh(K, M)
    start = modes.T @ M @ np.full(20, np.radians(3))
    tip = 0.05 * (np.cos(np.outer(run.time, np.sqrt(square))) * start @ modes.T).sum(axis=1)
    np.testing.assert_allclose(run["chain20.tip.position.x"], -tip, atol=0.02 * np.radians(3))
    assert run.stats["energy_error"] < 1e-8
