"""Loads of the kernel: second implementation, virtual work, order of the approximation, laws in closed form."""

import numpy as np
import pytest
from multibody.loaded_trees import element, loaded_tree, order_n
from multibody.trees import random_body, random_state
from scipy.spatial.transform import Rotation

import modalprep as mp
from modalprep.multibody.elements import hinge
from modalprep.multibody.elements.bushing import rotation_vector
from modalprep.multibody.kernels import articulated_body as kernel
from modalprep.multibody.kernels.loads.gravity import central_field, gravity_law
from modalprep.multibody.packing.tree import pack, rows
from modalprep.multibody.reference.loads import dense_loads, loaded_accelerations


@pytest.mark.parametrize("seed", range(12))
def test_order_n_equals_dense_under_every_load(seed):
    system = loaded_tree(seed)
    y = random_state(system, seed)
    found, energies, loading = order_n(system, y, 0.3)
    expected = loaded_accelerations(system, y, loading.motion, 0.3)
    assert np.abs(found - expected).max(initial=0.0) <= 1e-10 * np.abs(expected).max(initial=1e-300)
    dense = dense_loads(system, pack(system), y, loading.motion, 0.3)
    np.testing.assert_allclose(energies, dense[1:4], rtol=1e-11, atol=1e-11)


def moved(system, y, h):
    """State after a time h at constant speeds: its coordinates by a fourth-order step, as small as h."""
    packed = pack(system)
    nx, rates = packed.nx, np.zeros(len(y))

    def slope(x):
        kernel.kinematic(packed.model, np.concatenate([x, y[nx:]]), rates)
        return rates[:nx].copy()

    a = slope(y[:nx])
    b = slope(y[:nx] + h / 2 * a)
    c = slope(y[:nx] + h / 2 * b)
    return np.concatenate([y[:nx] + h / 6 * (a + 2 * b + 2 * c + slope(y[:nx] + h * c)), y[nx:]])


@pytest.mark.parametrize("seed", range(8))
def test_stored_energy_changes_by_the_work_of_its_forces(seed):
    """d(stored + potential)/dt = power of what is no potential - f.u, in every direction of motion."""
    system = loaded_tree(4 * seed + 1)
    joints = tuple(j.with_(motion=None, type="revolute") if j.motion else j for j in system.joints)
    system = system.with_(joints=joints)
    packed, y, h = pack(system), random_state(system, seed), 1e-3

    def energies(state):
        dense = dense_loads(system, packed, state, np.zeros((len(packed.links), 3)), 0.3)
        return dense.stored + dense.gravity, dense.power - dense.f @ state[packed.nx :]

    sides = [energies(moved(system, y, k * h))[0] for k in (-2, -1, 1, 2)]
    rate = (sides[0] - 8 * sides[1] + 8 * sides[2] - sides[3]) / (12 * h)
    assert rate == pytest.approx(energies(y)[1], rel=1e-7)  # fourth-order difference at 1e-3 of the motion's time


@pytest.mark.parametrize("modes", [0, 3])
def test_slope_is_the_derivative_of_the_hinge_force(modes):
    rng = np.random.default_rng(3)
    rod = random_body(rng, modes)
    joint = mp.Joint(name="j", type="cylindrical", parent="ground", child="rod",
                     elements=(element(rng, True), element(rng, True)))  # fmt: skip
    system = mp.System(bodies={"rod": rod}, joints=(joint,))
    packed, h = pack(system), 1e-6
    y = random_state(system, 5)
    slope = order_n(system, y, 0.2)[2].slope.copy()
    for k, link in enumerate(packed.links_of("j")):
        row = packed.model.links[link]
        for which, at in ((0, row["x"]), (1, packed.nx + row["u"])):
            step = h * np.eye(len(y))[at]
            difference = (order_n(system, y + step, 0.2)[2].tau - order_n(system, y - step, 0.2)[2].tau) / (2 * h)
            assert slope[which, k] == pytest.approx(difference[k], rel=1e-6)


