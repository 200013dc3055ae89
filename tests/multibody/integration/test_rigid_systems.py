"""The smallest systems of rigid bodies run by every method.

Every kernel for rigid bodies is compiled here: tests/conftest.py puts this file first, so that two workers compile
different halves of the solver.
"""

import pytest
from multibody.small_systems import METHODS, check_small_system


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("kind", ["rigid bodies in trees", "rigid bodies in closed loops"])
def test_smallest_systems_run(kind, method):
    check_small_system(kind, method)
