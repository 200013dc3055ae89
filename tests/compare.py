"""Comparison of arrays relative to their largest entry, where small entries carry the round-off of large ones."""

import numpy as np


def assert_close(found, expected, rtol, *, scale=None, name=""):
    """Assert equal shapes, and that no entry is off by more than `rtol` times the largest expected magnitude.

    `scale` replaces that magnitude where the expected array is zero, or small by cancellation. NaN never passes.
    """
    found, expected = np.asarray(found), np.asarray(expected)
    assert found.shape == expected.shape, f"{name} has shape {found.shape}, expected {expected.shape}"
    if not found.size:
        return
    error = np.abs(found - expected)
    at = np.unravel_index(np.nanargmax(np.where(np.isfinite(error), error, np.inf)), error.shape)
    size = np.abs(expected).max() if scale is None else scale
    assert error[at] <= rtol * size, (
        f"{name or 'the array'} differs at {tuple(map(int, at))}: {found[at]!r}, expected {expected[at]!r}; "
        f"off by {error[at]:.3g}, allowed is {rtol:.3g} of {size:.6g}"
    )