def particles(seed):
    """The particles of `random_body` with one mode, and the body without geometric stiffness."""
    rng = np.random.default_rng(seed)
    body = random_body(rng, 2, geometric=False)
    rng = np.random.default_rng(seed)
    mass, x = rng.uniform(0.5, 1.0, 30), rng.standard_normal((30, 3))
    shape = rng.standard_normal((30, 3, 2)) * 0.3
    gram = np.einsum("p,pai,paj->ij", mass, shape, shape)
    return body, mass, x, shape @ np.linalg.inv(np.linalg.cholesky(gram)).T


def test_central_gravity_is_the_sum_over_particles_to_third_order():
    """Error of force and moment against the field at every particle: one power of size / R beyond what is kept."""
    body, mass, x, shape = particles(2)
    q, mu = np.array([0.1, -0.2]), 1.0
    r = x + shape @ q
    errors = []
    for R in (100.0, 200.0):
        centre = np.array([0.48, -0.6, 0.64]) * R
        system = mp.System(
            bodies={"b": body},
            joints=(mp.Joint(name="j", type="free", parent="ground", child="b"),),
            loads=(mp.multibody.CentralGravity(mu=mu, centre=centre),),
        )
        y = np.concatenate([[0, 0, 0, 1, 0, 0, 0], q, np.zeros(8)])
        f = dense_loads(system, pack(system), y, np.zeros((1, 3)), 0.0).f
        d = r - centre
        each = -mu * mass[:, None] * d / np.linalg.norm(d, axis=1)[:, None] ** 3
        exact = np.concatenate([each.sum(axis=0), np.cross(r, each).sum(axis=0), np.einsum("pa,pai->i", each, shape)])
        errors.append(np.abs(f - exact).reshape(-1, 2).max(axis=1))
    order = np.log2(errors[0] / errors[1])
    force, moment, modal = order[0], order[2], order[3]
    assert force == pytest.approx(5, abs=0.15)  # g (size / R)^3
    assert moment == pytest.approx(4, abs=0.15)  # g size (size / R)^2: the gradient is exact
    assert modal == pytest.approx(4, abs=0.15)


def test_gravity_gradient_torque_of_a_rigid_body():
    """3 mu / R^3 n x J n about the centre of mass."""
    J = np.diag([3.0, 5.0, 7.0])
    d = np.array([2.0, -6.0, 3.0])
    _, torque, _ = gravity_law(central_field(1.0, tuple(d)), 1.0, (0.0, 0.0, 0.0), (3.0, 0.0, 0.0, 5.0, 0.0, 7.0))
    n = d / 7
    np.testing.assert_allclose(torque, 3 / 343 * np.cross(n, J @ n), rtol=1e-14)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-4, 0.00999, 0.01001, 0.5, 2.0, 3.1])
def test_rotation_vector(angle):
    expected = angle * np.array([2, -1, 2]) / 3
    found, g = rotation_vector(tuple(Rotation.from_rotvec(expected).as_matrix().ravel()))
    np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-15)
    half = angle / 2
    exact = (1 - half / np.tan(half)) / angle**2 if angle > 1e-3 else 1 / 12 + angle**2 / 720
    assert g == pytest.approx(exact, rel=1e-9)


