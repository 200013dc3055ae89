"""Small swings of a hanging chain: rods against their own frequencies and the Bessel function."""

import tomllib

import numpy as np
import pytest
from scipy.special import jn_zeros
from systems.shipped import PIPELINES, run_shipped

import modalprep as mp
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema import Pipeline
from modalprep.pipeline.systems import read_system

# CASES 11.5, all digits given
RODS = {1: [1.224745], 5: [1.203829, 2.857081], 10: [1.202777, 2.786739], 20: [1.202505, 2.767002]}


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
    for count in (10, 20):
        system, length = hanging(count)
        found = np.sort(mp.system_modes(system).frequency)[:2] * 2 * np.pi / np.sqrt(9.81 / length)
        error.append(found - jn_zeros(0, 2) / 2)
    np.testing.assert_allclose(error[0] / error[1], 4.0, rtol=0.05)


def test_swing_of_the_lower_end(tmp_path):
    """The straight start is a sum of modes J0(2 w sqrt(x / g)); three of them leave a few hundredths."""
    (run,) = run_shipped("hanging-chain", tmp_path).runs.values()
    zeros = jn_zeros(0, 8)
    from scipy.special import j1, jv

    # 1 - x at rest, x up from the lower end: coefficients 2 int x (1 - x^2) J0(z x) / J1(z)^2 = 4 J2(z) / (z J1(z))^2
    part = 4 * jv(2, zeros) / (zeros * j1(zeros)) ** 2
    swing = np.sin(np.radians(3)) * (part * np.cos(np.outer(run.time, zeros / 2 * np.sqrt(9.81)))).sum(axis=1)
    assert part.sum() == pytest.approx(1.0, abs=0.05)
    np.testing.assert_allclose(run["chain20.tip.position.x"], -swing, atol=0.05 * np.sin(np.radians(3)))
    assert run.stats["energy_error"] < 1e-8
