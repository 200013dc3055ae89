"""Closed loops with more conditions than they need, or in singular positions, move as they should, over revolutions."""

import numpy as np
import pytest
from compare import assert_close
from multibody.spatial_loops import bricard, planar, rod, spatial_loop
from scipy.spatial.transform import Rotation
from size import FULL, cases, some

import modalprep as mp

A, B, TWIST = 1.0, 1.4, np.radians(30.0)  # sin(twist of b) / b = sin(twist of a) / a (Bennett 1903)
OTHER = np.arcsin(B / A * np.sin(TWIST))


def axis(angle):
    return np.array([0.0, -np.sin(angle), np.cos(angle)])


def about_x(angle):
    return Rotation.from_rotvec([angle, 0, 0]).as_matrix()


def link(length):
    """A uniform rod."""
    across = length**2 / 12
    return mp.rigid_body(
        "rod", mass=1.0, centre=np.array([length / 2, 0, 0]), inertia=np.diag([0.01, across, across]),
        interfaces={"root": np.zeros(3), "tip": np.array([length, 0, 0])},
    )  # fmt: skip


def bennett(pin, **more):
    """Four links of lengths a, b, a, b and twists alternately; the ground is one of them."""
    bodies = {"one": link(A), "two": link(B), "three": link(A)}
    start = 0.8
    between = 2 * np.arctan(np.sin((OTHER + TWIST) / 2) / np.sin((OTHER - TWIST) / 2) / np.tan(start / 2))
    joints = (
        mp.Joint(name="one", type="revolute", parent="ground", child="one", angle=start, rate=1.0, keep_start=True),
        mp.Joint(name="two", type="revolute", parent="one.tip", child="two", axis=axis(TWIST), rotation=about_x(TWIST),
                 angle=between),
        mp.Joint(name="three", type="revolute", parent="two.tip", child="three", axis=axis(OTHER),
                 rotation=about_x(OTHER), angle=-start),
    )  # fmt: skip
    closure = mp.multibody.Closure(
        name="pin", type=pin, a="ground", b="three.tip", position=np.array([-B, 0, 0]), **more
    )
    return mp.System(bodies=bodies, joints=joints, closures=(closure,), gravity=np.array([0, 0, -9.81]))


PINS = {"spherical": {}, "revolute": {"axis": axis(-OTHER), "rotation": about_x(-OTHER - TWIST)}}


@pytest.mark.parametrize("pin", PINS)
@pytest.mark.parametrize("rtol", [1e-5, 1e-8])
def test_bennetts_linkage_turns(pin, rtol):
    """It has one degree of freedom by its lengths and twists alone; energy stays through the collinear positions.

    The closing angles are ``tan(one / 2) tan(two / 2) = sin((b + a) / 2) / sin((b - a) / 2)``, a, b the twists.
    """
    run = mp.simulate(bennett(pin, **PINS[pin]), t_end=5.0, rtol=rtol, output_step=0.02)
    assert run.status == "done"
    assert np.ptp(run["one.angle"]) > 2.0  # through the collinear position at zero
    assert run.stats["energy_error"] < 100 * rtol
    product = np.tan(run["one.angle"] / 2) * np.tan(run["two.angle"] / 2)
    expected = np.sin((OTHER + TWIST) / 2) / np.sin((OTHER - TWIST) / 2)
    away = np.abs(np.sin(run["one.angle"])) > 0.1  # tangents of half turns are large
    np.testing.assert_allclose(product[away], expected, rtol=1e-6)
    np.testing.assert_allclose(run["three.angle"], -run["one.angle"], atol=1e-7)


@pytest.mark.parametrize("method", ["rosenbrock", "generalised_alpha"])
def test_bennetts_linkage_by_implicit_methods(method):
    run = mp.simulate(bennett("spherical"), t_end=2.0, rtol=1e-6, method=method)
    exact = mp.simulate(bennett("spherical"), t_end=2.0, rtol=1e-9)
    assert np.abs(run["one.angle"] - exact["one.angle"]).max() < 1e-3
    assert np.abs(exact["one.angle"][-1] - exact["one.angle"][0]) > 0.1


