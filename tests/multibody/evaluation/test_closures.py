"""Closed loops: closed forms, published mechanisms, joints cut and closed again, redundancy, bad input."""

from pathlib import Path

import numpy as np
import pytest
from closures import closure_of
from multibody.mechanisms import link, slider_crank
from multibody.trees import axes_of, random_body
from scipy.integrate import solve_ivp
from systems.shipped import shipped

import modalprep as mp
from modalprep.errors import InputError, SimulationError
from modalprep.multibody.evaluation.loading import Loading
from modalprep.multibody.integration.run import Integration
from modalprep.multibody.model.constraints import Closure, Coupler
from modalprep.multibody.model.joint_element import HingeElement
from modalprep.multibody.packing.tree import pack
from modalprep.multibody.reference.constraints import reduced_accelerations
from modalprep.multibody.results.record import Recorder

GRAVITY = np.array([0, -9.81, 0])


def four_bar(a=1.0, b=1.0, c=1.0, d=1.0, *, angle=1.0, knee=-1.0, rocker=1.0, closure="revolute", more=None):
    """Crank a from the origin, coupler b, rocker c from (d, 0); uniform rods of 1 kg per bar."""
    bodies = {
        name: link(name, 1.0, (length / 2, 0), length**2 / 12, end=(length, 0))
        for name, length in (("crank", a), ("coupler", b), ("rocker", c))
    }
    joints = (
        mp.Joint(name="a", type="revolute", parent="ground", child="crank", angle=angle, keep_start=True),
        mp.Joint(name="b", type="revolute", parent="crank.end", child="coupler", angle=knee),
        mp.Joint(
            name="c", type="revolute", parent="ground", child="rocker", angle=rocker, position=np.array([d, 0, 0])
        ),
    )
    pin = Closure(name="pin", type=closure, a="rocker.end", b="coupler.end")
    closures = (pin, Closure(**more)) if more else (pin,)
    return mp.System(bodies=bodies, joints=joints, closures=closures, gravity=GRAVITY)


def assembled(system, t_end=1.0):
    """State after assembly, and the loops."""
    packed = pack(system)
    loading = Loading(system, packed, t_end)
    y = np.zeros(packed.nx + packed.nu)
    for joint in system.joints:
        row = packed.model.links[packed.links_of(joint.name)[0]]
        if joint.type in ("revolute", "prismatic"):
            y[row["x"]], y[packed.nx + row["u"]] = joint.angle + joint.displacement, joint.rate + joint.speed
    data = packed.data()
    return loading.loops.assemble(data, y, loading.prescribe(0.0, data)), loading.loops, packed


def test_parallelogram_swings_as_one_pendulum():
    """Two cranks of inertia m l^2 / 3 and a coupler that only translates: I rate^2 / 2 = 2 m g l (sin a - sin a0)."""
    run = mp.simulate(four_bar(angle=-0.6, knee=0.6, rocker=-0.6), t_end=0.6, output_step=0.05, rtol=1e-10)
    inertia, weight = 2 / 3 + 1.0, 2 * 9.81
    expected = 2 * weight * (np.sin(-0.6) - np.sin(run["a.angle"])) / inertia
    assert expected[-1] > 1.0
    np.testing.assert_allclose(run["a.rate"] ** 2, expected, atol=1e-7 * expected.max())
    assert run.stats["energy_error"] < 1e-8
    assert run["pin.violation"].max() < 1e-10
    assert "displacement of rocker.end to coupler.end along (0, 0, 1)" in run.message  # redundant, and said so


def test_assembly_of_a_four_bar_is_freudensteins_equation():
    a, b, c, d = 1.0, 3.0, 2.5, 3.5
    y, loops, packed = assembled(four_bar(a, b, c, d, angle=0.9, knee=-0.4, rocker=1.6))
    phi, psi = (y[packed.model.links[packed.links_of(name)[0]]["x"]] for name in ("a", "c"))
    K = d / a, d / c, (a * a - b * b + c * c + d * d) / (2 * a * c)
    assert abs(phi - 0.9) < 1e-7  # held
    assert K[0] * np.cos(psi) - K[1] * np.cos(phi) + K[2] == pytest.approx(np.cos(phi - psi), abs=1e-10)
    assert "closing the loops moved" in loops.notes[0]


