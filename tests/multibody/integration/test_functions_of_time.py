"""Forces in time are not stepped over: pulses, steps and ramps of every kind of function against quadrature."""

from itertools import pairwise

import numpy as np
import pytest
from size import FULL

import modalprep as mp
from modalprep.multibody.evaluation.loading import Loading
from modalprep.multibody.packing.tree import pack

T_END = 10.0
METHODS = ("explicit", "rosenbrock", "generalised_alpha", "auto")
HUB = mp.rigid_body("hub", mass=1.0, centre=np.zeros(3), inertia=np.eye(3), interfaces={"root": np.zeros(3)})
SHORT = "1000*exp(-((t - 5.0037)/0.01)**2)"  # N m; its integral is 1000 sqrt(pi) 0.01 N m s
GAINED = 10 * np.pi**0.5
x16, w16 = np.polynomial.legendre.leggauss(16)


def turning(*drives, loads=(), stiffness=0.0):
    """Hubs of 1 kg m2 that turn at 1 rad/s, each with a torque that is a function of time."""
    names = [f"hub{k}" for k in range(max(1, len(drives)))]
    drives = drives or (None,)
    joints = tuple(
        mp.Joint(name=f"j{k}", type="revolute", parent="ground", child=name, rate=1.0,
                 elements=mp.multibody.HingeElement(drive=drive, stiffness=stiffness))
        for k, (name, drive) in enumerate(zip(names, drives, strict=True))
    )  # fmt: skip
    return mp.System(bodies=dict.fromkeys(names, HUB), joints=joints, loads=loads)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("width", [1e-3, 1e-2, 1e-1])
def test_a_pulse_is_not_stepped_over(width, method):
    """The integral of a Gauss pulse, 1000 sqrt(pi) width, becomes the rate."""
    system = turning(f"1000*exp(-((t-5.0037)/{width})**2)")
    run = mp.simulate(system, t_end=T_END, method=method)
    assert run["j0.rate"][-1] - 1 == pytest.approx(1000 * np.pi**0.5 * width, rel=2e-4)  # 20 times rtol


@pytest.mark.parametrize("method", METHODS)
def test_a_trapezoid_is_integrated_exactly(method):
    """Area 10 N m s; Runge-Kutta methods integrate straight lines without error where they step from kink to kink."""
    table = mp.multibody.TimeFunction.table([0, 1, 1.01, 2, 2.01, 10], [0, 0, 10, 10, 0, 0])
    run = mp.simulate(turning(table), t_end=T_END, output_step=0.5, method=method)
    # round-off; generalised-alpha takes the torque at a shifted time, of order 2
    assert run["j0.rate"][-1] == pytest.approx(11.0, rel=1e-6 if method == "generalised_alpha" else 1e-12)
    assert run.stats["energy_error"] < 1e-5  # rtol: the work has the kinks too
    assert not run.notes


def test_pieces_tables_and_callables_are_found_alike():
    """Rectangular and Gauss pulses of 1 ms, given in every way; closed forms of their integrals."""
    width, at = 1e-3, 5.0037
    rectangle = [(at, "0"), (at + width, "1000"), (float("inf"), "0")]
    table = mp.multibody.TimeFunction.table([0, at, at, at + width, at + width, 10], [0, 0, 1e3, 1e3, 0, 0])
    gauss = mp.multibody.TimeFunction.sampled(lambda t: 1e3 * np.exp(-(((t - at) / width) ** 2)), until=T_END)
    run = mp.simulate(turning(rectangle, table, gauss), t_end=T_END)
    found = [run[f"j{k}.rate"][-1] - 1 for k in range(3)]
    np.testing.assert_allclose(found, [1.0, 1.0, np.pi**0.5], rtol=1e-4)  # 10 times rtol


def test_control_laws_that_depend_on_time_are_looked_through():
    law = mp.multibody.feedback("law", "j0", [f"0*j0.angle + {SHORT}"])
    run = mp.simulate(turning(loads=(law,)), t_end=T_END)
    assert run["j0.rate"][-1] - 1 == pytest.approx(GAINED, rel=1e-4)  # 10 times rtol
    assert "shorter than 0.001 s may be missed in 'law'" in run.notes[0]


