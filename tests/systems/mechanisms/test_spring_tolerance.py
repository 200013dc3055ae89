"""A spring of random stiffness, released at a random place: mean and variance in closed form (see the file's head)."""

import numpy as np
import pytest
from systems.shipped import run_shipped


def mean_cosine(t, a=40.0, b=60.0):
    """Mean of cos(sqrt(k) t) for k uniform on [a, b]."""
    s = np.sqrt([[a], [b]])
    low, high = 2 * (np.cos(s * t) + s * t * np.sin(s * t)) / t**2
    return (high - low) / (b - a)


def test_mean_and_variance(tmp_path):
    """256 Sobol points: errors of the mean by some 1/256 of the deviation, of the variance by some 1/256 of itself."""
    found = run_shipped("spring-tolerance", tmp_path).ensemble
    assert found.status == ("done",) * 256
    t, x = found.time[1:], found["slide.displacement"][:, 1:]
    mean = 0.1 * mean_cosine(t)
    variance = (0.1**2 + 0.01**2) * (1 + mean_cosine(2 * t)) / 2 - mean**2
    assert np.abs(x.mean(axis=0) - mean).max() < 1e-3 * 0.1
    assert np.abs(x.var(axis=0) - variance).max() < 5e-3 * 0.1**2
    assert (mean[-1], variance[-1]) == pytest.approx((4.71287e-3, 6.77135e-2**2), rel=1e-5)  # as the head says
