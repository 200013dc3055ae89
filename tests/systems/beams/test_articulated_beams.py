"""Two flexible beams: frequencies by the hinge's spring, response to an impulse, prescribed slew and its inverse."""

import numpy as np
import pytest
from beam_series import hermite
from scipy.linalg import eigh, expm
from systems.shipped import run_shipped, shipped

import modalprep as mp
from modalprep.multibody.analysis.linearise import linearise

STIFFNESS = [0.0, 0.1, 10.0, np.inf]  # of the hinge, EI / L
EI_BY_L = 1e3


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("beams")


@pytest.fixture(scope="module")
def beams(folder):
    return shipped("articulated-beams", folder)[0]


def exact(stiffness, elements=40):
    """First four frequencies (4,) of both beams as one of cubic elements whose slope may jump in the middle.

    For ``sqrt(EI / (mu L^4)) = 1 rad/s``; the elements have an error of 1e-7.
    """
    K, M = (np.kron(np.eye(2), A) for A in hermite(elements))
    end, size = 2 * elements, 2 * elements + 2
    join = np.delete(np.eye(2 * size), size, axis=1)  # the outer root is where the inner tip is
    join[size, end] = 1.0
    if np.isinf(stiffness):  # and turns as it does
        join = np.delete(join, size, axis=1)
        join[size + 1, end + 1] = 1.0
    else:
        apart = np.eye(2 * size)[end + 1] - np.eye(2 * size)[size + 1]
        K = K + stiffness * np.outer(apart, apart)
    K, M = ((join.T @ A @ join)[2:, 2:] for A in (K, M))
    square = eigh(K, M, eigvals_only=True)[:4]
    return np.sqrt(np.where(square < 1e-6, 0.0, square))  # a free hinge's zero is one to round-off


def hinged(system, stiffness):
    wall, hinge = system.joints
    if np.isinf(stiffness):
        spring = mp.Joint(name="hinge", type="weld", parent="inner.tip", child="outer.root")
    else:
        spring = hinge.with_(elements=mp.multibody.HingeElement(stiffness=stiffness * EI_BY_L))
    return system.with_(joints=(wall, spring))


def frequencies(system, stiffness):
    """At rest all theories have the same; without geometric stiffness the differences stay in range."""
    return 2 * np.pi * mp.system_modes(hinged(system, stiffness).conventional()).frequency[:4]


def richer(modes):
    """The component with more modes."""
    from modalprep.examples import beam_mesh

    slender = mp.Material(E=1e13, nu=0.3, rho=1000.0)
    section = mp.Beam(material=slender, A=1e-3, Iy=1e-5, Iz=1e-9, J=1e-5, theory="euler-bernoulli")
    mesh, ends = beam_mesh(40), {"root": "fixed", "tip": "free"}
    ends = {name: mp.Interface(group=name, kind="node", boundary=what) for name, what in ends.items()}
    model = mp.assemble(mesh, {"beam": section}, ends)
    return mp.flexible_body(model, mp.craig_bampton(model, modes=modes, truncation=("interfaces",)), name="beam")


@pytest.mark.parametrize("stiffness", STIFFNESS)
def test_frequencies(beams, stiffness):
    found, expected = frequencies(beams, stiffness), exact(stiffness)
    # three modes of each beam: the fourth frequency lies above their second
    np.testing.assert_allclose(found[:3], expected[:3], rtol=5e-5, atol=1e-12)
    np.testing.assert_allclose(found[3], expected[3], rtol=2e-3)


def test_frequencies_agree_as_modes_increase(beams):
    expected = exact(10.0)
    errors = []
    for modes in (2, 4, 8):
        body = richer(modes)
        errors.append(frequencies(beams.with_(bodies=dict.fromkeys(beams.bodies, body)), 10.0) / expected - 1)
    assert min(error.min() for error in errors) > -1e-6  # from above, but for the elements of both
    assert errors[0][3] > 4 * errors[1][3] > 16 * errors[2][3]  # omitted modes: at least the square of their number
    np.testing.assert_allclose(errors[2], 0, atol=3e-5)


def test_response_to_an_impulse_is_a_sum_of_modes(folder):
    """Displacements of a hundredth of the length, slopes of three: the linear response, to the square of those."""
    found = run_shipped("articulated-beams", folder)
    (run,) = found.runs.values()
    assert run.stats["energy_error"] < 1e-9
    quiet = found.system.with_(loads=()).conventional()  # the same at rest
    linear = linearise(quiet, inputs=["outer.tip.force.y"], outputs=["outer.tip.position.y"])
    n, step = len(linear.A), run.time[1]
    driven = np.zeros((n + 2, n + 2))  # the states, then sin(pi t) and cos(pi t)
    driven[:n, :n], driven[:n, n], driven[n:, n:] = linear.A, 2 * linear.B[:, 0], [[0, np.pi], [-np.pi, 0]]
    z, advance = np.zeros((len(run.time), n + 2)), expm(step * driven)
    z[0, n + 1] = 1.0
    for k, t in enumerate(run.time[:-1]):
        z[k, n:] *= t < 1 - step / 2  # the force ends at 1 s
        z[k + 1] = advance @ z[k]
    tip = run["outer.tip.position.y"]
    assert np.abs(z[:, :n] @ linear.C[0] - tip).max() < 1e-3 * np.abs(tip).max()


def test_recovered_torques_move_the_arm_as_prescribed(folder):
    found = run_shipped("slewing-arm", folder)
    (run,) = found.runs.values()
    assert run.stats["energy_error"] < 1e-9
    drives = [
        mp.multibody.TimeFunction.table(run.time, run[f"{joint.name}.drive"], spline=True)
        for joint in found.system.joints
    ]
    driven = found.system.with_(
        joints=tuple(
            joint.with_(motion=None, elements=mp.multibody.HingeElement(drive=drive))
            for joint, drive in zip(found.system.joints, drives, strict=True)
        )
    )
    # a torque wrong by the spline's 1e-8 and the integrator's 1e-9 leads the angles away with the square of the time
    again = mp.simulate(driven, t_end=8.0, output_step=0.02, rtol=1e-9, method="explicit")
    rows = slice(len(again.time))
    for name in ("shoulder", "elbow"):
        travel = np.abs(run[f"{name}.angle"][rows]).max()
        assert np.abs(again[f"{name}.angle"] - run[f"{name}.angle"][rows]).max() < 1e-6 * travel
    np.testing.assert_allclose(again["lower.tip.position"], run["lower.tip.position"][rows], atol=2e-6)