def test_a_callback_is_found_with_max_step():
    """The step control knows nothing of Python: a pulse is missed, but not by steps of twice its width."""
    pulse = mp.multibody.Callback(
        name="pulse", function=lambda t, state: {"j0": [1000 * np.exp(-(((t - 5.0037) / 0.01) ** 2))]}
    )
    run = mp.simulate(turning(loads=(pulse,)), t_end=T_END, max_step=0.02)
    assert run["j0.rate"][-1] - 1 == pytest.approx(GAINED, rel=1e-4)
    assert run.stats["steps"] >= T_END / 0.02


def test_prescribed_motions_and_rods_are_followed():
    """A hub that is thrown by a short prescribed turn of its neighbour, through a spring: by impulse k int angle dt."""
    turn = "0.1*exp(-((t - 5.0037)/0.01)**2)"
    joints = (
        mp.Joint(name="a", type="revolute", parent="ground", child="hub0", motion=turn),
        mp.Joint(name="b", type="revolute", parent="hub0.root", child="hub1", rate=0.3),
    )
    spring = mp.multibody.RotationalSpring(name="s", between=("hub0.root", "hub1.root"), stiffness=1e-9)
    system = mp.System(bodies={"hub0": HUB, "hub1": HUB}, joints=joints, loads=(spring,))
    run = mp.simulate(system, t_end=T_END)
    # the hub keeps its speed in space; relative to the one that turns and returns it is where it would have been
    assert run["b.angle"][-1] == pytest.approx(0.3 * T_END, rel=1e-5)  # within the half turn that springs follow
    assert run.stats["steps"] > 20  # and the pulse has been seen


def test_ensembles_find_pulses_and_tell_what_they_may_miss():
    found = mp.simulate_many(turning(SHORT), {"j0.rate": [1.0, 2.0]}, t_end=T_END, channels=["j0.rate"])
    np.testing.assert_allclose(found["j0.rate"][:, -1], np.array([1.0, 2.0]) + GAINED, rtol=1e-4)  # 10 times rtol
    assert all("shorter than 0.001 s may be missed in 'j0'" in message for message in found.message)


def test_deployments_find_pulses():
    """A reel that brakes a boom for some milliseconds, against steps of a millisecond."""
    boom = mp.multibody.Deployment(
        name="boom", parent="ground", length=2.0, segments=4, mass_per_length=1.0, EI=100.0, initial_length=0.6,
        tension="0.1 - 50*exp(-((t - 1.0037)/0.003)**2)",
    )  # fmt: skip
    system = mp.multibody.DeployingSystem(bodies={}, joints=(), deployments=(boom,))
    found, fine = (
        mp.multibody.simulate_deployment(system, t_end=1.5, method="explicit", **options)
        for options in ({}, {"max_step": 1e-3})
    )
    assert found["boom.speed"][-1] == pytest.approx(fine["boom.speed"][-1], rel=1e-6)  # 10 times rtol
    assert fine["boom.speed"][-1] > 0.1  # it has been pushed out
    assert "may be missed in 'boom'" in found.notes[0]


def test_smooth_functions_cost_nothing_and_are_not_told():
    """Constants, lines and products of slow sines ask for no step of their own, or less than accuracy does."""
    for drive in (0.0, 3.0, "2 + 3*t"):
        assert len(bounds_of(turning(drive)).cells) == 0
    run = mp.simulate(turning("3*sin(5*t)*exp(-t) + t**2"), t_end=T_END)
    assert not run.notes
    assert run.stats["steps"] < 60


