"""Where the error of a reduction is looked for, by hand."""

import numpy as np

from modalprep.reduction.error import _around
from modalprep.reduction.recoveries.error import between_resonances


def test_frequencies_about_resonances_and_between_them():
    """Half-widths 0.01 of 10 Hz and 21.3 Hz, their middle, and none at a rigid motion's 0 Hz or beyond the range."""
    found = _around(np.array([0.0, 10.0, 21.3]), 0.01, 30.0)
    for expected in (10.0, 21.3, 15.65, 5.0, 10.1, 9.9, 10.025, 21.3 * 1.02):
        assert np.abs(found - expected).min() < 1e-12
    assert np.count_nonzero((found > 10.0) & (found < 10.024)) == 0  # a quarter of the half-width is the first
    assert 0 < found.min()
    assert found.max() <= 30.0


def test_few_of_many_gaps_are_chosen_evenly():
    """Of nine gaps the first, the middle one and the last."""
    assert between_resonances(np.arange(1.0, 11.0), 3).tolist() == [1.5, 5.5, 9.5]
