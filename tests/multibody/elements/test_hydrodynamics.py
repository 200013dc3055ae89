"""Rods in water: second implementation, closed forms of drag, added mass and buoyancy, conservation, bad input."""

import numpy as np
import pytest
from multibody.loaded_trees import order_n
from multibody.trees import random_state, random_tree

import modalprep as mp
from modalprep.body.rigid import rigid_body
from modalprep.multibody.packing.tree import pack
from modalprep.multibody.reference.loads import dense_loads, loaded_accelerations

G = 9.81
SHEARED = mp.multibody.Water(density=1.3, current=np.array([[0.5, -0.3, 0.2], [-0.4, 0.6, 0.1], [0.2, 0.1, -0.5]]),
                   depths=np.array([-2.0, 0.3, 3.0]), up=np.array([0.2, 0.9, -0.3]), surface=0.4)  # fmt: skip


def cable(mass_per_length=0.0, length=2.0, water=None, **options):
    """A uniform rod along x, 0.02 m thick; without a mass of its own almost nothing is left but the water."""
    m = mass_per_length * length
    inertia = np.diag([1e-9, 1, 1]) * m * length**2 / 12
    body = rigid_body("rod", mass=m, centre=np.array([length / 2, 0, 0]), inertia=inertia,
                      interfaces={"root": np.zeros(3), "tip": np.array([length, 0, 0])})  # fmt: skip
    around = mp.multibody.ImmersedRod(
        name="water", body="rod", diameter=0.02, water=water or mp.multibody.Water(), **options
    )
    return body, around


def system_of(body, around, joint):
    gravity = np.array([0, 0, -G])
    return mp.System(bodies={"rod": body}, joints=(joint,), gravity=gravity, loads=(around,))


@pytest.mark.parametrize("seed", range(6))
def test_rods_equal_the_dense_sum_of_strips_on_random_trees(seed):
    system = random_tree(seed, root=["free", "revolute", "prescribed"][seed % 3], most=1)
    rods = tuple(
        mp.multibody.ImmersedRod(
            name=name, body=name, ends=ends, diameter=0.6, tangential_drag=0.3, added_mass=1.4, water=water
        )
        for name, ends, water in (
            ("b0", ("a", "b"), SHEARED),
            ("b1", ("root", "a"), mp.multibody.Water(current=np.ones(3))),
        )
    )
    system = system.with_(loads=rods)
    y, packed = random_state(system, seed, size=1.0), pack(system)
    found, energies, loading = order_n(system, y, 0.3)
    expected = loaded_accelerations(system, y, loading.motion, 0.3)
    np.testing.assert_allclose(found, expected, atol=1e-10 * np.abs(expected).max())
    dense = dense_loads(system, packed, y, loading.motion, 0.3)
    for one, other in zip(energies, (dense.power, dense.stored, dense.gravity), strict=True):
        assert one == pytest.approx(other, rel=1e-11)


def test_a_horizontal_cable_falls():
    """``V = sqrt(w / (rho Cn d / 2))``; before, ``v = V tanh(t / T)`` with the added mass."""
    around = cable(1.0)[1]
    m = 5.0 / G + around.displaced
    body, around = cable(m)
    fall = mp.Joint(name="fall", type="free", parent="ground", child="rod")
    run = mp.simulate(system_of(body, around, fall), t_end=3.0, output_step=0.05, rtol=1e-10)
    V = np.sqrt(5.0 / (1025.0 * 1.2 * 0.02 / 2))  # 0.64 m/s
    T = (m + around.added) * np.sqrt(5.0 / around.normal) / 5.0
    np.testing.assert_allclose(run["rod.root.velocity.z"], -V * np.tanh(run.time / T), atol=1e-9)
    assert run.stats["energy_error"] < 1e-9


@pytest.mark.parametrize("speed", [2.0, 5.0])
def test_critical_angle_of_a_towed_cable(speed):
    """A straight cable is towed where weight and drag balance across it: ``w cos p = k sin^2 p``."""
    around = cable(1.0)[1]
    body, around = cable(5.0 / G + around.displaced, water=mp.multibody.Water(current=np.array([-speed, 0, 0])))
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="rod", axis=np.array([0, 1.0, 0]), angle=2.0)
    rest = mp.static_equilibrium(system_of(body, around, hinge))
    assert rest.stable
    drag = 1025.0 * 1.2 * 0.02 / 2 * speed**2
    angle = np.arccos((-5.0 + np.sqrt(5.0**2 + 4 * drag**2)) / (2 * drag))  # 18.1 and 7.3 degrees
    assert np.pi - rest.joints["hinge"][0] == pytest.approx(angle, rel=1e-8)