def test_the_width_is_told_and_can_be_stated():
    hidden = "1000*exp(-((t-5.00376)/6e-6)**2)"
    run = mp.simulate(turning(hidden, "tanh(t - 5)"), t_end=T_END)
    assert run["j0.rate"][-1] == pytest.approx(1.0, abs=1e-12)  # missed: shorter than what is told
    assert run.notes[0].startswith("features of t shorter than 0.001 s may be missed in 'j0', 'j1'")
    run = mp.simulate(turning(hidden), t_end=T_END, shortest_event=1e-5)
    assert run["j0.rate"][-1] - 1 == pytest.approx(0.006 * np.pi**0.5, rel=1e-3)
    assert not run.notes


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"max_step": 0.0}, "max_step = 0.0 must be a positive number"),
        ({"max_step": "1"}, "max_step = 1 must be a positive number"),
        ({"shortest_event": -1.0}, "shortest_event = -1.0 must be a positive number"),
        ({"shortest_event": 1e-9}, "shortest_event = 1e-09 s is less than 5e-07 of 10 s"),
    ],
)
def test_impossible_steps_are_refused(options, words):
    with pytest.raises(mp.InputError, match=words):
        mp.simulate(turning(), t_end=T_END, **options)
    with pytest.raises(mp.InputError, match=words):
        mp.simulate_many(turning(), {"j0.rate": [1.0]}, t_end=T_END, **options)


def test_dense_tables_are_followed_by_long_steps():
    """A sine through 10 000 points is smooth for the steps; of noise every point is one."""
    t = np.linspace(0, T_END, 10001)
    sine = mp.multibody.TimeFunction.table(t, np.sin(t))
    assert mp.simulate(turning(sine), t_end=T_END).stats["steps"] < 60
    noise = mp.multibody.TimeFunction.table(t[::10], np.random.default_rng(0).standard_normal(1001))
    run = mp.simulate(turning(noise), t_end=T_END, output_step=1.0)
    assert run.stats["steps"] < 1010
    area = np.trapezoid(noise.pieces[0].evaluate(t[::10])[0], t[::10])
    assert run["j0.rate"][-1] == pytest.approx(1 + area, rel=1e-12)


@pytest.mark.parametrize("rtol", [1e-6, 1e-10])
@pytest.mark.parametrize(("points", "curve"), [(201, np.sin), (1001, lambda t: np.exp(-(((t - 5) / 0.6) ** 2)))])
def test_dense_tables_are_followed_to_the_tolerance(points, curve, rtol):
    """Straight lines have the area of trapezia, which is that of the curve itself to 1e-4 or 1e-6 only."""
    t = np.linspace(0, T_END, points)
    run = mp.simulate(turning(mp.multibody.TimeFunction.table(t, curve(t))), t_end=T_END, output_step=T_END, rtol=rtol)
    largest = np.abs(run["j0.rate"]).max()
    assert run["j0.rate"][-1] == pytest.approx(1 + np.trapezoid(curve(t), t), abs=rtol * largest)


def bounds_of(system):
    return Loading(system, pack(system), T_END).step_bounds()


# --- the hunt


def random_function(rng):
    """A function of time with pulses, steps and ramps, the same in Python, and the times that a quadrature needs."""
    kind = rng.choice(["expression", "pieces", "lines", "monotone", "callable", "law"])
    if kind in ("lines", "monotone"):
        return random_table(rng, kind == "monotone")
    if kind == "pieces":
        cuts = np.sort(rng.uniform(0, T_END, rng.integers(1, 6)))
        parts = [random_sum(rng) for _ in range(len(cuts) + 1)]
        ends = [*cuts.tolist(), float("inf")]
        numbers = lambda t: np.searchsorted(cuts, t, side="right")  # noqa: E731
        return (
            mp.multibody.TimeFunction([(end, text) for end, (text, _, _) in zip(ends, parts, strict=True)]),
            lambda t: np.choose(numbers(t), [f(t) for _, f, _ in parts]),
            np.concatenate([cuts, *(nodes for _, _, nodes in parts)]),
        )
    text, function, nodes = random_sum(rng)
    if kind == "callable":
        return mp.multibody.TimeFunction.sampled(function, until=T_END), function, nodes
    return (text if kind == "law" else mp.multibody.TimeFunction(text)), function, nodes


