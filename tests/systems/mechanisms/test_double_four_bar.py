"""Double four-bar, benchmark A02 of IFToMM, through its singular positions: it moves as one pendulum.

Three rods turn and two translate.
"""

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from systems.shipped import run_shipped, shipped

import modalprep as mp

DRIVE = 7 / 3 * 9.81  # 1.5 rate^2 + 3.5 g cos(angle) is the energy: rate^2 = 1 + DRIVE (1 - cos)


def pendulum(time):
    """Angle and rate of a crank."""
    found = solve_ivp(
        lambda t, y: [y[1], DRIVE / 2 * np.sin(y[0])], (0, time[-1]), [0, -1], t_eval=time, rtol=1e-12, atol=1e-13
    )
    return found.y


@pytest.mark.parametrize(
    "changed", [{}, *({"method": name, "step": 2e-3} for name in ("rosenbrock", "generalised_alpha"))]
)
def test_cranks_turn_as_one_pendulum(changed, tmp_path):
    """Ten passages; at each, a step's error of the order of the tolerance is all that may be seen."""
    system, given = shipped("double-four-bar", tmp_path)
    run = mp.simulate(system, **{"t_end": given.t_end, "output_step": given.output_step, "rtol": given.rtol} | changed)
    angle, rate = pendulum(run.time)
    for joint in "ACE":
        np.testing.assert_allclose(run[f"{joint}.angle"], angle, atol=1e-4)  # of 31.8 rad: 2e-5 measured
        np.testing.assert_allclose(run[f"{joint}.rate"], rate, atol=1e-3)
    assert np.sum(np.diff(np.sign(np.cos(run["A.angle"]))) != 0) == 10
    assert run.stats["energy_error"] < 2e-5  # generalized_alpha 8e-6, others 9e-7
    for height in ("first.end.position.y", "second.end.position.y"):
        np.testing.assert_allclose(run[height], np.cos(angle), atol=1e-4)


def test_a_turn(tmp_path):
    (run,) = run_shipped("double-four-bar", tmp_path).runs.values()
    turn = quad(lambda x: 1 / np.sqrt(1 + DRIVE * (1 - np.cos(x))), 0, 2 * np.pi)[0]
    assert turn == pytest.approx(1.942515, abs=1e-6)
    np.testing.assert_allclose(np.interp(turn, run.time, run["A.angle"]), -2 * np.pi, atol=1e-3)  # between outputs
    assert "pin_right" in run.message  # the conditions out of the plane are named