def test_bennetts_linkage_is_driven():
    """Its first joint follows a law through two revolutions."""
    system = bennett("spherical")
    first = system.joints[0].with_(motion="0.8 + t", angle=0.0, rate=0.0, keep_start=False)
    run = mp.simulate(system.with_(joints=(first, *system.joints[1:])), t_end=4 * np.pi, rtol=1e-7, output_step=0.05)
    assert run.status == "done"
    assert run.stats["energy_error"] < 1e-4
    turned = np.unwrap(run["three.angle"])
    np.testing.assert_allclose(turned, turned[0] - run.time, atol=1e-6)


def leg(along):
    """A rod of one metre along an axis."""
    return mp.rigid_body(
        "leg", mass=1.0, centre=along / 2, inertia=(np.eye(3) - np.outer(along, along)) / 12,
        interfaces={"root": np.zeros(3), "tip": along},
    )  # fmt: skip


def sarrus(angle, rate):
    """A plate on two pairs of legs that fold in planes across each other: it can only rise and sink."""
    x, y = np.eye(3)[:2]
    plate = mp.rigid_body(
        "plate", mass=2.0, centre=np.array([0.5, 0, 0]), inertia=np.diag([0.1, 0.1, 0.2]),
        interfaces={"root": np.zeros(3), "edge": np.array([0.5, -0.5, 0])},
    )  # fmt: skip
    bodies = {"a1": leg(x), "a2": leg(x), "plate": plate, "b1": leg(y), "b2": leg(y)}
    joints = [
        ("a1", "ground", y, angle - np.pi, rate, np.array([-0.5, 0, 0])),
        ("a2", "a1.tip", y, np.pi - 2 * angle, -2 * rate, np.zeros(3)),
        ("plate", "a2.tip", y, angle, rate, np.zeros(3)),
        ("b1", "ground", x, np.pi - angle, -rate, np.array([0, -0.5, 0])),
        ("b2", "b1.tip", x, 2 * angle - np.pi, 2 * rate, np.zeros(3)),
    ]
    tree = tuple(
        mp.Joint(name=child, type="revolute", parent=parent, child=child, axis=about, angle=start, rate=speed,
                 position=place)
        for child, parent, about, start, speed, place in joints
    )  # fmt: skip
    closure = mp.multibody.Closure(name="loop", type="revolute", a="plate.edge", b="b2.tip", axis=x)
    return mp.System(bodies=bodies, joints=tree, closures=(closure,), gravity=np.array([0, 0, -9.81]))


@pytest.mark.parametrize("rtol", [1e-5, 1e-8])
def test_sarruss_linkage_lifts_its_plate_straight(rtol):
    """Thrown up from 0.6 rad to nearly stretched legs, and back: the plate stays level, and energy stays."""
    run = mp.simulate(sarrus(0.6, 2.0), t_end=0.6, rtol=rtol, output_step=0.01)
    assert run.status == "done"
    assert run.stats["energy_error"] < 100 * rtol
    turned = run["plate.orientation"]
    np.testing.assert_allclose(np.abs(turned[:, 0]), 1.0, atol=1e-12)
    np.testing.assert_allclose(run["plate.origin"][:, :2], [[-0.5, 0.0]] * len(run.time), atol=1e-8)
    np.testing.assert_allclose(run["plate.origin"][:, 2], 2 * np.sin(np.pi + run["a1.angle"]), atol=1e-8)
    assert np.ptp(run["plate.origin"][:, 2]) > 0.2


@pytest.mark.parametrize(
    ("method", "rtol"),
    [("explicit", 1e-4), ("explicit", 1e-6), ("explicit", 1e-8), ("rosenbrock", 1e-5), ("generalised_alpha", 1e-5)],
)
def test_bricards_linkage_turns_inside_out(method, rtol):
    """No freedom by count, one by its lengths and twists: angles alternate, and it goes round four times."""
    start = np.array([1.2, np.arccos(-np.cos(1.2) / (1 + np.cos(1.2)))])
    run = mp.simulate(
        spatial_loop(bricard(1.2), rod, rates=[8.0]), t_end=10.0, rtol=rtol, method=method, output_step=0.02
    )
    assert run.status == "done"
    left_out = run.message.count("displacement") + run.message.count("rotation")
    assert left_out == 1  # of five conditions on five angles, so that one is free
    angle = {k: run[f"j{k}.angle"] + start[k % 2] for k in range(5)}
    for k in (2, 3, 4):
        assert_close(angle[k], angle[k % 2], 1e-4 if rtol > 1e-6 else 1e-7, name=f"angle {k}")
    c, d = np.cos(angle[0]), np.cos(angle[1])
    assert_close(c + d + c * d, np.zeros(len(c)), 1e-4 if rtol > 1e-6 else 1e-6, scale=1.0)
    round_and_round = np.unwrap(np.arctan2(angle[1], angle[0]))
    assert np.ptp(round_and_round) > 8 * np.pi
    assert run.stats["energy_error"] < 100 * rtol


