"""Errors of recoveries against the full model under harmonic loads, and the number of modes that they ask for."""

import numpy as np
import pytest

import modalprep as mp
from modalprep.body.recovery import at_rest
from modalprep.examples import beam_mesh
from modalprep.reduction.error import to_target
from modalprep.reduction.recoveries.unit_loads import unit_drives

LENGTH, STEEL = 2.0, mp.Material(E=210e9, nu=0.3, rho=7800.0)
SECTION = mp.fe.beam_section("rectangle", STEEL, width=0.03, height=0.02)
UP_TO = 40.0  # Hz: two frequencies in each plane
Recover = mp.fe.Recover
WANTED = {
    "beam": Recover(kind="section_force"),
    "bare": Recover(kind="section_force", method="displacement"),
    "feel": Recover(kind="acceleration", group="tip"),
}


def make(boundary):
    mesh = beam_mesh(12, LENGTH)
    ends = {
        "root": mp.Interface(group="root", kind="node"),
        "tip": mp.Interface(group="tip", kind="node", boundary=boundary),
    }
    model = mp.assemble(mesh, {"beam": SECTION}, ends)
    return model, mp.fe.model_recovery(model, mesh, WANTED)


@pytest.fixture(scope="module")
def made():
    return make("free")


def reduced(made, modes, **options):
    return mp.craig_bampton(made[0], modes=modes, truncation=(), **options)


@pytest.mark.parametrize("boundary", ["free", "fixed"])
def test_errors_are_those_of_the_body_that_is_written(boundary):
    """The body's own recovery matrices at its harmonic motion, against those of a body with every mode."""
    model, recovery = made = make(boundary)
    few, complete = (reduced(made, modes) for modes in (4, 10_000))
    error = mp.reduction.reduction_error(model, few, UP_TO, recovery=recovery)
    between = len(error.recovery_at) - len(error.full)
    assert error.recovery.shape == (3, len(error.recovery_at)) == (3, between + len(error.full))
    assert error.recovery_at[between:] == pytest.approx(error.full)
    some = {"name": "b", "recovery": recovery, "second_order_mass": False}
    bodies = [mp.flexible_body(model, reduction, **some) for reduction in (few, complete)]
    for k, frequency in enumerate(error.recovery_at[:between]):
        w, loads = 2 * np.pi * frequency, unit_loads(model.rigid.m)
        values = [[harmonic(body, *load, w) for body in bodies] for load in loads]
        for name, found in zip(error.recoveries, error.recovery[:, k], strict=True):
            units, full = np.array(bodies[0].recovery[name].units), "beam" if name == "bare" else name
            worst = 0.0
            for unit in set(units):
                off = [np.abs(a[name] - b[full])[:, units == unit].max() for a, b in values]
                size = np.array([np.abs(b[full])[:, units == unit].max() for _, b in values])
                worst = max(worst, np.max(off / np.where(size > 1e-2 * size.max(), size, np.inf)))
            assert found == pytest.approx(worst, rel=1e-6, abs=1e-7), (name, frequency)


def unit_loads(m):
    """Accelerations of the root, then forces and moments on the tip: (A and W, loads) of 1 N each."""
    for column in range(12):
        size, loads = (1.0 if column % 6 < 3 else LENGTH), np.zeros((1, 2, 6))
        loads[0, 1, column % 6] = size * (column >= 6)
        yield unit_drives()[:, column % 6] / (m * size) * (column < 6), loads


def harmonic(body, drives, loads, w):
    """Recovered values at the amplitude of an undamped harmonic motion; W has no part of the spin."""
    S, H = body.S, body.H.reshape(9, -1)
    at = np.concatenate([body.phi, body.psi], axis=1).reshape(-1, body.n)
    force = -drives[:3] @ S - drives[3:] @ H + loads.ravel() @ at
    q = force / (body.K - w**2)
    W = drives[3:].reshape(3, 3)
    alpha = np.array([[W[2, 1], W[0, 2], W[1, 0]]])
    motion = at_rest(q[None], 2, loads)._replace(qdd=-(w**2) * q[None], A=drives[None, :3], alpha=alpha)
    return {name: block.values(motion)[0] for name, block in body.recovery.items()}


def test_mode_acceleration_needs_fewer_modes_for_the_same_error(made):
    """To 5 % of the section forces up to 40 Hz; with the whole basis nothing is missing by either method."""
    model, recovery = made
    few, error = to_target(model, lambda n: reduced(made, n), {"beam": 0.05}, UP_TO, recovery=recovery)
    assert error.worst_of("beam") < 0.05 < error.worst_of("bare")
    some, other = to_target(model, lambda n: reduced(made, n), {"beam": 0.05, "feel": 1e-3}, UP_TO, recovery=recovery)
    assert len(some.frequency) > len(few.frequency)
    assert other.worst_of("feel") < 1e-3
    whole = mp.reduction.reduction_error(model, reduced(made, 10_000), UP_TO, recovery=recovery)
    assert whole.worst_of("beam") < 1e-6
    assert whole.worst_of("feel") < 1e-6
    assert whole.worst < 1e-6


def test_targets_that_cannot_be_met_or_read(made):
    model, recovery = made
    with pytest.raises(mp.errors.AccuracyError, match="error of recovery 'bare' up to 40 Hz is still"):
        to_target(model, lambda n: reduced(made, n), {"bare": 1e-9}, UP_TO, modes=300, recovery=recovery)
    with pytest.raises(mp.InputError, match="target_error: recovery 'beem'"):
        to_target(model, lambda n: reduced(made, n), {"beem": 1e-2}, UP_TO, recovery=recovery)
    with pytest.raises(mp.InputError, match="must be positive"):
        to_target(model, lambda n: reduced(made, n), {"beam": 0.0}, UP_TO, recovery=recovery)
