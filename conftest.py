"""Doctests print as NumPy does by default, whatever a peer program set when it was imported."""

import numpy as np
import pytest


@pytest.fixture(autouse=True)
def _print_options():
    with np.printoptions(legacy=False):
        yield
