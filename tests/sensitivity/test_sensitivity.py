"""Derivatives of runs against differences of runs, the adjoint against forward sensitivities, and what is refused."""

import numpy as np
import pytest
from differentiated import CASES

from modalprep.sensitivity.parameters import find

DIFFERENCES = 1e-6  # what differences of runs leave, relative to the largest derivative of a channel


@pytest.mark.parametrize("name", CASES)
def test_derivatives_agree_with_differences_of_runs(name):
    """Fourth-order differences of runs with tight tolerances, or of the same fixed steps, of each channel.

    The adjoint takes the same linear maps from the other side: it agrees with the forward sensitivities to round-off
    and to what differences of channels leave. A derivative counts as large at least as a thousandth of the channel over
    the parameter: runs to 1e-12 leave 1e-9 of a difference.
    """
    case = CASES[name]()
    found, expected = case.forward(), case.differences()
    sizes = np.array([each.step for each in find(case.system, case.parameters)])
    least = 1e-3 * np.abs(found.values).max(axis=0) / sizes[:, None]
    largest = np.maximum(np.abs(expected).max(axis=1), least)
    error = np.abs(found.derivatives - expected).max(axis=1) / largest
    p, c = np.unravel_index(np.argmax(error), error.shape)
    assert error[p, c] <= DIFFERENCES, (found.parameters[p], found.channels[c], error[p, c])
    weights = np.random.default_rng(0).normal(size=found.values.shape)
    by_size = (np.maximum(np.abs(found.derivatives), least[:, None]) * np.abs(weights)).sum(axis=(1, 2))
    forward = np.tensordot(found.derivatives, weights, 2)
    assert np.all(np.abs(case.gradient(weights).vector - forward) <= 1e-8 * by_size)
