"""The work of the energy audit over a step: the parabola through three powers, exact for power of second order."""

from types import SimpleNamespace

import numpy as np
import pytest

from modalprep.multibody.integration.driver import _add_work

POWER = np.polynomial.Polynomial([3.0, -2.0, 5.0])


def work(h, g, kink=np.inf):
    """Return what a step of h from t = 1 adds to work of 7 J, after one of g."""
    clock = SimpleNamespace(last_step=g, time=1.0, kink=kink, power_before=POWER(1.0 - g))
    run = SimpleNamespace(y=[7.0], new=[0.0], ydot=[POWER(1.0)], newdot=[POWER(1.0 + h)], clock=[clock])
    getattr(_add_work, "py_func", _add_work)(run, h)
    return run.new[-1] - 7.0


@pytest.mark.parametrize(("h", "g"), [(0.1, 0.1), (0.3, 0.1), (0.1, 0.4)])
def test_work_of_a_parabola_is_exact(h, g):
    integral = POWER.integ()
    assert work(h, g) == pytest.approx(integral(1 + h) - integral(1), rel=1e-13)


def test_work_after_a_kink_or_at_the_start_is_that_of_the_trapezoid():
    """The power before belongs to another curve, or is not there."""
    trapezoid = 0.05 * (POWER(1.0) + POWER(1.1))
    assert work(0.1, 0.2, kink=1.0) == pytest.approx(trapezoid, rel=1e-13)
    assert work(0.1, 0.0) == pytest.approx(trapezoid, rel=1e-13)
