"""Simpler theories of deformation and the free flight of one body: orders of their errors, identities."""

import numpy as np
import pytest
from beam_series import unit_loads
from multibody.single_bodies import DOWN, carried, particles
from multibody.trees import random_body

import modalprep as mp
from modalprep.body.linearised_stiffness import linearised_geometric_stiffness
from modalprep.examples import uniform_beam
from modalprep.multibody.free_body.free_flyer import closure_defect, simulate_free_body
from modalprep.multibody.reference.equations import mass_and_force


def test_errors_of_simpler_theories_are_of_second_order_in_the_spin():
    """Lag at Omega / omega = e: consistent ``1 + (S_11 - 1) e^2 / 2``, conventional ``1 - e^2 / 2``, ruthless 1.

    S_11 = 1.1933 is the modal stiffness of the centrifugal force in the first mode: Southwell's coefficient.
    """
    body = uniform_beam(modes=12, keep="effective_mass > 0%", truncation=("inertia",))
    body = body.with_(D=np.zeros(body.n))
    still = body.frequency[0]
    found = {}
    for e in (0.05, 0.1):
        spin = np.array([0, 0, e * 2 * np.pi * still])
        theories = {"consistent": body, "conventional": body.conventional(), "ruthless": body.ruthless()}
        found[e] = {name: mp.multibody.spin_modes(b, spin).frequency[0] / still - 1 for name, b in theories.items()}
    stiffening = unit_loads(1)["centrifugal"][0, 0] - 1
    assert found[0.05]["consistent"] / 0.05**2 == pytest.approx(stiffening / 2, rel=0.02)  # e^4 and stretch
    assert found[0.05]["conventional"] / 0.05**2 == pytest.approx(-0.5, rel=0.02)
    assert abs(found[0.1]["ruthless"]) < 1e-12
    for name in ("consistent", "conventional"):
        order = np.log2(found[0.1][name] / found[0.05][name])
        assert order == pytest.approx(2.0, abs=0.05)


def test_ruthless_inertia_lacks_the_second_order_of_the_deflection():
    body, errors = random_body(np.random.default_rng(5), 3, geometric=False), []
    for size in (0.02, 0.01):
        system, state = carried(body, type="revolute"), np.concatenate([[0.0], size * np.ones(3), np.zeros(4)])
        M, R = (mass_and_force(s, state)[0][0, 0] for s in (system, system.ruthless()))
        errors.append(abs(M - R))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=1e-6)


def test_ruthless_system_keeps_its_energy():
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="beam", rate=0.5)
    system = mp.System(bodies={"beam": uniform_beam(modes=2)}, joints=(hinge,), gravity=DOWN).ruthless()
    run = mp.simulate(system, t_end=1.0, output_step=0.25, rtol=1e-10, method="explicit")
    assert run.stats["energy_error"] < 1e-8


def test_frozen_stiffness_is_right_at_its_spin_alone():
    body, spin = uniform_beam(modes=5), np.array([0, 0, 6.0])
    frozen = linearised_geometric_stiffness(body, spin)
    same = [mp.multibody.spin_modes(b, spin).frequency for b in (body, frozen)]
    other = [mp.multibody.spin_modes(b, spin / 3).frequency for b in (body, frozen)]
    np.testing.assert_allclose(*same, rtol=1e-10)
    assert other[1][0] > 1.3 * other[0][0]
    with pytest.raises(mp.InputError, match="buckles"):
        linearised_geometric_stiffness(body, np.zeros(3), np.array([1000.0, 0, 0]))


# ---- free flight ----


def test_momenta_fly_as_the_recursion_does():
    body, times = random_body(np.random.default_rng(0), 4), np.linspace(0, 2, 5)
    start = {"velocity": np.array([0.3, -0.2, 0.5]), "angular_velocity": np.array([0.6, -0.4, 0.8])}
    found = simulate_free_body(body, times, **start, gravity=DOWN)
    free = carried(body, type="free", **start).with_(gravity=DOWN)
    run = mp.simulate(free, t_end=2.0, output_step=0.5, rtol=1e-11, atol=1e-13, method="explicit")
    for mine, other in ((found.q, "part.modal"), (found.position, "part.origin"), (found.linear, "momentum.linear"),
                        (found.angular, "momentum.angular")):  # fmt: skip
        np.testing.assert_allclose(mine, run[other], atol=1e-8)


def test_efficient_variables_are_exact_for_closed_modes():
    rng, times = np.random.default_rng(2), np.linspace(0, 2, 5)
    body = particles(rng)
    start = {"velocity": np.array([0.3, -0.2, 0.5]), "angular_velocity": np.array([0.6, -0.4, 0.8])}
    start["q"] = 0.1 * rng.standard_normal(9)
    exact, efficient = (simulate_free_body(body, times, **start, variables=name) for name in ("momentum", "efficient"))
    assert closure_defect(body) < 1e-12
    for name in ("q", "position", "quaternion", "linear", "angular"):
        np.testing.assert_allclose(getattr(efficient, name), getattr(exact, name), atol=1e-8)
    for name in ("linear", "angular"):
        drift = getattr(efficient, name) - getattr(efficient, name)[0]
        assert np.abs(drift).max() < 1e-8


def test_efficient_variables_refuse_modes_that_are_not_closed():
    beam = uniform_beam(modes=2)
    with pytest.raises(mp.InputError, match="geometric stiffness"):
        simulate_free_body(beam, np.array([0.0, 1.0]), variables="efficient")
    with pytest.raises(mp.InputError, match="do not represent a fraction"):
        simulate_free_body(beam.conventional(), np.array([0.0, 1.0]), variables="efficient")