def random_sum(rng):
    """A sum of a slow sine and one to three Gauss pulses and steps, 1 ms to 1 s wide."""
    a, w = rng.uniform(-3, 3, 2).tolist()
    texts, parts, nodes = [f"{a!r}*sin({w!r}*t)"], [lambda t: a * np.sin(w * t)], [np.zeros(0)]
    for _ in range(rng.integers(1, 4)):
        size, at, width = (
            rng.choice([-1, 1]) * 10 ** rng.uniform(-1, 3),
            rng.uniform(0, T_END),
            10 ** rng.uniform(-3, 0),
        )
        shape, text = (gauss, "exp(-({})**2)") if rng.random() < 0.6 else (np.tanh, "tanh({})")
        texts.append(f"{size:.17g}*" + text.format(f"(t - {at!r})/{width!r}"))
        parts.append(lambda t, s=size, a=at, w=width, shape=shape: s * shape((t - a) / w))
        nodes.append(at + width * np.linspace(-20, 20, 81))
    return " + ".join(texts), lambda t: sum(part(t) for part in parts), np.concatenate(nodes)


def gauss(x):
    return np.exp(-(x**2))


def random_table(rng, monotone):
    """Rests, ramps from 1 ms on, and jumps."""
    t, v = [0.0], [0.0]
    while t[-1] < T_END:
        rest, ramp = rng.exponential(1.0), 10 ** rng.uniform(-3, 0)
        level = rng.uniform(-1, 1) * 10 ** rng.uniform(-1, 3)
        t, v = [*t, t[-1] + rest, t[-1] + rest + ramp], [*v, v[-1], level]
        if rng.random() < 0.2:
            t, v = [*t, t[-1], t[-1] + ramp], [*v, -level, level]
    function = mp.multibody.TimeFunction.table(t, v, smooth=monotone)
    pieces = function.pieces
    ends = np.array([piece.until for piece in pieces])
    return function, lambda x: pieces[int(np.searchsorted(ends, x[0], side="right"))].evaluate(x)[0], np.array(t)


def integrals(function, nodes):
    """The integrals of f and of (T - t) f over the run, by Gauss' formula of 16 points between all nodes."""
    edges = np.unique(np.clip([*nodes, *np.linspace(0, T_END, 101)], 0, T_END))
    total = np.zeros(2)
    for a, b in pairwise(edges):
        t = (a + b) / 2 + (b - a) / 2 * x16
        f = (b - a) / 2 * w16 * function(t)
        total += f.sum(), (f * (T_END - t)).sum()
    return total


def largest(channel, run):
    return max(np.abs(run[f"j{k}.{channel}"]).max() for k in range(2))


def test_random_functions_of_time_against_quadrature():
    """500 at the full size: rate and angle at the end to twenty times the tolerance, of the largest."""
    wrong, count = [], round(500 * FULL) or 20
    for seed in range(count):
        rng = np.random.default_rng(seed)
        given, functions, nodes = zip(*(random_function(rng) for _ in range(2)), strict=True)
        drives = [None if isinstance(each, str) else each for each in given]
        laws = [mp.multibody.feedback(f"law{k}", f"j{k}", [law]) for k, law in enumerate(given) if isinstance(law, str)]
        method = METHODS[seed % len(METHODS)]
        run = mp.simulate(turning(*drives, loads=tuple(laws)), t_end=T_END, output_step=0.1, rtol=1e-5, method=method)
        for k in range(2):
            gained, moved = integrals(functions[k], nodes[k])
            rate, angle = run[f"j{k}.rate"], run[f"j{k}.angle"]
            errors = (rate[-1] - 1 - gained) / largest("rate", run), (angle[-1] - T_END - moved) / largest("angle", run)
            if max(map(abs, errors)) > 2e-4:
                wrong.append((seed, k, method, given[k], *errors))
    assert not wrong, f"{len(wrong)} of {2 * count}: {wrong[:3]}"


def test_inverse_dynamics_does_not_step_over_a_step():
    """A free hub on one that turns by 0.2 rad within some milliseconds keeps its speed in space."""
    joints = (
        mp.Joint(name="a", type="revolute", parent="ground", child="hub0"),
        mp.Joint(name="b", type="revolute", parent="hub0.root", child="hub1", rate=1.0),
    )
    system = mp.System(bodies={"hub0": HUB, "hub1": HUB}, joints=joints)
    found = mp.multibody.inverse_dynamics(system, {"a": "0.1*tanh((t - 5.0037)/0.001)"}, np.linspace(0, T_END, 11))
    assert found.y[-1, 1] == pytest.approx(T_END - 0.2, rel=1e-7)  # 100 times rtol