def test_limits_push_and_never_pull():
    stop = mp.multibody.HingeElement(lower=-1.0, upper=2.0, limit_stiffness=10.0, limit_damping=0.5)
    (constants,) = rows(hinge.ROW, [(-1, 0, -1, *(getattr(stop, name) for name in hinge.CONSTANTS))])
    for x, u, tau in (
        (1.9, 3, 0),
        (2.5, 0, -5),
        (2.5, 1, -7.5),
        (2.5, -3, 0),
        (-1.5, 0, 5),
        (-1.5, -1, 7.5),
        (-1.5, 3, 0),
    ):
        force, power, stored, *_ = hinge.law(constants, float(x), float(u), 0.0)
        assert force == pytest.approx(tau)
        p = max(x - 2, -1 - x, 0)
        assert stored == pytest.approx(5 * p * p)
        assert power == pytest.approx(tau * u - (-10 * p * u if x > 2 else 10 * p * u))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: mp.multibody.HingeElement(stiffness=-1), "stiffness = -1 must not be negative"),
        (
            lambda: mp.multibody.HingeElement(lower=1.0, upper=0.0, limit_stiffness=1.0),
            "lower = 1 must be below upper = 0",
        ),
        (lambda: mp.multibody.HingeElement(lower=1.0), "limits need a stiffness"),
        (
            lambda: mp.multibody.HingeElement(friction=1.0, transition_velocity=0.0),
            "transition_velocity = 0 must be positive",
        ),
        (lambda: mp.PointForce(name="f", at="a.b", force=(1, 2)), "force 'f': force has 2 components; give three"),
        (lambda: mp.PointForce(name="f", at="a.b", axes="world"), "axes 'world' is neither"),
        (lambda: mp.multibody.AxialSpring(name="s", between=("a.b", "a.b")), "spring 's': joins a.b and a.b"),
        (lambda: mp.multibody.AxialSpring(name="s", between=("a.b", "c.d"), damping=-2), "spring 's': damping = -2"),
        (
            lambda: mp.multibody.Bushing(name="k", between=("a.b", "c.d"), stiffness=np.ones(3)),
            "bushing 'k': stiffness has 3",
        ),
        (lambda: mp.multibody.CentralGravity(mu=0.0), "mu = 0 must be positive"),
        (lambda: loaded(mp.PointForce(name="f", at="bod.tip")), "force 'f': body 'bod' does not exist; did you mean"),
        (lambda: loaded(mp.PointForce(name="f", at="body.tip")), "names no interface; body has root, a, b"),
        (lambda: loaded(mp.PointForce(name="f", at="ground")), "force 'f' is on the ground"),
        (
            lambda: loaded(mp.multibody.AxialSpring(name="s", between=("ground", "body.c"))),
            "spring 's': 'body.c' names no inter",
        ),
        (
            lambda: loaded(mp.multibody.DistributedForce(name="d", body="bdy", force=np.ones((3, 3)))),
            "did you mean 'body'",
        ),
        (
            lambda: loaded(mp.multibody.DistributedForce(name="d", body="body", force=np.ones((5, 3)))),
            "each of the 3 points",
        ),
        (
            lambda: loaded(mp.multibody.CentralGravity(mu=1.0), mp.multibody.CentralGravity(mu=2.0)),
            "at most one central gravity field",
        ),
        (
            lambda: loaded(elements=2 * (mp.multibody.HingeElement(),)),
            "2 hinge elements, but a revolute joint needs 1",
        ),
        (
            lambda: loaded(elements=mp.multibody.HingeElement(), motion=mp.multibody.TimeFunction("t")),
            "its motion is prescribed",
        ),
        (lambda: loaded(elements=3 * (mp.multibody.HingeElement(stiffness=1.0),), type="spherical"), "use a bushing"),
    ],
)
def test_bad_loads_get_one_message(make, words):
    with pytest.raises(mp.InputError, match=words) as refused:
        make()
    assert "\n" not in str(refused.value)


def loaded(*loads, **joint):
    body = random_body(np.random.default_rng(0), 1)
    hinge = mp.Joint(**{"name": "j", "type": "revolute", "parent": "ground", "child": "body", **joint})
    return mp.System(bodies={"body": body}, joints=(hinge,), loads=loads)


@pytest.mark.parametrize(
    ("result", "words"),
    [
        ([1, 2], "callback 'c' returned list; return a dictionary"),
        ({"body.tip": [1, 2, 3]}, "callback 'c': load on 'body.tip': 'body.tip' names no interface"),
        ({"body.a": [1, 2]}, "load on 'body.a' has 2 numbers; give a force"),
        ({"j": [1, 2]}, "load on 'j' has 2 numbers; give 1"),
        ({"j": np.nan}, "load on 'j' is not finite at t = 0.3 s"),
        ({"ground": [1, 2, 3]}, "has no effect"),
    ],
)
def test_bad_callbacks_get_one_message(result, words):
    system = loaded(mp.multibody.Callback(name="c", function=lambda t, state: result))
    with pytest.raises(mp.InputError, match=words):
        order_n(system, random_state(system, 0), 0.3)