def test_redundant_directions_of_a_planar_loop_are_named():
    """Gruebler in space counts 3 - 5 = -2 freedoms, there is one: three rows too many, all out of the plane."""
    _, loops, _ = assembled(four_bar(knee=-1.0))
    note = loops.notes[-1]
    assert loops.work.rank[0] == 2
    for direction in ("along (0, 0, 1)", "about (1, 0, 0)", "about (0, 1, 0)"):
        assert direction in note
    assert "along (1, 0, 0)" not in note


def test_same_pin_twice_is_redundant():
    system = four_bar(closure="point_on_line")
    again = system.closures[0].with_(name="again")
    _, loops, _ = assembled(system.with_(closures=(*system.closures, again)))
    assert loops.work.rank[0] == 2
    assert [note for note in loops.notes if "'again'" in note and "(1, 0, 0)" in note and "(0, 1, 0)" in note]


def test_a_loop_that_cannot_close_is_refused_with_its_gap():
    with pytest.raises(
        InputError, match=r"closure 'pin' cannot be closed at t = 0 s: displacement of .*gap of 0\.\d+ m"
    ):
        assembled(four_bar(1.0, 1.0, 1.0, 3.5, closure="spherical"))


def test_contradicting_speeds_are_refused():
    system = four_bar()
    drives = tuple(
        Coupler(name=name, factors={name: 1.0}, value=value) for name, value in (("a", "1+t"), ("c", "1+3*t"))
    )
    with pytest.raises(InputError, match=r"closure '\w+' cannot be kept at t = 0 s: .*contradict"):
        assembled(system.with_(closures=(*system.closures, *drives)))


def test_trajectory_in_independent_speeds_is_the_same():
    system = four_bar(1.0, 3.0, 2.5, 3.5, angle=0.9, knee=-0.4, rocker=1.6)
    run = mp.simulate(system, t_end=0.5, output_step=0.1, rtol=1e-11, atol=1e-12)
    y, loops, packed = assembled(system)

    def derivative(t, y):
        return np.concatenate([y[3:], reduced_accelerations(system, loops, y, np.zeros((3, 3)), t)])

    other = solve_ivp(derivative, (0, 0.5), y, method="DOP853", rtol=1e-10, atol=1e-12, t_eval=run.time)
    for name in ("a", "b", "c"):
        x = packed.model.links[packed.links_of(name)[0]]["x"]
        np.testing.assert_allclose(run[f"{name}.angle"], other.y[x], atol=1e-8)


SQUEEZED = {
    "beta": 15.81077119629904, "Theta": -15.75637105984298, "gamma": 0.04082224013073101,
    "Phi": -0.5347301163226948, "delta": 0.5244099658805304, "Omega": 0.5347301163226948,
    "epsilon": 1.048080741042263,
}  # fmt: skip


def squeezed(**options):
    """Angles at t = 0.03 s less those published: Test Set for IVP Solvers (2008), Andrews' squeezing mechanism."""
    system, _ = shipped("squeezer", Path())  # rigid bodies: no folder is used
    run = mp.simulate(system, t_end=0.03, output_step=0.03, **options)
    return np.array([run[f"{name}.angle"][-1] - value for name, value in SQUEEZED.items()]), run


@pytest.mark.parametrize(
    ("method", "rtol", "error"),
    [("explicit", 1e-11, 1e-8), ("rosenbrock", 1e-8, 2e-6), ("generalised_alpha", 1e-6, 2e-4)],
)
def test_andrews_squeezer(method, rtol, error):
    """The start is given to 15 digits, errors of a step grow by some hundred on the way."""
    errors, run = squeezed(method=method, rtol=rtol, atol=1e-12)
    np.testing.assert_allclose(errors, 0.0, atol=error)
    assert run.stats["energy_error"] < 10 * rtol + 1e-9


