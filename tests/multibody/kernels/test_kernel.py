"""The order-n kernel function by function: the dense equations, finite differences, physical identities."""

import numpy as np
import pytest
from compare import assert_close
from multibody.trees import KINDS, ROOTS, directions, order_n, random_body, random_state, random_tree
from size import seeds

import modalprep as mp
from modalprep.multibody.kernels import articulated_body as kernel
from modalprep.multibody.kernels.interfaces import add_wrench, node_acceleration, node_state, world
from modalprep.multibody.model import joint_types
from modalprep.multibody.model.joint_types import FREE, SPHERICAL
from modalprep.multibody.packing.tree import pack
from modalprep.multibody.reference.equations import (
    body_states,
    dense_accelerations,
    energy_and_momentum,
    mass_and_force,
    node_motion,
)
from modalprep.vectors import skew


class Evaluation:
    """A random tree with random state, prescribed motion and hinge forces, packed."""

    def __init__(self, seed, **options):
        rng = np.random.default_rng(seed)
        self.system = random_tree(seed, root=ROOTS[seed % len(ROOTS)], **options)
        self.packed = pack(self.system)
        self.model = self.packed.model
        self.y = random_state(self.system, seed)
        self.motion = rng.standard_normal((len(self.packed.links), 3))
        self.tau = self.hinges(rng.standard_normal(self.packed.nu))
        self.data = self.packed.data()
        self.udot = np.zeros(self.packed.nu)

    def hinges(self, values):
        """Keep the hinges' rows, no modal ones."""
        values = values.copy()
        for row in self.model.links:
            values[row["uq"] : row["uq"] + row["modes"]] = 0.0
        return values

    def run(self, hinge=None, c1=0.0, c2=0.0):
        """Accelerations, with poses and velocities in the data."""
        kernel.outward(self.model, self.data, self.y, self.motion)
        world(self.model, self.data)
        assert kernel.inward(self.model, self.data, self.tau, hinge, c1, c2) == -1
        kernel.forward(self.model, self.data, self.tau, self.udot)
        return self.udot

    def dense(self):
        """M and f of the dense equations."""
        M, f = mass_and_force(self.system, self.y, self.motion)
        return M, f + self.tau

    def interface_partials(self, body, node):
        """Partial velocities (6, nu) and the rest of the acceleration (6,) of an interface, inertial axes."""
        states = body_states(self.system, self.packed, self.y, self.motion)
        s = states[self.system.order.index(body)]
        r, _, Phi, _, acc = node_motion(s.body, node, s.V[3:], s.q, s.qd)
        shift = np.block([[np.eye(3), -skew(r)], [np.zeros((3, 3)), np.eye(3)]])
        J = shift @ s.J
        J[:, s.rows] += Phi
        X = np.kron(np.eye(2), s.R)
        return X @ J, X @ (shift @ s.c + acc)

    def response(self, body, node, wrench):
        """Accelerations from a wrench at an interface alone."""
        kernel.clear_wrenches(self.model, self.data)
        force, torque = tuple(wrench[:3]), tuple(wrench[3:])
        add_wrench(self.model, self.data, self.packed.link_of(body), node, force, torque)
        zero = np.zeros(self.packed.nu)
        kernel.inward_bias(self.model, self.data, zero)
        kernel.forward_bias(self.model, self.data, zero, self.udot)
        return self.udot.copy()


ROUND_OFF = 1e-10  # of the largest; two eliminations of mass matrices of condition 1e5 or less


@pytest.mark.parametrize("most", [1, 6, 14])
@pytest.mark.parametrize("seed", seeds(20))
def test_order_n_equals_dense_on_random_trees(seed, most):
    e = Evaluation(seed, most=most, geometric=seed % 3 > 0)
    assert_close(e.run(), np.linalg.solve(*e.dense()), ROUND_OFF)


