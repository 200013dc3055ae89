"""Recovered quantities where events look for them, and as outputs of linear equations."""

import numpy as np
import pytest
from multibody.results.test_recovery_channels import LENGTH, LINE_MASS, beam, hinge

import modalprep as mp
from modalprep.body.recovery import at_rest


@pytest.fixture(scope="module")
def arm():
    return beam(modes=2)  # whose static correction carries the loads on the tip


def test_an_event_at_a_section_force(arm):
    """N = rho A w^2 L^2 / 2 at the root of an arm whose speed grows as w = 40 t passes 3 kN, and a half of another."""
    system = mp.System(bodies={"arm": arm}, joints=(hinge(motion="20*t^2"),))
    limit = 3000.0
    events = (
        mp.Event(name="strong", when=f"arm.recovery.beam.1.start.N - {limit}", direction=1, terminal=True),
        mp.Event(name="half", when=f"arm.recovery.beam.1.start.N + hinge.angle - hinge.angle - {limit / 2}"),
    )
    run = mp.simulate(system, t_end=1.0, output_step=0.02, events=events)
    at = np.sqrt(2 * limit / (LINE_MASS * LENGTH**2)) / 40
    # beyond two bending modes nothing moves along the beam; the bending of the acceleration acts by its square
    assert run.events["strong"] == pytest.approx([at], rel=1e-6)
    assert run.events["half"] == pytest.approx([at / np.sqrt(2)], rel=1e-6)
    assert run["arm.recovery.beam.1.start.N"][-1] == pytest.approx(limit, rel=1e-6)


def test_linear_outputs_are_the_recovery_of_the_harmonic_motion(arm):
    """q = phi F / (K - w^2): of a beam welded to the ground that a force and a moment at its tip drive."""
    weld = mp.Joint(name="weld", type="weld", parent="ground", child="arm")
    names = ("1.start.Vy", "1.start.Mz", "4.50%.Mz", "8.end.Vy", "8.end.Mz")
    outputs = [f"arm.recovery.beam.{name}" for name in names] + ["arm.recovery.base.root.Fy", "arm.recovery.tip.9.y"]
    linear = mp.linearise(
        mp.System(bodies={"arm": arm}, joints=(weld,)), inputs=["arm.tip.force.y", "arm.tip.torque.z"], outputs=outputs
    )
    block, base, tip = (arm.recovery[name] for name in ("beam", "base", "tip"))
    w = 0.7 * np.sqrt(arm.K[0])
    found = mp.multibody.frequency_response(linear, np.array([0.0, w / (2 * np.pi)])).real
    for k, frequency in enumerate((0.0, w)):
        for i, direction in enumerate((1, 5)):
            shape = np.concatenate([arm.phi[1], arm.psi[1]])[direction]
            loads = np.zeros((1, 2, 6))
            loads[0, 1, direction] = 1.0
            q = shape / (arm.K - frequency**2)
            motion = at_rest(q[None], 2, loads)._replace(qdd=-(frequency**2) * q[None])
            rows = block.histories(motion)
            expected = [rows[name][0] for name in names]
            expected += [base.histories(motion)["root.Fy"][0], tip.histories(motion)["9.y"][0]]
            # of the differences, which a mass of the modes near one and a stiffness of 1e9 leave
            assert found[k, :, i] == pytest.approx(expected, abs=1e-6 * np.abs(expected).max())
    assert found[0, :2, 0] == pytest.approx([1.0, LENGTH], rel=1e-6)  # statics by hand
    assert found[0, 3:5, 1] == pytest.approx([0.0, 1.0], abs=1e-6)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("arm.recovery.bean.1.start.N", "did you mean 'beam'"),
        ("arm.recovery.beam.1.start.Nx", "beam of arm has"),
        ("arm.recovery.beam.9.start.N", "beam of arm has"),
    ],
)
def test_unknown_recoveries_are_refused(arm, name, words):
    system = mp.System(bodies={"arm": arm}, joints=(hinge(),))
    with pytest.raises(mp.InputError, match=f"event 'x': no channel {name!r}.*{words}"):
        mp.simulate(system, t_end=0.1, events=[mp.Event(name="x", when=name)])
    with pytest.raises(mp.InputError, match=f"output: no channel {name!r}"):
        mp.linearise(system, outputs=[name])
