"""What all tests and doctests share: doctests print as NumPy does by default, whatever a peer program set."""

import gc

import numpy as np
import pytest
from _pytest.doctest import DoctestModule


@pytest.fixture(autouse=True)
def _print_options():
    with np.printoptions(legacy=False):
        yield


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Leave what is collected, which stays to the end, out of all searches for garbage, and search less often."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()
        gc.freeze()
        gc.set_threshold(50_000, 10, 10)


@pytest.hookimpl(wrapper=True)
def pytest_collect_file(file_path):
    """Look for doctests only where there are any: each look imports the module and searches all that it holds."""
    found = yield
    if file_path.suffix != ".py" or ">>>" in file_path.read_text():
        return found
    return [collector for collector in found if not isinstance(collector, DoctestModule)]