def turned(seed):
    return Rotation.random(random_state=seed).as_matrix()


FOUR_BARS = {"parallelogram": (1.0, 2.0), "rhombus": (1.0, 1.0)}


def parallelogram(shape, start, seed, speed=9.0):
    """Cranks and coupler that turn in a plane anywhere in space, all joints revolute; closed as drawn."""
    crank, coupler = FOUR_BARS[shape]
    end = crank * np.array([np.cos(start), np.sin(start)])
    across = np.array([coupler, 0.0])
    pairs = planar([np.zeros(2), end, end + across, across], turned(seed))
    return spatial_loop(pairs, rod, rates=[speed, -speed, speed])


@pytest.mark.parametrize("shape", FOUR_BARS)
@pytest.mark.parametrize("start", [0.7, 0.0])
@pytest.mark.parametrize(
    ("method", "rtol"), [("explicit", 1e-4), ("explicit", 1e-6), ("explicit", 1e-8), ("rosenbrock", 1e-6)]
)
def test_parallelograms_pass_their_change_points(shape, start, method, rtol):
    """From between them, and from one of them: where all bars are in line, the other branch begins; speed decides."""
    for seed in range(4 if FULL else 2):
        run = mp.simulate(parallelogram(shape, start, seed), t_end=5.0, rtol=rtol, method=method, output_step=0.02)
        assert run.status == "done"
        assert np.ptp(np.unwrap(run["j0.angle"])) > 8 * np.pi
        assert run.stats["energy_error"] < max(100 * rtol, 1e-5)  # output between steps
        assert_close(run["j1.angle"], -run["j0.angle"], 1e-6 if rtol < 1e-5 else 1e-3, name="coupler")


CROSSED = [19, 30, 33, 41, 63, 66, 69, 79, 91, 100, 110, 138]  # round-off of these planes once decided a step


@pytest.mark.parametrize("shape", FOUR_BARS)
def test_change_points_are_passed_in_any_plane(shape):
    """Stages and dense output of a step come as near a change point as they happen to: nothing is seen of it.

    Explicit steps of 1e-8 are short enough for output between them to have their accuracy too.
    """
    for seed in some([*CROSSED, *range(200, 200 + cases(20))], cases(24)):
        for start in (0.7, 0.0):
            run = mp.simulate(
                parallelogram(shape, start, seed), t_end=5.0, rtol=1e-8, method="explicit", output_step=0.02
            )
            assert run.status == "done", (seed, start)
            assert run.stats["energy_error"] < 1e-5, (seed, start)
            assert_close(run["j1.angle"], -run["j0.angle"], 1e-6, name=f"coupler of {seed}, {start}")


@pytest.mark.parametrize(("shape", "start", "seed"), [("parallelogram", 0.7, 1521), ("rhombus", 0.0, 558)])
def test_implicit_steps_do_not_end_in_change_points(shape, start, seed):
    """Round-off of these planes once led a step into a change point, where the next ones collapsed."""
    run = mp.simulate(parallelogram(shape, start, seed), t_end=5.0, rtol=1e-6, method="rosenbrock", output_step=0.02)
    assert run.status == "done"
    assert run.stats["energy_error"] < 1e-4
    assert_close(run["j1.angle"], -run["j0.angle"], 1e-6, name="coupler")


