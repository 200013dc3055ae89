"""Damping: Rayleigh's closed form, round trips between components and their system."""

import numpy as np
import pytest
from scipy.linalg import block_diag, eig
from structured import random_rotation

import modalprep as mp
from modalprep.errors import InputError
from modalprep.examples import cantilever_model
from modalprep.multibody.reference.equations import mass_and_force
from modalprep.reduction.damping import (
    Rayleigh,
    component_damping,
    damping_ratio,
    modal_damping,
    rayleigh,
    system_damping,
)
from modalprep.reduction.synthesis import synthesise


def body(elements, tip="fixed", modes=40):
    model = cantilever_model(elements, tip)
    return mp.flexible_body(model, mp.craig_bampton(model, modes=modes, truncation=()), name="beam")


def halves(modes=None, ground=("a.root",)):
    parts = {"a": body(6), "b": body(8, "free")}
    return synthesise(parts, [("a.tip", "b.root")], ground=ground, modes=modes)


@pytest.fixture(scope="module")
def system():
    return halves()


def test_rayleigh_closed_form():
    """Equal ratios: alpha = 2 z w1 w2 / (w1 + w2), beta = 2 z / (w1 + w2)."""
    found = rayleigh((2.0, 8.0), (0.03, 0.03))
    w1, w2 = 4 * np.pi, 16 * np.pi
    assert found.alpha == pytest.approx(0.06 * w1 * w2 / (w1 + w2), rel=1e-14)
    assert found.beta == pytest.approx(0.06 / (w1 + w2), rel=1e-14)
    lowest = np.sqrt(2.0 * 8.0)  # the ratio is least at the geometric mean: sqrt(alpha beta)
    assert found.ratio(np.array([lowest]))[0] == pytest.approx(np.sqrt(found.alpha * found.beta), rel=1e-14)
    other = rayleigh((2.0, 8.0), (0.03, 0.02))
    np.testing.assert_allclose(other.ratio(np.array([2.0, 8.0])), [0.03, 0.02], rtol=1e-14)
    np.testing.assert_allclose(rayleigh((0.1, 0.05), (0.02, 0.02)).ratio(np.array([0.1, 0.05])), 0.02, rtol=1e-14)


@pytest.mark.parametrize(("ratio", "constant"), [((0.01, 0.04), "alpha"), ((0.04, 0.01), "beta")])
def test_ratios_as_the_frequencies_need_one_constant_only(ratio, constant):
    assert getattr(rayleigh((1.3, 5.2), ratio), constant) == 0.0
    assert rayleigh((1.1, 5.5), (0.013, 5 * 0.013)).alpha == 0.0  # round-off is negative here


@pytest.mark.parametrize("f", [np.array([1.0, 1e5]), np.array([1e5, 1.0])])
def test_a_small_constant_is_no_round_off(f):
    """Rayleigh's constants over five decades of frequency: z = alpha / (2 w) + beta w / 2."""
    alpha, beta = 1.0, 1e-14
    w = 2 * np.pi * f
    found = rayleigh(tuple(f), tuple(alpha / (2 * w) + beta * w / 2))
    assert (found.alpha, found.beta) == pytest.approx((alpha, beta), rel=1e-3, abs=0)


def test_rayleigh_that_would_feed_energy_is_refused():
    with pytest.raises(InputError, match="must lie between 0.25 and 4"):
        rayleigh((1.0, 4.0), (0.01, 0.05))
    with pytest.raises(InputError, match="beta = -0.1 must not be negative"):
        Rayleigh(alpha=1.0, beta=-0.1)
    with pytest.raises(InputError, match="must be positive and differ"):
        rayleigh((1.0, 1.0), (0.01, 0.01))


def test_damping_arrays_of_a_body():
    one = body(6)
    w = np.sqrt(one.K)
    np.testing.assert_allclose(modal_damping(one, 0.02), 0.04 * w)
    table = damping_ratio({1.0: 0.02, 3.0: 0.04}, np.array([0.5, 1.0, 2.0, 3.0, 9.0]))
    np.testing.assert_allclose(table, [0.02, 0.02, 0.03, 0.04, 0.04])
    proportional = rayleigh((0.5, 5.0), (0.01, 0.01))
    np.testing.assert_allclose(modal_damping(one, proportional), proportional.damping(one), rtol=1e-12)
    np.testing.assert_allclose(modal_damping(one, np.linspace(0, 0.1, one.n)), 2 * np.linspace(0, 0.1, one.n) * w)