@pytest.mark.parametrize(
    ("method", "order", "steps", "error"), [("generalised_alpha", 2, 4000, 5e-6), ("rosenbrock", 3, 2000, 1e-6)]
)
def test_andrews_squeezer_by_fixed_steps(method, order, steps, error):
    """Order of convergence to the published digits, and what extrapolation from two steps leaves of them."""
    coarse, fine = (squeezed(method=method, step=0.03 / n, rtol=1e-10)[0] for n in (steps // 2, steps))
    observed = np.log2(np.abs(coarse).max() / np.abs(fine).max())
    assert order - 0.2 < observed < order + 0.2
    np.testing.assert_allclose(fine + (fine - coarse) / (2**order - 1), 0.0, atol=error)


CRANKED = np.array([
    -0.331173498825626, 0.169737332842786, 1.893192899613509e-4, 2.375751249879174e-5, -5.323896770569702e-6,
    -8.363313279112129e-6, -163.7920993367306, 62.32935833287916, -25.29857947066878,
])  # fmt: skip


def cranked(method, **options):
    """Angle, position, deflections and forces at t = 0.1 s relative to those published; the start has nine digits.

    Problem "crank" of the Test Set for IVP Solvers (2008); the solution as SciMLBenchmarks.jl prints it.
    """
    system, V = slider_crank()
    packed = pack(system)
    rows = {name: packed.model.links[packed.links_of(name)[0]] for name in ("crank", "knee", "slide")}
    nx, modes = packed.nx, rows["knee"]["xq"] + np.arange(4)
    rates = nx + rows["knee"]["uq"] + np.arange(4)
    y = np.zeros(nx + packed.nu + 1)
    y[rows["slide"]["x"]], y[nx + rows["slide"]["u"]] = 0.450016933, -0.268938672e-5
    y[nx + rows["crank"]["u"]], y[nx + rows["knee"]["u"]] = 150.0, -74.9957670 - 150.0
    y[modes] = np.linalg.solve(V, [0, 0, 0.103339863e-4, 0.169327969e-4])
    y[rates] = np.linalg.solve(V, [0.444896105, 0.463434311e-2, -0.178591076e-5, -0.268938672e-5])
    settings = dict(rtol=1e-10, atol=1e-14, step=None, rho=0.9) | options
    run = Integration(
        system, packed, Loading(system, packed, 0.1), y, np.array([0.0, 0.1]), np.zeros(nx), method=method, events=(),
        reference=None, **settings,
    )  # fmt: skip
    recorder = Recorder(run, 2)
    run.run(recorder.add, None)
    z, found = run.steps.y, recorder.result("", "", {})
    phi2 = np.angle(np.exp(1j * (z[rows["crank"]["x"]] + z[rows["knee"]["x"]])))
    values = [phi2, z[rows["slide"]["x"]], *(V @ z[modes]), *found["pin.force"][-1, :2], found["drive.multiplier"][-1]]
    return np.array(values) / CRANKED - 1


def test_elastic_slider_crank():
    """From the published start to 8 digits of the motion, 7 of deflections and forces."""
    errors = cranked("explicit", rtol=1e-12)
    np.testing.assert_allclose(errors[:2], 0.0, atol=1e-8)
    np.testing.assert_allclose(errors[2:], 0.0, atol=1e-7)


def test_elastic_slider_crank_by_rosenbrock():
    """Motion to 7 digits, deflections and forces, most of them vibrations, to 3."""
    errors = cranked("rosenbrock", rtol=1e-7)
    np.testing.assert_allclose(errors[:2], 0.0, atol=1e-7)
    np.testing.assert_allclose(errors[2:], 0.0, atol=2e-3)


def test_elastic_slider_crank_by_generalized_alpha():
    """Order 2 of motion, deflections and forces once the steps resolve the axial vibrations; then extrapolated."""
    coarse, fine = (cranked("generalised_alpha", step=0.1 / n, rtol=1e-6, atol=1e-11) for n in (10000, 20000))
    for part in (slice(0, 2), slice(2, 6), slice(6, 9)):
        assert 1.8 < np.log2(np.abs(coarse[part]).max() / np.abs(fine[part]).max()) < 2.2
    extrapolated = fine + (fine - coarse) / 3
    np.testing.assert_allclose(extrapolated[:2], 0.0, atol=5e-9)
    np.testing.assert_allclose(extrapolated[2:], 0.0, atol=2e-4)


def cut_joint(kind, *, closed):
    """Flexible arm on a ball joint that carries a body by a joint, in the tree or as a closure of a free body."""
    rng = np.random.default_rng(TYPES.index(kind))
    arm, tool = random_body(rng, 3), random_body(rng, 0)
    axis, second = rng.standard_normal((2, 3))
    first = mp.Joint(
        name="root", type="spherical", parent="ground", child="arm", angular_velocity=np.array([0.3, -0.2, 0.4])
    )
    place = arm.interface_position[1]
    joint = mp.Joint(name="cut", type=kind, parent="arm.a", child="tool", **axes_of(kind, axis, second))
    extra: tuple = ()
    if closed:
        joint = mp.Joint(name="cut", type="free", parent="ground", child="tool", position=place)
        extra = (closure_of(name="cut", type=kind, a="arm.a", b="tool.root", axis=axis, second_axis=second),)
        joint = joint.with_(velocity=np.cross(first.angular_velocity, place), angular_velocity=first.angular_velocity)
    return mp.System(
        bodies={"arm": arm, "tool": tool}, joints=(first, joint), gravity=np.array([1.0, -2.0, 3.0]), closures=extra
    )


TYPES = ("weld", "revolute", "prismatic", "cylindrical", "universal", "spherical", "planar")


@pytest.mark.parametrize("kind", TYPES)
def test_a_joint_cut_and_closed_again_moves_alike(kind):
    runs = [mp.simulate(cut_joint(kind, closed=c), t_end=0.5, output_step=0.1, rtol=1e-9) for c in (False, True)]
    for channel in ("tool.b.position", "arm.modal"):
        np.testing.assert_allclose(runs[1][channel], runs[0][channel], atol=1e-6)
    assert np.abs(runs[0]["tool.b.position"] - runs[0]["tool.b.position"][0]).max() > 0.1
    assert runs[1].stats["energy_error"] < 1e-8


def test_gears():
    """Inertia I1 + I2 (r1 / r2)^2 at the drive; the teeth push with I2 a2 / r2."""
    discs = {name: link(name, 1.0, (0, 0), inertia, end=(1, 0)) for name, inertia in (("one", 0.02), ("two", 0.5))}
    joints = tuple(
        mp.Joint(
            name=name, type="revolute", parent="ground", child=name, angle=0.3, elements=(HingeElement(drive=drive),)
        )
        for name, drive in (("one", 3.0), ("two", 0.0))
    )
    teeth = Coupler(name="teeth", factors={"one": 0.1, "two": 0.25})
    run = mp.simulate(mp.System(bodies=discs, joints=joints, closures=(teeth,)), t_end=1.0, output_step=0.5)
    a1 = 3.0 / (0.02 + 0.5 * (0.1 / 0.25) ** 2)
    assert run["one.angle"][-1] == pytest.approx(0.3 + a1 / 2, rel=1e-9)
    assert run["two.angle"][-1] == pytest.approx(0.3 - 0.4 * a1 / 2, rel=1e-9)
    assert run["teeth.multiplier"][-1] == pytest.approx(-0.5 * 0.4 * a1 / 0.25, rel=1e-9)


def test_a_pendulum_on_a_rod_of_changing_length():
    """x'' of a mass pulled in along a line: force m r'' of the rod; its work closes the energy balance."""
    mass = link("mass", 2.0, (0, 0), 0.1)
    joint = mp.Joint(name="free", type="free", parent="ground", child="mass", position=np.array([2.0, 0, 0]))
    rod = Closure(name="rod", type="distance", a="ground", b="mass.root", length="2 + t**2 / 4")
    system = mp.System(bodies={"mass": mass}, joints=(joint,), closures=(rod,))
    run = mp.simulate(system, t_end=1.0, output_step=0.25, rtol=1e-10)
    np.testing.assert_allclose(run["rod.force"], np.tile([1.0, 0, 0], (5, 1)), atol=1e-9)
    np.testing.assert_allclose(run["mass.root.position.x"], 2 + run.time**2 / 4, rtol=1e-10)
    swing = system.with_(gravity=GRAVITY, joints=(joint.with_(velocity=np.array([0, 0, 1.0])),))
    run = mp.simulate(swing, t_end=1.0, output_step=0.25, rtol=1e-10)
    assert np.abs(run["energy.work"]).max() > 0.1
    assert run.stats["energy_error"] < 1e-8


def test_joints_carry_what_multipliers_leave():
    """A uniform bar on two supports, the hinge one of them: each carries half of its weight."""
    bar = link("bar", 2.0, (0.5, 0), 0.2, end=(1, 0))
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="bar")
    support = Closure(name="support", type="point_on_plane", a="ground", b="bar.end", axis=np.array([0, 1.0, 0]))
    system = mp.System(bodies={"bar": bar}, joints=(hinge,), closures=(support,), gravity=GRAVITY)
    run = mp.simulate(system, t_end=0.01, output_step=0.01)
    for name in ("hinge", "support"):
        np.testing.assert_allclose(run[f"{name}.force"], [[0, 9.81, 0]] * 2, atol=1e-12)


def test_a_prescribed_position_leaves_free_components():
    mass = link("mass", 2.0, (0, 0), 0.1)
    joint = mp.Joint(name="free", type="free", parent="ground", child="mass")
    path = Closure(name="path", type="position", a="ground", b="mass.root", path=("sin(t)", None, 0))
    system = mp.System(bodies={"mass": mass}, joints=(joint,), closures=(path,), gravity=GRAVITY)
    run = mp.simulate(system, t_end=1.0, output_step=0.5, rtol=1e-10)
    np.testing.assert_allclose(run["mass.root.position"][-1], [np.sin(1), -9.81 / 2, 0], atol=1e-9)
    np.testing.assert_allclose(run["path.force"][-1], [-2 * np.sin(1), 0, 0], atol=1e-9)
    assert run.stats["energy_error"] < 1e-8  # the start asks for the speed that the path has


@pytest.mark.parametrize(("method", "rtol"), [("generalised_alpha", 1e-6), ("rosenbrock", 1e-7)])
def test_implicit_methods_keep_the_loops_closed(method, rtol):
    """Errors of the order of the tolerance: 0.7 of it measured."""
    system = four_bar(1.0, 3.0, 2.5, 3.5, angle=0.9, knee=-0.4, rocker=1.6)
    exact = mp.simulate(system, t_end=0.5, output_step=0.25, rtol=1e-10, method="explicit")
    run = mp.simulate(system, t_end=0.5, output_step=0.25, rtol=rtol, method=method)
    np.testing.assert_allclose(run["a.angle"], exact["a.angle"], atol=2 * rtol)
    assert run["pin.violation"][-1] < 1e-10
    dense = mp.simulate(system, t_end=0.5, output_step=0.25, rtol=1e-10, reference=True)
    np.testing.assert_allclose(dense["a.angle"], exact["a.angle"], atol=1e-8)


@pytest.mark.parametrize(("method", "order"), [("generalised_alpha", 2), ("rosenbrock", 3)])
def test_order_of_convergence_with_a_loop(method, order):
    """Angle, rate and the forces in the closure."""
    system = four_bar(1.0, 3.0, 2.5, 3.5, angle=0.9, knee=-0.4, rocker=1.6)
    exact = mp.simulate(system, t_end=0.5, output_step=0.5, rtol=1e-11, atol=1e-13, method="explicit")
    runs = [
        mp.simulate(system, t_end=0.5, output_step=0.5, method=method, step=0.5 / n, rtol=1e-10) for n in (100, 200)
    ]
    for channel in ("a.angle", "a.rate", "pin.force"):
        errors = [np.abs(run[channel][-1] - exact[channel][-1]).max() for run in runs]
        assert order - 0.2 < np.log2(errors[0] / errors[1]) < order + 0.2, channel


@pytest.mark.parametrize("options", [{"step": 5e-3}, {"rtol": 1e-5}])
@pytest.mark.parametrize("method", ["explicit", "generalised_alpha", "rosenbrock"])
def test_a_mechanism_that_locks_names_time_and_loop(method, options):
    """Crank 2 driven to where coupler and rocker are in line: 2.2^2 = 2^2 + 2.5^2 - 10 cos(angle)."""
    system = four_bar(2.0, 1.0, 1.2, 2.5, angle=0.5, knee=1.0, rocker=2.0)
    drive = Coupler(name="drive", factors={"a": 1.0}, value="0.5 + t")
    stop = np.arccos((2.0**2 + 2.5**2 - 2.2**2) / 10) - 0.5
    with pytest.raises(SimulationError, match=r"closure '(pin|drive)' cannot be kept closed: .*gap") as refused:
        mp.simulate(system.with_(closures=(*system.closures, drive)), t_end=1.0, method=method, **options)
    found = float(str(refused.value).split("t = ")[1].split(" s")[0])
    assert found == pytest.approx(stop, abs=1e-6)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"type": "hinge"}, "type 'hinge' does not exist"),
        ({"b": "crank.end"}, "two different ends"),
        ({"a": "crank.hand"}, "names no interface"),
        ({"type": "planar", "axis": np.zeros(3)}, "has no direction"),
        ({"type": "universal"}, "needs a second_axis"),
        ({"length": 1.0}, "'length' has no effect"),
        ({"type": "distance", "length": -1.0}, "must be positive"),
        ({"type": "position"}, "needs a path"),
        ({"type": "distance", "length": [(0.5, 1.0), (float("inf"), 2.0)]}, "jumps"),
    ],
)
def test_closures_that_make_no_sense(values, message):
    given = {"name": "x", "type": "spherical", "a": "crank.end", "b": "ground"} | values
    with pytest.raises(InputError, match=message):
        four_bar(more=given)


