"""Power spectra: the energy of a sine, the level of white noise, what is refused."""

import numpy as np
import pytest

import modalprep as mp
from modalprep.response import power_spectrum


def test_a_sine_keeps_its_energy_at_its_frequency():
    """``A^2 / 2`` by Parseval, with whole cycles in each segment; the mean is none of it."""
    time = np.arange(10_000) / 1000
    found = power_spectrum(time, np.stack([5 + 3 * np.sin(40 * np.pi * time), np.cos(80 * np.pi * time)], 1), segment=1)
    np.testing.assert_allclose(found.rms, [3 / 2**0.5, 1 / 2**0.5], rtol=1e-6)
    assert found.frequency[found.density.argmax(axis=0)].tolist() == [20.0, 40.0]
    assert found.segments == 19


def test_white_noise_is_flat():
    """Of variance 4 at 200 samples a second: ``2 * 4 / 200`` at each frequency but the ends, here within 5 sigma."""
    noise = 2 * np.random.default_rng(1).standard_normal(200_000)
    found = power_spectrum(np.arange(200_000) / 200, noise, segment=1.0)
    scatter = 1 / np.sqrt(found.segments * 18 / 19)  # half overlap of Hann windows
    np.testing.assert_allclose(found.density[2:-2], 0.04, rtol=5 * scatter)


def test_few_segments_are_noted_and_short_ones_refused():
    time = np.arange(100) / 100
    assert "the mean of 3 segments" in power_spectrum(time, np.sin(time), segment=0.5).notes[0]
    for segment in (0.02, 2.0):
        with pytest.raises(mp.InputError, match=f"a segment of {segment:g} s has"):
            power_spectrum(time, time, segment=segment)
    with pytest.raises(mp.InputError, match="not equally spaced"):
        power_spectrum(np.append(time, 3.0), np.zeros(101))