@pytest.mark.parametrize("method", ["least_squares", "back_projection"])
@pytest.mark.parametrize("ground", [("a.root",), ()])
def test_stiffness_proportional_damping_comes_back_exactly(method, ground):
    """``C = beta K`` of the bodies is beta K of the system: ratios beta w / 2, no coupling, ground or none."""
    modes = halves(ground=ground)
    target = Rayleigh(alpha=0.0, beta=1e-4)
    found = component_damping(modes, target, method)
    np.testing.assert_allclose(found.achieved, target.ratio(found.frequency), rtol=1e-7)
    assert found.coupling < 1e-6
    for name, d in found.damping.items():
        exact = 1e-4 * modes.bodies[name].K
        full = np.diag(d) if d.ndim == 1 else d
        scale = np.sqrt(exact)
        np.testing.assert_allclose(full / scale / scale[:, None], np.eye(len(exact)), atol=1e-6)


@pytest.mark.parametrize("method", ["least_squares", "back_projection"])
@pytest.mark.parametrize("target", [0.02, {0.1: 0.01, 5.0: 0.03}, np.linspace(0.0, 0.05, 41)])
def test_one_body_on_the_ground_has_the_target(method, target):
    one = body(8, "free", modes=41)
    modes = synthesise({"a": one}, ground=["a.root"])
    found = component_damping(modes, target, method)
    np.testing.assert_allclose(found.achieved, damping_ratio(target, modes.frequency), rtol=1e-7, atol=1e-12)
    np.testing.assert_allclose(found.applied({"a": one})["a"].D, modal_damping(one, target), rtol=1e-6, atol=1e-9)


def test_least_squares_find_ratios_that_some_component_damping_gives():
    """Wanted is what a damping d >= 0, far from proportional, makes of the system."""
    modes = halves(modes=6)
    rng = np.random.default_rng(0)
    true = {name: 2 * np.sqrt(part.K) * rng.uniform(0.001, 0.1, part.n) for name, part in modes.bodies.items()}
    target = np.diag(system_damping(modes, true)) / (4 * np.pi * modes.frequency)
    found = component_damping(modes, target)
    np.testing.assert_allclose(found.achieved, target, rtol=1e-9)
    assert all(np.all(d >= 0) for d in found.damping.values())


def test_least_squares_are_the_best_where_no_damping_fits():
    """A constant ratio is out of reach; optimality (Kuhn-Tucker) of the relative errors, and better than naive."""
    modes = halves(modes=6)
    found = component_damping(modes, 0.02)
    error = found.achieved / 0.02 - 1
    gain = np.vstack([x[6:] for x in modes.coordinates.values()]) ** 2 / (4 * np.pi * modes.frequency) / 0.02
    d = np.concatenate(list(found.damping.values()))
    K = np.concatenate([part.K for part in modes.bodies.values()])
    slope = gain @ error * np.sqrt(K)  # per relative change of d
    assert np.abs(slope[d > 1e-6 * np.sqrt(K)]).max() < 1e-5
    assert slope.min() > -1e-5
    own = {name: modal_damping(part, 0.02) for name, part in modes.bodies.items()}
    naive = np.diag(system_damping(modes, own)) / (4 * np.pi * modes.frequency)
    assert np.linalg.norm(error) < 0.5 * np.linalg.norm(naive / 0.02 - 1)


def test_component_modes_that_no_system_mode_needs_have_the_target_ratio():
    one = body(8, "free", modes=20)
    modes = synthesise({"a": one}, ground=["a.root"], modes=2)
    target = {0.1: 0.01, 5.0: 0.03}
    d = component_damping(modes, target).damping["a"]
    np.testing.assert_allclose(d, modal_damping(one, target), rtol=1e-6)


def test_least_squares_never_feed_energy_where_no_damping_fits():
    target = np.array([0.2, 0.0, 0.0, 0.2, 0.0, 0.0])
    found = component_damping(halves(modes=6), target)
    assert all(np.all(d >= 0) for d in found.damping.values())
    assert np.abs(found.achieved - target).max() > 1e-6  # and the report says so


def test_back_projection_is_positive_and_reports_what_the_blocks_lose(system):
    found = component_damping(system, 0.02, "back_projection")
    for d in found.damping.values():
        values = np.linalg.eigvalsh(d)
        assert values.min() > -1e-9 * values.max()
    C = system_damping(system, found.damping)
    np.testing.assert_allclose(np.diag(C) / (4 * np.pi * system.frequency), found.achieved, rtol=1e-12)
    size = np.sqrt(np.diag(C))
    assert found.coupling == pytest.approx(np.abs(C / size / size[:, None] - np.eye(len(C))).max(), rel=1e-9)