def test_drag_ends_a_spin():
    """About one end the drag torque is ``rho Cn d w^2 L^4 / 8``: ``1 / w`` grows linearly, with the added inertia."""
    body, around = cable(0.9)
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="rod", rate=3.0)
    run = mp.simulate(system_of(body, around, hinge), t_end=2.0, rtol=1e-10)
    L = 2.0
    slope = around.normal * L**4 / 4 / ((0.9 + around.added) * L**3 / 3)
    np.testing.assert_allclose(1 / run["hinge.rate"], 1 / 3.0 + slope * run.time, rtol=1e-9)


@pytest.mark.parametrize("drag", [0.0, 1.2])
def test_energy_balances(drag):
    """A tumbling free rod in a sheared current: it, the water that it moves, weight and buoyancy against the work."""
    water = SHEARED.with_(density=1025.0)
    body, around = cable(0.9, water=water, normal_drag=drag, tangential_drag=drag / 9, added_mass=1.7)
    free = mp.Joint(name="free", type="free", parent="ground", child="rod", velocity=np.array([0.8, 0.5, -0.2]),
                    angular_velocity=np.array([0.5, 2.0, -1.0]))  # fmt: skip
    run = mp.simulate(system_of(body, around, free), t_end=2.0, rtol=1e-10, atol=1e-12)
    assert run.stats["energy_error"] < 1e-9
    assert np.ptp(run["energy.stored"]) > 0.1 * np.ptp(run["energy.kinetic"])


def test_a_pendulum_in_ideal_water_swings_by_its_inertia_and_weight():
    """Without drag: ``(m + m_a) L^2 / 3 t'' = -(m - m_d) g L / 2 sin t``, and all energy stays."""
    body, around = cable(0.9, normal_drag=0.0, tangential_drag=0.0, added_mass=1.7)
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="rod", axis=np.array([0, 1.0, 0]),
                     angle=np.pi / 2 - 1.0)  # fmt: skip
    run = mp.simulate(system_of(body, around, hinge), t_end=3.0, rtol=1e-10, atol=1e-12)
    assert np.abs(run["energy.work"]).max() < 1e-9
    square = 3 * G * (0.9 - around.displaced) / (2 * 2.0 * (0.9 + around.added))
    fall = np.cos(np.pi / 2 - run["hinge.angle"]) - np.cos(1.0)
    np.testing.assert_allclose(run["hinge.rate"] ** 2, 2 * square * fall, atol=1e-8)


def test_motion_is_seen_the_same_from_the_moving_water():
    """Galilei: a rod in a current, and the same rod in still water that starts that much slower."""
    U, start = np.array([0.7, -0.4, 0.3]), np.array([0.5, 0.2, 0.1])
    runs = []
    for current in (U, 0 * U):
        body, around = cable(0.9, water=mp.multibody.Water(current=current), tangential_drag=0.05)
        free = mp.Joint(name="free", type="free", parent="ground", child="rod", velocity=start - U + current,
                        angular_velocity=np.array([0.5, 2.0, -1.0]))  # fmt: skip
        runs.append(mp.simulate(system_of(body, around, free), t_end=1.0, rtol=1e-10))
    one, two = (run["rod.tip.position"] for run in runs)
    np.testing.assert_allclose(one - U * runs[0].time[:, None], two, atol=1e-8)


def test_buoyancy_and_central_gravity_do_not_see_the_water_that_moves():
    """A rod as dense as water hangs still; its added mass weighs nothing."""
    displaced = cable(1.0)[1].displaced
    body, around = cable(displaced)
    free = mp.Joint(name="free", type="free", parent="ground", child="rod", rotation=np.eye(3)[[1, 2, 0]])
    run = mp.simulate(system_of(body, around, free), t_end=1.0)
    assert np.abs(run["rod.tip.acceleration"]).max() < 1e-12 * G


@pytest.mark.parametrize(
    ("make", "match"),
    [
        (lambda: mp.multibody.Water(density=0.0), "density = 0 must be positive"),
        (lambda: mp.multibody.Water(depths=np.array([0.0, 1.0])), "2 depths and a current of shape"),
        (lambda: mp.multibody.Water(up=np.zeros(3)), "no direction"),
        (lambda: mp.multibody.ImmersedRod(name="r", body="rod", diameter=-1.0), "diameter = -1"),
        (lambda: refused(body="rood"), "body 'rood' does not exist"),
        (lambda: refused(ends=("root", "tpi")), "interface 'tpi' does not exist"),
        (lambda: refused(ends=("root", "root")), "are at one point"),
    ],
)
def test_what_cannot_be_is_refused(make, match):
    with pytest.raises(mp.InputError, match=match):
        make()


def refused(**change):
    body, around = cable(1.0)
    return system_of(body, around.with_(**change), mp.Joint(name="j", type="free", parent="ground", child="rod"))


def test_flexible_bodies_are_refused():
    from modalprep.examples import uniform_beam

    joint = mp.Joint(name="j", type="free", parent="ground", child="rod")
    with pytest.raises(mp.InputError, match="is flexible; divide it into rigid rods"):
        system_of(uniform_beam(modes=1), cable(1.0)[1], joint)