@pytest.mark.parametrize(("method", "rtol"), [("explicit", 1e-4), ("explicit", 1e-8), ("rosenbrock", 1e-6)])
def test_four_bar_in_space_turns_over(method, rtol):
    """Crank rocker of lengths 1, 3, 2.5 and 3.5 with revolute joints, three conditions too many, ten turns."""
    crank, rocker = np.array([0.6, 0.8]), np.array([3.5, 0.0])
    half, apart = (crank + rocker) / 2, np.linalg.norm(rocker - crank)
    along = (rocker - crank) / apart
    x = (3.0**2 - 2.5**2) / (2 * apart)  # intersection of two circles
    knee = half + x * along + np.sqrt(3.0**2 - (x + apart / 2) ** 2) * np.array([-along[1], along[0]])
    pairs = planar([np.zeros(2), crank, knee, rocker], turned(5))
    run = mp.simulate(spatial_loop(pairs, rod, rates=[12.0]), t_end=5.0, rtol=rtol, method=method, output_step=0.02)
    assert run.status == "done"
    assert np.ptp(np.unwrap(run["j0.angle"])) > 20 * np.pi
    assert np.ptp(np.unwrap(run["j0.angle"] + run["j1.angle"] + run["j2.angle"])) < 2.0  # the rocker
    assert run.stats["energy_error"] < (100 if method == "explicit" else 1000) * rtol  # thousands of small steps


def three_cranks(seed, start):
    """Two parallelograms with one coupler, in a plane anywhere in space: the third crank is one too many."""
    R, end = turned(seed), np.array([np.cos(start), np.sin(start), 0.0])
    feet = {"one": np.zeros(3), "two": np.array([0.8, 0, 0]), "three": np.array([2.0, 0, 0])}
    bodies = {name: rod(np.zeros(3), R @ end) for name in feet}
    frames = {"root": np.zeros(3)} | {name: R @ foot for name, foot in feet.items()}
    bodies["coupler"] = mp.rigid_body(
        "coupler", mass=2.0, centre=R @ [0.9, 0.1, 0.0], inertia=np.eye(3), interfaces=frames
    )
    rate = {"axis": R[:, 2], "rate": 9.0}
    joints = [
        mp.Joint(name=name, type="revolute", parent="ground", child=name, position=R @ foot, **rate)
        for name, foot in feet.items()
    ]
    joints.append(mp.Joint(name="top", type="revolute", parent="one.tip", child="coupler", axis=R[:, 2], rate=-9.0))
    pins = tuple(
        mp.multibody.Closure(name=f"pin_{name}", type="revolute", a=f"{name}.tip", b=f"coupler.{name}", axis=R[:, 2])
        for name in ("two", "three")
    )
    return mp.System(bodies=bodies, joints=tuple(joints), closures=pins, gravity=np.array([0, 0, -9.81]))


@pytest.mark.parametrize("start", [0.7, 0.0])
@pytest.mark.parametrize(("method", "rtol"), [("explicit", 1e-4), ("explicit", 1e-7), ("rosenbrock", 1e-6)])
def test_three_cranks_on_one_coupler_turn(start, method, rtol):
    """Seven conditions of ten are redundant, and one more where all cranks are in line with the coupler."""
    for seed in range(3):
        run = mp.simulate(three_cranks(seed, start), t_end=5.0, rtol=rtol, method=method, output_step=0.02)
        assert run.status == "done"
        assert np.ptp(np.unwrap(run["one.angle"])) > 8 * np.pi
        assert run.stats["energy_error"] < 100 * rtol
        for name in ("two", "three"):
            assert_close(run[f"{name}.angle"], run["one.angle"], 1e-6, name=name)


@pytest.mark.parametrize("method", ["rosenbrock", "generalised_alpha"])
def test_implicit_steps_know_springs_beside_redundant_conditions(method):
    """A stiff spring across a parallelogram: as many steps as with a pin that leaves out the redundant conditions."""
    runs, free = [], np.hypot(2.0 + np.cos(0.7), np.sin(0.7))
    for kind in ("revolute", "point_on_line"):
        system = parallelogram("parallelogram", 0.7, 2, speed=0.0)
        brace = mp.multibody.AxialSpring(
            name="brace", between=("ground", "b2.tip"), stiffness=1e8, damping=1e5, free_length=free
        )
        pins = tuple(closure.with_(type=kind) for closure in system.closures)
        system = system.with_(loads=(brace,), closures=pins)
        runs.append(mp.simulate(system, t_end=0.05, rtol=1e-4, method=method, output_step=0.01))
    assert_close(runs[0]["j0.angle"], runs[1]["j0.angle"], 1e-9, scale=1.0)
    assert runs[0].stats["steps"] == pytest.approx(runs[1].stats["steps"], rel=0.05)  # round-off decides a step or two
