"""Drives of least effort: closed forms of a disc and by the Gramian, a large slew without residual vibration."""

import numpy as np
import pytest
from scipy.linalg import expm

import modalprep as mp
from modalprep.examples import uniform_beam


@pytest.fixture(scope="module")
def arm():
    """A hinged beam with one mode."""
    beam = uniform_beam(modes=1, elements=8)
    beam = beam.with_(D=0.02 * np.sqrt(beam.K))
    return mp.System(
        bodies={"arm": beam}, joints=(mp.Joint(name="hinge", type="revolute", parent="ground", child="arm"),)
    )


def at_rest(angle):
    return {"hinge.angle": angle, "hinge.rate": 0.0, "arm.modal.1": 0.0, "arm.modal_rate.1": 0.0}


def least_effort(system, angle, duration):
    """The effort of the best drive of any shape, ``z' W^-1 z`` with the Gramian (Bryson and Ho 5.3; Van Loan 1978)."""
    linear = mp.linearise(system, inputs=["hinge"])
    n = len(linear.A)
    whole = expm(np.block([[-linear.A, linear.B @ linear.B.T], [np.zeros((n, n)), linear.A.T]]) * duration)
    W = whole[n:, n:].T @ whole[:n, n:]
    z = angle * np.eye(n)[linear.states.index("hinge.angle")]
    return float(z @ np.linalg.solve(W, z))


def test_effort_is_that_of_the_gramian(arm):
    """A small slew: above it by what straight lines between 21 points cost, below 1e-4, 1.6e-3 with 11 (order 5)."""
    least = least_effort(arm, 0.01, 1.0)
    fine = mp.steer(arm, ["hinge"], at_rest(0.01), 1.0)
    assert 0 < fine.effort / least - 1 < 1e-4
    coarse = mp.steer(arm, ["hinge"], at_rest(0.01), 1.0, points=11)
    assert 4 < np.log2((coarse.effort / least - 1) / (fine.effort / least - 1)) < 6


def test_a_large_slew_leaves_no_vibration(arm):
    """After 0.5 rad of a beam that is nonlinear there, the run with the drive stands still; a rigid plan swings on."""
    found = mp.steer(arm, {"hinge": 1e-6}, at_rest(0.5), 1.0)
    run = mp.simulate(found.system, t_end=1.5, output_step=0.01, rtol=1e-8)
    after = run.time > 1.0
    assert np.abs(run["hinge.angle"][after] - 0.5).max() < 1e-5
    assert np.abs(run["arm.modal"][after]).max() < 1e-4 * np.abs(run["arm.modal"]).max()
    assert found.reached["hinge.angle"] == pytest.approx(0.5, abs=1e-6)


def test_bounds_flatten_the_drive():
    """A disc of 1 kg m2 in 1 s by 1 rad needs 6 N m; held to 4.5 N m it still arrives, with more effort (above 12).

    Bang-bang needs 4 N m, so that 3.9 are too few.
    """
    disc = mp.rigid_body("disc", mass=1.0, centre=np.zeros(3), inertia=np.eye(3), interfaces={"root": np.zeros(3)})
    system = mp.System(
        bodies={"disc": disc}, joints=(mp.Joint(name="hinge", type="revolute", parent="ground", child="disc"),)
    )
    targets = {"hinge.angle": 1.0, "hinge.rate": 0.0}
    found = mp.steer(system, ["hinge"], targets, 1.0, points=11, largest={"hinge": 4.5})
    assert np.abs(found.drives["hinge"]).max() <= 4.5 * (1 + 1e-9)
    assert 12.0 < found.effort < 4.5**2
    assert found.reached["hinge.angle"] == pytest.approx(1.0, abs=1e-5)
    with pytest.raises(mp.SimulationError, match="are missed|is missed by .* bounds of the drives are too narrow"):
        mp.steer(system, ["hinge"], targets, 1.0, points=11, largest={"hinge": 3.9}, most_runs=6)


def test_what_cannot_be_is_refused(arm):
    def refused(pattern, system=arm, drives=("hinge",), targets=None, **options):
        with pytest.raises(mp.InputError, match=pattern):
            mp.steer(system, drives, targets or at_rest(0.1), 1.0, **options)

    refused("joint 'hing' does not exist; did you mean 'hinge'", drives=["hing"])
    driven = mp.multibody.HingeElement(drive="t")
    refused("'hinge' has a drive", arm.with_(joints=(arm.joints[0].with_(elements=driven),)))
    refused("2 points of each drive are not enough for 4 targets", points=2)
    refused("the drives do not move target 'gravity|do not move target 'arm.tip.position.z'",
            targets={"hinge.angle": 0.1, "arm.tip.position.z": 0.1})  # fmt: skip
    refused("the weight of 'hinge' is 0", drives={"hinge": 0.0})
    refused("largest drive of 'hinge' is -1", largest={"hinge": -1.0})