@pytest.mark.parametrize(
    ("factors", "message"),
    [
        ({}, "no factors"),
        ({"z": 1.0}, "joint 'z' does not exist"),
        ({"a": 0.0}, "other than 0"),
        ({"a.2": 1.0}, "is not a coordinate"),
    ],
)
def test_couplers_that_make_no_sense(factors, message):
    with pytest.raises(InputError, match=message):
        four_bar().with_(closures=(Coupler(name="x", factors=factors),))


def test_pipeline_tables_become_closures(tmp_path):
    from modalprep.pipeline.schema.pipeline import Pipeline
    from modalprep.pipeline.systems.constraints import read_closures

    pin = {"type": "position", "a": "ground", "b": "arm.tip", "path": ["sin(t)", "free", 0.5]}
    tables = {
        "simulation": {"t_end": 1.0},
        "closures": {"pin": pin, "rod": {"type": "distance", "a": "arm.tip", "position": [1, 0, 0], "length": 2}},
        "couplers": {"gear": {"factors": {"pinion": 3.0, "wheel": 1.0}}},
    }
    pipeline = Pipeline.model_validate(tables)
    one, rod, gear = read_closures(pipeline.closures, pipeline.couplers, tmp_path)
    assert (one.path[0](0.0)[1], one.path[1], one.path[2](0.0)[0]) == (1.0, None, 0.5)
    assert (rod.b, rod.length(0.0)[0], gear.value, gear.factors["pinion"]) == ("ground", 2.0, None, 3.0)
