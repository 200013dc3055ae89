"""A rotor whose modes reach from 14 Hz to far above: derivatives of stiff coordinates, and of those that turn nodes."""

import numpy as np
import pytest
from shafts import AT_REST, SPIN, SPINNING, floating

import modalprep as mp
from modalprep.examples import uniform_beam
from modalprep.multibody.evaluation.evaluator import Evaluator
from modalprep.multibody.kernels.rounding import columns


def rates(system):
    """Return the positive imaginary parts of the eigenvalues of A, and the largest real part of all."""
    values = np.linalg.eigvals(mp.linearise(system).A)
    return np.sort(values.imag[values.imag > 1.0]), values.real.max()


def test_at_rest():
    found, growth = rates(floating(0.0))
    bending = [found[np.argmin(np.abs(found - rate)) + k] for rate in AT_REST for k in (0, 1)]
    assert bending == pytest.approx(np.repeat(AT_REST, 2), rel=1e-7)  # the digits printed
    assert growth < 1e-6  # 1/s: nothing damps, nothing drives


def test_whirl_in_the_turning_axes():
    """The body's axes turn: a forward whirl is slower there by the spin, a backward whirl is faster."""
    found, growth = rates(floating(SPIN))
    expected = [SPIN + rate for rate in SPINNING["backward"]] + [SPIN - rate for rate in SPINNING["forward"]]
    nearest = [found[np.argmin(np.abs(found - rate))] for rate in expected]
    assert nearest == pytest.approx(expected, rel=1e-7)
    assert growth < 1e-6


def test_derivatives_that_are_not_known_are_refused():
    """A force whose slope changes within any step: 1e-3 sin(1e9 x)."""
    mass = mp.rigid_body("mass", mass=1.0, centre=np.zeros(3), inertia=np.eye(3), interfaces={"c": np.zeros(3)})
    slide = mp.Joint(name="slide", type="prismatic", parent="ground", child="mass")

    def rough(t, state):
        x = state.joint("slide").position
        return {"slide": -x + 1e-3 * np.sin(1e9 * x)}

    load = mp.multibody.Callback(name="rough", function=rough)
    with pytest.raises(mp.SimulationError, match="accurate to .* only"):
        mp.linearise(mp.System(bodies={"mass": mass}, joints=(slide,), loads=(load,)))


def counted(sizes, cancelling=0.0):
    """Return what columns of sizes count as."""
    found = np.empty_like(sizes)
    columns(sizes, cancelling, found)
    return found


def test_columns_count_as_a_part_of_the_fastest_motion_at_least():
    """A column of 1 beside one of 1e6 counts as 1; damping that is not there as 1e-6 of the rate of 1e3/s."""
    assert counted(np.array([[1.0, 1e6], [0.0, 0.0]])) == pytest.approx(np.array([[1.0, 1e6], [1e-3, 1e-3]]))
    assert np.all(counted(np.zeros((2, 1))) > 0.0)  # a free body at rest
    assert counted(np.zeros((2, 1)), cancelling=1e6)[0] == pytest.approx(1.0)  # forces that cancel


def in_extended_precision(M, forces):
    """Return the accelerations (n, k) of forces, corrected by what they leave."""
    found = np.zeros_like(forces, dtype=np.longdouble)
    for _ in range(8):
        found += np.linalg.solve(M, (forces - M.astype(np.longdouble) @ found).astype(float))
    return found


def test_the_error_is_that_of_rounding():
    """Six beams of eight modes, whose mass matrix is near to singular: 1e-9 of a column, and not 1e-13."""
    parents = ("ground", *(f"l{k}.tip" for k in range(5)))
    axes = [(0, 0, 1), (0, 1, 0)]
    joints = tuple(
        mp.Joint(name=f"j{k}", type="revolute", parent=parent, child=f"l{k}", axis=axes[k % 2], rate=0.1, angle=0.1)
        for k, parent in enumerate(parents)
    )
    bodies = dict.fromkeys((f"l{k}" for k in range(6)), uniform_beam(modes=8))
    linear = mp.linearise(mp.System(bodies=bodies, joints=joints, gravity=[0, 0, -9.81]))
    t, scale = linear.equations, Evaluator(mp.System(bodies=bodies, joints=joints)).scale
    exact = -in_extended_precision(t.M, np.hstack([t.K, t.D]))
    n = len(t.M)
    off, size = (np.abs(X).astype(float) / scale[:, None] for X in (linear.A[n:] - exact, exact))
    counts = counted((size.max(axis=0) * np.tile(scale, 2)).reshape(2, n)).ravel()
    worst = np.max(off.max(axis=0) * np.tile(scale, 2) / counts)
    estimates = np.max(linear.error_estimate[n:] / scale[:, None] * np.tile(scale, 2) / counts), linear.error
    assert all(worst < estimate < 30 * worst for estimate in estimates)  # they are root mean squares


@pytest.mark.parametrize("gravity", [0.0, 9.81])
@pytest.mark.parametrize("drive", [(), ("0.1",)])
def test_accelerations_are_rates_of_velocities(gravity, drive):
    """``a = v'`` as outputs of a turning flexible beam, with and without loads and elements at its hinge."""
    elements = tuple(mp.multibody.HingeElement(drive=each) for each in drive)
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="beam", rate=2.0, elements=elements)
    system = mp.System(bodies={"beam": uniform_beam(modes=3)}, joints=(hinge,), gravity=[0.0, -gravity, 0.0])
    outputs = [f"beam.tip.{what}.{axis}" for axis in "xy" for what in ("velocity", "acceleration")]
    linear = mp.linearise(system, inputs=["hinge"], outputs=outputs)
    assert linear.D[1::2] == pytest.approx(linear.C[::2] @ linear.B, rel=1e-9, abs=1e-12)
    assert linear.error < 1e-9
