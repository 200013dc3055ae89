"""Springs and bushings in implicit steps: the dense equations, order of convergence, steps as long as the motion."""

import numpy as np
import pytest

import modalprep as mp
from modalprep.examples import uniform_beam
from modalprep.multibody import AxialSpring
from modalprep.multibody.evaluation.evaluate import build_equations, evaluate, load, solve_implicit
from modalprep.multibody.evaluation.evaluator import start_state
from modalprep.multibody.evaluation.loading import Loading
from modalprep.multibody.kernels.articulated_body import kinematic
from modalprep.multibody.packing.tree import pack
from modalprep.multibody.reference.equations import mass_and_force

GRAVITY = np.array([0, -9.81, 0])


def rod():
    """Rod of 1 kg and 1 m, its root at one end."""
    ends = {"root": np.zeros(3), "end": np.array([1.0, 0, 0])}
    return mp.rigid_body(
        "rod", mass=1.0, centre=np.array([0.5, 0, 0]), inertia=np.diag([1e-2, 1 / 12, 1 / 12]), interfaces=ends
    )


def pair(stiffness, damping=0.0):
    """A rod on a hinge and a free one, joined by a bushing that lets it turn about z: a double pendulum when stiff."""
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="one")
    free = mp.Joint(name="free", type="free", parent="ground", child="two", position=np.array([1.0, 0, 0]))
    most = np.array([1.0, 1, 1, 1, 1, 0])
    mount = mp.multibody.Bushing(
        name="mount", between=("one.end", "two.root"), stiffness=stiffness * most, damping=damping * most
    )
    return mp.System(bodies={"one": rod(), "two": rod()}, joints=(hinge, free), loads=(mount,), gravity=GRAVITY)


def double_pendulum():
    system = pair(1.0)
    elbow = mp.Joint(name="elbow", type="revolute", parent="one.end", child="two")
    return system.with_(joints=(system.joints[0], elbow), loads=())


def tip(system, **options):
    run = mp.simulate(system, t_end=0.5, output_step=0.25, **options)
    return run["two.end.position"][-1], run


def explicit_steps(omega, t_end):
    """Steps that stability requires of DOP853 at a frequency (rad/s): it is stable up to h omega of about 6."""
    return omega * t_end / 6


def resting():
    """Flexible and rigid bodies held by unstretched bushings and a spring, so that only their stiffness counts."""
    beam = uniform_beam(modes=3)
    ball = mp.Joint(name="ball", type="spherical", parent="ground", child="beam")
    free = mp.Joint(name="free", type="free", parent="ground", child="two", position=beam.interface_position[1])
    mount = mp.multibody.Bushing(name="mount", between=("beam.tip", "two.root"), stiffness=np.arange(1.0, 7.0) * 1e3,
                       damping=np.arange(6.0) * 10)  # fmt: skip
    spring = AxialSpring(name="spring", between=("ground", "two.end"), stiffness=5e3, damping=20.0, free_length=2.0,
                            position=beam.interface_position[1] + [1.0, 2.0, 0.0])  # fmt: skip
    base = mp.multibody.Bushing(
        name="base", between=("ground", "beam.root"), stiffness=np.full(6, 7e3), damping=np.full(6, 3.0)
    )
    return mp.System(bodies={"beam": beam, "two": rod()}, joints=(ball, free), loads=(mount, spring, base))


def test_one_implicit_solve_is_the_dense_one():
    """``(M + c1 D + c2 K) x = F - D a - K b``; K and D by differences of accelerations, M of the dense equations."""
    system = resting()
    packed = pack(system)
    model = build_equations(packed, Loading(system, packed, 1.0))
    nx, nu = packed.nx, packed.nu
    y, base, moved = np.append(start_state(packed), 0.0), np.zeros(nx + nu + 1), np.zeros(nx + nu + 1)
    evaluate(model, 0.0, y, base)
    M, _ = mass_and_force(system, y[:-1], np.zeros((len(packed.links), 3)))
    matrices = []
    for rates in (False, True):
        columns = []
        for u in range(nu):
            near = nudged(packed, y, u, 1e-6, rates)
            evaluate(model, 0.0, near, moved)
            columns.append(-M @ (moved - base)[nx:-1] / 1e-6)
        matrices.append(np.array(columns).T)
    K, D = matrices
    rng = np.random.default_rng(0)
    a, b, found, c1, c2 = rng.standard_normal(nu), rng.standard_normal(nu), np.zeros(nu), 0.03, 0.001
    load(model, 0.0, y)
    assert solve_implicit(model, 0.0, y, c1, c2, a, b, False, found) == -1
    expected = np.linalg.solve(M + c1 * D + c2 * K, M @ base[nx:-1] - D @ a - K @ b)
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-5 * np.abs(expected).max())  # of the differences