def test_without_the_restriction_to_blocks_back_projection_is_exact(system):
    """``C = K Phi diag(2 z / w^3) Phi^T K`` of all bodies together gives each mode its ratio and no coupling."""
    w = 2 * np.pi * system.frequency
    q = np.vstack([x[6:] for x in system.coordinates.values()])
    K = np.concatenate([b.K for b in system.bodies.values()])
    C = (K[:, None] * q * (0.04 / w**3)) @ (K[:, None] * q).T
    np.testing.assert_allclose(q.T @ C @ q / (0.04 * w), np.eye(len(w)), atol=1e-6)
    for name, d in component_damping(system, 0.02, "back_projection").damping.items():
        start = 0 if name == "a" else system.bodies["a"].n
        block = C[start : start + len(d), start : start + len(d)]
        np.testing.assert_allclose(d, block, atol=1e-12 * np.abs(block).max())


@pytest.mark.parametrize("method", ["least_squares", "back_projection"])
def test_achieved_ratios_are_those_of_the_multibody_system(method):
    """Complex roots ``-zeta w + i w sqrt(1 - zeta^2)`` of the simulated equations, the second body turned."""
    parts, turn = {"a": body(6), "b": body(8, "free")}, random_rotation(2)
    place = {"a": (np.zeros(3), np.eye(3)), "b": (np.array([10.0, 0, 0]), turn)}
    modes = synthesise(parts, [("a.tip", "b.root")], place, ["a.root"])
    target = Rayleigh(alpha=0.0, beta=2e-3)
    bodies = component_damping(modes, target, method).applied(parts)
    joints = (mp.Joint(name="0", type="weld", parent="ground", child="a"),
              mp.Joint(name="1", type="weld", parent="a.tip", child="b", rotation=turn))  # fmt: skip
    n = sum(part.n for part in parts.values())
    M, _ = mass_and_force(mp.System(bodies=bodies, joints=joints), np.zeros(2 * n))
    K = np.diag(np.concatenate([part.K for part in bodies.values()]))
    D = block_diag(*(part.damping_matrix for part in bodies.values()))
    state = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, D)]])
    roots = eig(state, right=False)
    roots = roots[roots.imag > 0]
    roots = roots[np.argsort(np.abs(roots))][:8]
    np.testing.assert_allclose(np.abs(roots) / (2 * np.pi), modes.frequency[:8], rtol=1e-7)
    np.testing.assert_allclose(-roots.real / np.abs(roots), target.ratio(modes.frequency[:8]), rtol=1e-6)


def test_rigid_motion_is_not_damped():
    modes = halves(ground=())
    for method in ("least_squares", "back_projection"):
        C = system_damping(modes, component_damping(modes, 0.02, method).damping)
        assert np.abs(C[:6]).max() < 1e-9 * np.abs(C).max()


def test_undamped_is_undamped(system):
    for method in ("least_squares", "back_projection"):
        assert component_damping(system, 0.0, method).achieved.max() == 0.0


def test_coupling_does_not_depend_on_the_size_of_the_damping(system):
    """Both methods are linear in the target, and coupling is the ratio of two of their sums."""
    found = [component_damping(system, ratio, "back_projection").coupling for ratio in (1e-2, 1e-8)]
    assert found[0] > 1e-3
    assert np.isclose(*found, rtol=1e-9)


@pytest.mark.parametrize(
    ("target", "message"),
    [
        (-0.01, "damping ratio -0.01 must not be negative"),
        ({1.0: 0.01, 2.0: -0.02}, "damping ratio -0.02 must not be negative"),
        ({}, "table of damping ratios is empty"),
        (np.array([0.01, 0.02]), "2 damping ratios for 6 modes"),
        (float("nan"), "damping ratio nan"),
    ],
)
def test_bad_ratios_are_refused(target, message):
    with pytest.raises(InputError, match=message):
        component_damping(halves(modes=6), target)


def test_unknown_method_and_rigid_systems_are_refused(system):
    with pytest.raises(InputError, match="did you mean 'least_squares'"):
        component_damping(system, 0.01, "least_square")
    with pytest.raises(InputError, match="no elastic mode"):
        component_damping(halves(modes=6, ground=()), 0.01)


def test_rayleigh_damping_of_a_body_is_alpha_plus_beta_k():
    """Also of one that moves without strain, whose ratio would be infinite."""
    arm = body(6)
    loose = arm.with_(K=np.concatenate([[0.0], arm.K[1:]]))
    np.testing.assert_allclose(modal_damping(loose, Rayleigh(alpha=0.3, beta=2e-4)), 0.3 + 2e-4 * loose.K, rtol=1e-14)


def test_one_ratio_in_a_list_is_for_one_mode():
    with pytest.raises(InputError, match="1 damping ratios for 3 modes"):
        damping_ratio(np.array([0.01]), np.ones(3))