@pytest.mark.parametrize("kind", [*KINDS[1:-1], "mixed"])
@pytest.mark.parametrize("modes", [0, 3])
def test_residual_of_long_chains(kind, modes):
    """Forty bodies: the condition number grows, so M x = f is tested on its residual."""
    rng = np.random.default_rng(5)
    body = random_body(rng, modes)
    kinds = rng.choice(KINDS[1:-1], 40) if kind == "mixed" else [kind] * 40
    joints = tuple(
        mp.Joint(
            name=f"j{i}",
            type=k,
            parent=f"b{i - 1}.a" if i else "ground",
            child=f"b{i}",
            **directions(rng, k),
        )
        for i, k in enumerate(kinds)
    )
    system = mp.System(bodies={f"b{i}": body for i in range(40)}, joints=joints, gravity=np.array([0, 0, -9.81]))
    y = random_state(system, 3)
    motion = np.zeros((len(pack(system).links), 3))
    M, f = mass_and_force(system, y, motion)
    x, _ = order_n(system, y, motion)
    # measured 4e-16; a stable elimination leaves some units of round-off
    assert np.abs(M @ x - f).max() < 1e-14 * (np.abs(M) @ np.abs(x) + np.abs(f)).max()


@pytest.mark.parametrize("seed", range(12))
def test_unit_hinge_forces_give_the_inverse_mass_matrix(seed):
    e = Evaluation(seed)
    e.run()
    inverse = np.linalg.inv(e.dense()[0])
    columns = np.flatnonzero(e.hinges(np.ones(e.packed.nu)))
    kernel.clear_wrenches(e.model, e.data)
    for k in columns:
        unit = np.eye(e.packed.nu)[k]
        kernel.inward_bias(e.model, e.data, unit)
        kernel.forward_bias(e.model, e.data, unit, e.udot)
        assert_close(e.udot, inverse[:, k], ROUND_OFF)


@pytest.mark.parametrize("seed", range(12))
def test_unit_wrenches_at_interfaces(seed):
    """Columns of M^-1 G^T and the block G M^-1 G^T of two interfaces."""
    e = Evaluation(seed)
    e.run()
    M = e.dense()[0]
    (first, a), (second, b) = ((e.system.order[0], 1), (e.system.order[-1], 2))
    G, _ = e.interface_partials(first, a)
    K, _ = e.interface_partials(second, b)
    expected, found = np.linalg.solve(M, G.T), np.zeros((6, 6))
    for k, unit in enumerate(np.eye(6)):
        assert_close(e.response(first, a, unit), expected[:, k], ROUND_OFF)
        linear, angular = node_acceleration(e.model, e.data, e.packed.link_of(second), b, 0.0)
        found[:, k] = [*linear, *angular]
    # a free joint between the two decouples them: nothing but round-off of the terms remains
    assert np.abs(found - K @ expected).max() <= 1e-10 * (np.abs(K) @ np.abs(expected)).max()


@pytest.mark.parametrize("seed", range(12))
def test_acceleration_of_an_interface(seed):
    e = Evaluation(seed)
    udot, body = e.run(), e.system.order[-1]
    linear, angular = node_acceleration(e.model, e.data, e.packed.link_of(body), 1, 1.0)
    J, rest = e.interface_partials(body, 1)
    assert_close(np.array([*linear, *angular]), J @ udot + rest, ROUND_OFF)


@pytest.mark.parametrize("seed", range(8))
def test_wrench_of_an_evaluation(seed):
    """External wrenches count in `inward` as J^T times them in the dense equations."""
    e = Evaluation(seed)
    wrench, body = np.random.default_rng(seed).standard_normal(6), e.system.order[-1]
    kernel.outward(e.model, e.data, e.y, e.motion)
    world(e.model, e.data)
    link = e.packed.link_of(body)
    add_wrench(e.model, e.data, link, 2, tuple(wrench[:3]), tuple(wrench[3:]))
    kernel.inward(e.model, e.data, e.tau, None, 0.0, 0.0)
    kernel.forward(e.model, e.data, e.tau, e.udot)
    M, f = e.dense()
    assert_close(e.udot, np.linalg.solve(M, f + e.interface_partials(body, 2)[0].T @ wrench), ROUND_OFF)