def nudged(packed, y, u, d, rates):
    """State moved along speed u, or with that speed changed."""
    near, rate, nx = y.copy(), np.zeros(len(y)), packed.nx
    if rates:
        near[nx + u] += d
        return near
    near[nx + u] = 1.0
    kinematic(packed.model, near, rate)
    near[nx + u] = y[nx + u]
    near[:nx] += d * rate[:nx]
    return near


@pytest.mark.parametrize(("method", "order"), [("generalised_alpha", 2), ("rosenbrock", 3)])
def test_order_of_convergence_with_a_bushing(method, order):
    system = pair(1e3, damping=1.0)
    exact, _ = tip(system, method="explicit", rtol=1e-11, atol=1e-13)
    errors = [np.abs(tip(system, method=method, step=0.5 / n, rtol=1e-10)[0] - exact).max() for n in (100, 200)]
    assert order - 0.2 < np.log2(errors[0] / errors[1]) < order + 0.2


def test_the_motion_sets_the_step_not_the_bushing():
    """Rolling at 16 and 160 kHz against a swing: few of the steps of the explicit method, and the path of a hinge."""
    hinged, _ = tip(double_pendulum(), method="explicit", rtol=1e-10)
    steps = []
    for stiffness, share in ((1e8, 0.1), (1e10, 0.01)):
        found, run = tip(pair(stiffness), method="generalised_alpha", rtol=1e-4)
        np.testing.assert_allclose(found, hinged, atol=1e-3)
        assert run.stats["steps"] < share * explicit_steps(
            np.sqrt(stiffness / 1e-2), 0.5
        )  # the second rod rolls about its axis
        steps.append(run.stats["steps"])
    assert steps[1] < 1.5 * steps[0]


def test_a_stiff_spring_is_a_rod():
    """A block on an axial spring of 100 kHz swings as on a rod: energy of a point mass at the lowest place."""
    block = mp.rigid_body("block", mass=2.0, centre=np.zeros(3), inertia=np.eye(3), interfaces={"root": np.zeros(3)})
    free = mp.Joint(name="free", type="free", parent="ground", child="block", position=np.array([1.0, 0, 0]))
    spring = AxialSpring(name="spring", between=("ground", "block.root"), stiffness=8e11, free_length=1.0)
    system = mp.System(bodies={"block": block}, joints=(free,), loads=(spring,), gravity=GRAVITY)
    lowest = mp.Event(name="lowest", when="block.root.velocity.y", direction=1)
    run = mp.simulate(system, t_end=1.0, output_step=0.01, method="generalised_alpha", rtol=1e-5, events=(lowest,))
    radius = np.linalg.norm(run["block.root.position"], axis=1)
    np.testing.assert_allclose(radius, 1.0, atol=1e-4)
    quarter = 1.8540746773013719 / np.sqrt(9.81)  # complete elliptic integral of modulus sin(45 deg)
    assert run.events["lowest"][0] == pytest.approx(quarter, rel=1e-3)
    assert run.stats["steps"] < 0.02 * explicit_steps(np.sqrt(8e11 / 2.0), 1.0)


def test_auto_takes_generalized_alpha_for_stiff_bushings():
    """Rosenbrock's method loses its order where stiff bushings turn, and is not tried."""
    hinged, _ = tip(double_pendulum(), method="explicit", rtol=1e-10)
    found, run = tip(pair(1e8), rtol=1e-5)
    np.testing.assert_allclose(found, hinged, atol=5e-5)
    assert "implicit, generalized-alpha, chosen for" in run.message
    assert "Rosenbrock" not in run.message