@pytest.mark.parametrize("seed", seeds(20))
def test_implicit_terms_stand_in_the_rows_of_joints_and_modes(seed):
    e = Evaluation(seed)
    hinge = e.hinges(np.random.default_rng(seed).uniform(0.1, 2.0, e.packed.nu))
    added, c1, c2 = np.diag(hinge), 0.3, 0.7
    for link, row in zip(e.packed.links, e.model.links, strict=True):
        if link.body:
            body = e.system.bodies[link.body]
            own = slice(row["uq"], row["uq"] + body.n)
            added[own, own] = c1 * body.damping_matrix + c2 * np.diag(body.K)
    M, f = e.dense()
    assert_close(e.run(hinge, c1, c2), np.linalg.solve(M + added, f), ROUND_OFF)


@pytest.mark.parametrize("seed", range(6))
def test_force_of_a_prescribed_hinge_is_the_deleted_row(seed):
    """Free the prescribed hinge: with the force applied it accelerates as prescribed."""
    kind = ("prescribed", "sliding")[seed % 2]
    system = random_tree(seed, root=kind, prescribed=False)
    y, packed = random_state(system, seed), pack(system)
    motion = np.zeros((len(packed.links), 3))
    motion[0] = 0.3, -0.4, 0.5
    udot, forces = order_n(system, y, motion)
    freed = system.with_(joints=(system.joints[0].with_(motion=None), *system.joints[1:]))
    full = np.concatenate([[motion[0, 0]], y[: packed.nx], [motion[0, 1]], y[packed.nx :]])
    M, f = mass_and_force(freed, full)
    drive = forces[0, 5 if packed.turns(0) else 2]
    residual = M @ np.concatenate([[motion[0, 2]], udot]) - f
    np.testing.assert_allclose(residual, np.eye(len(f))[0] * drive, atol=1e-9 * max(1.0, np.abs(f).max()))


@pytest.mark.parametrize("seed", range(10))
def test_reaction_holds_the_hinge_force(seed):
    """Along a hinge's own axes the reaction is `tau`."""
    e = Evaluation(seed)
    _, forces = order_n(e.system, e.y, e.motion, e.tau)
    for i, kind in enumerate(e.packed.types):
        row, one = e.model.links[i], np.zeros((1, 6))
        one[0, [2, 5]] = row["along"], row["about"]
        axes = {SPHERICAL: np.eye(6)[3:], FREE: np.eye(6)}.get(kind, one)[: joint_types.KINDS[kind].speeds]
        tau = e.tau[row["u"] : row["u"] + len(axes)]
        np.testing.assert_allclose(axes @ forces[i], tau, atol=1e-10 * max(1.0, np.abs(forces).max()))


@pytest.mark.parametrize("seed", range(10))
def test_kinetic_energy_is_that_of_the_mass_matrix(seed):
    e = Evaluation(10 * (seed // len(ROOTS)) + seed, prescribed=False)
    e.motion[:] = 0.0
    M, u = e.dense()[0], e.y[e.packed.nx :]
    kinetic = energy_and_momentum(e.system.gravity, body_states(e.system, e.packed, e.y, e.motion))["kinetic"]
    assert u @ M @ u / 2 == pytest.approx(kinetic, rel=1e-12)


@pytest.mark.parametrize("seed", seeds(20))
def test_velocities_are_rates_of_the_poses(seed):
    """Position and rotation of every interface against their central differences along the state's own rate."""
    e = Evaluation(seed)
    ydot = np.zeros_like(e.y)
    kernel.kinematic(e.model, e.y, ydot)

    def states(t):
        motion = e.motion.copy()
        motion[:, 0] += t * motion[:, 1]
        kernel.outward(e.model, e.data, e.y + t * np.append(ydot[: e.packed.nx], 0 * e.udot), motion)
        world(e.model, e.data)
        links = [e.packed.link_of(body) for body in e.system.order]
        return [node_state(e.model, e.data, link, k) for link in links for k in range(3)]

    h = 1e-5
    for now, after, before in zip(states(0.0), states(h), states(-h), strict=True):
        velocity = np.subtract(after[0], before[0]) / (2 * h)
        turn = (np.subtract(after[1], before[1]) / (2 * h)).reshape(3, 3) @ np.reshape(now[1], (3, 3)).T
        np.testing.assert_allclose(now[2], velocity, atol=1e-8 * max(1.0, np.abs(velocity).max()))  # h^2
        np.testing.assert_allclose(skew(np.array(now[3])), turn, atol=1e-8 * max(1.0, np.abs(turn).max()))


@pytest.mark.parametrize("seed", range(10))
def test_poses_are_those_of_the_dense_reference(seed):
    e = Evaluation(seed)
    e.run()
    for name, s in zip(e.system.order, body_states(e.system, e.packed, e.y, e.motion), strict=True):
        for k in range(3):
            found = node_state(e.model, e.data, e.packed.link_of(name), k)
            r, R, _, _, _ = node_motion(s.body, k, s.V[3:], s.q, s.qd)
            np.testing.assert_allclose(found[0], s.p + s.R @ r, atol=1e-12)
            np.testing.assert_allclose(np.reshape(found[1], (3, 3)), s.R @ R, atol=1e-12)


def test_derivative_is_all_of_it():
    e = Evaluation(11)
    ydot = np.zeros_like(e.y)
    assert kernel.derivative(e.model, e.data, e.y, e.motion, e.tau, ydot) == -1
    rates = np.zeros_like(e.y)
    kernel.kinematic(e.model, e.y, rates)
    np.testing.assert_array_equal(ydot[: e.packed.nx], rates[: e.packed.nx])
    assert_close(ydot[e.packed.nx :], np.linalg.solve(*e.dense()), ROUND_OFF)


@pytest.mark.parametrize("kind", ["revolute", "prismatic", "spherical", "free"])
def test_pivot_that_is_not_positive_names_its_link(kind):
    rng = np.random.default_rng(0)
    good = random_body(rng, 0)
    bad = good.with_(m=-50.0, E0=-50 * good.E0)
    joints = tuple(
        mp.Joint(
            name=f"j{i}", type="revolute" if i != 1 else kind, parent=f"b{i - 1}.a" if i else "ground", child=f"b{i}"
        )
        for i in range(3)
    )
    system = mp.System(bodies={"b0": good, "b1": bad, "b2": good}, joints=joints)
    packed = pack(system)
    data = packed.data()
    arguments = (random_state(system, 0), np.zeros((3, 3)), np.zeros(packed.nu), np.zeros(packed.nu))
    assert kernel.accelerations(packed.model, data, *arguments) == 1


@pytest.mark.parametrize("most", [1, 6])
def test_nan_is_not_hidden(most):
    e = Evaluation(4, most=most)
    for k in range(len(e.y)):
        y = e.y.copy()
        y[k] = np.nan
        status = kernel.accelerations(e.model, e.data, y, e.motion, e.tau, e.udot)
        assert status >= 0 or np.isnan(e.udot).any()


def test_workspace_is_reused_without_traces():
    """An evaluation with a NaN leaves nothing behind for the next."""
    e = Evaluation(8)
    first = e.run().copy()
    kernel.accelerations(e.model, e.data, np.full_like(e.y, np.nan), e.motion, e.tau, e.udot)
    np.testing.assert_array_equal(e.run(), first)


def test_dense_accelerations_solve_the_same():
    e = Evaluation(2)
    M, f = mass_and_force(e.system, e.y, e.motion)
    assert_close(dense_accelerations(e.system, e.y, e.motion), np.linalg.solve(M, f), ROUND_OFF)
