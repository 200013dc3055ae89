"""Zero crossings of event functions: none is missed, none is invented."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import modalprep as mp
from modalprep.examples import uniform_beam
from modalprep.multibody.integration.events import search
from modalprep.multibody.integration.events.crossings import crossings, dip, node_times, root
from modalprep.multibody.model.constraints import Closure
from tests.size import FULL, cases

GRAVITY = np.array([0, -9.81, 0])


def hub(**options):
    arms = {"c": np.zeros(3), "e": np.array([1.0, 0, 0])}
    return mp.rigid_body(options.pop("name", "h"), mass=1.0, centre=np.zeros(3), inertia=np.eye(3), interfaces=arms)


def spinning(rate):
    joint = mp.Joint(name="j", type="revolute", parent="ground", child="h", rate=rate)
    return mp.System(bodies={"h": hub()}, joints=(joint,))


def found(when, rate=1.0, t_end=10.0, **options):
    """Return the times of an event of a body that turns freely."""
    event = mp.Event(name="e", when=when, **options)
    return mp.simulate(spinning(rate), t_end=t_end, output_step=t_end, events=(event,)).events["e"]


@pytest.mark.parametrize("rate", [1.0, 10.0, 2 * np.pi * 50])
def test_a_tip_crosses_a_plane_at_every_half_turn(rate):
    """At multiples of pi of the angle: a step of free motion covers a hundred of turns."""
    right = np.pi / rate * np.arange(1, int(9.995 * rate / np.pi) + 1)
    np.testing.assert_allclose(found("h.e.position.y", rate, 9.995), right, rtol=1e-9)
    np.testing.assert_allclose(found(lambda t, state: state["h.e"].position[1], rate, 9.995), right, rtol=1e-9)


def test_an_expression_of_time_crosses_where_it_does():
    """``sin(20 t) = .999`` at ``(asin(.999) + 2 pi k) / 20`` and at the mirror images."""
    up = (np.arcsin(0.999) + 2 * np.pi * np.arange(40)) / 20
    down = (np.pi - np.arcsin(0.999) + 2 * np.pi * np.arange(40)) / 20
    np.testing.assert_allclose(found("sin(20*t) - 0.999", direction=1), up[up < 10], rtol=1e-12)
    np.testing.assert_allclose(found("sin(20*t) - 0.999", direction=-1), down[down < 10], rtol=1e-12)
    rises = (2 * np.pi * np.arange(1, 40) - np.pi / 2) / 20
    np.testing.assert_allclose(found("cos(20*j.angle)", direction=1), rises[rises < 10], rtol=1e-9)
    assert len(found("sin(20*t) - 1.000001")) == 0
    assert len(found("sin(3e4*t)", t_end=0.1)) == int(3e3 / np.pi)


@pytest.mark.parametrize("over", [1e-2, 1e-6, 1e-10])
def test_a_grazed_ceiling_is_hit(over):
    """A ball thrown up with ``sqrt(2 g (h + over))`` meets the height h going up, and would soon come back."""
    throw = np.sqrt(2 * 9.81 * (1 + over))
    slide = mp.Joint(name="up", type="prismatic", parent="ground", child="h", axis=np.array([0, 1.0, 0]), speed=throw)
    ceiling = Closure(name="top", type="point_on_plane", a="ground", b="h.c", axis=np.array([0, 1.0, 0]),
                      position=np.array([0, 1.0, 0]), active=False)  # fmt: skip
    system = mp.System(bodies={"h": hub()}, joints=(slide,), closures=(ceiling,), gravity=GRAVITY)
    hit = mp.Event(name="hit", when="top.gap", impacts=("top",), direction=1, restitution=1.0)
    run = mp.simulate(system, t_end=0.8, events=(hit,))
    right = throw / 9.81 - np.sqrt(2 * over / 9.81)
    assert run.events["hit"] == pytest.approx([right], rel=1e-7)
    assert run["h.c.position.y"].max() <= 1 + 1e-12


@pytest.mark.parametrize("when", ["t - 0.5", lambda t, state: t - 0.5, lambda t, state: t >= 0.5])
def test_an_impact_at_a_time_happens_once(when):
    """Time goes on after the impact: the function does not return to the side it came from, as a gap does."""
    floor = Closure(name="stop", type="point_on_plane", a="ground", b="h.e", axis=[0, 1.0, 0], active=False)
    hit = mp.Event(name="hit", when=when, impacts=("stop",), restitution=1.0)
    run = mp.simulate(spinning(1.0).with_(closures=(floor,)), t_end=1.0, events=(hit,))
    assert run.events["hit"] == pytest.approx([0.5], rel=1e-12)
    assert run["j.rate"][-1] == pytest.approx(-1.0, rel=1e-12)


class TestFunctions:
    """What Python functions may return."""

    def test_a_condition_is_an_event_where_it_becomes_true(self):
        assert found(lambda t, state: 2 < t < 3) == pytest.approx([2.0], rel=1e-12)
        assert found(lambda t, state: np.cos(t) < 0, t_end=9.0) == pytest.approx([np.pi / 2, np.pi * 5 / 2], rel=1e-12)
        assert found(lambda t, state: 2 < t < 3, direction=-1) == pytest.approx([3.0], rel=1e-12)

    def test_a_step_is_a_crossing(self):
        assert found(lambda t, state: int(t > 2) * 2 - 1) == pytest.approx([2.0], rel=1e-12)

    @pytest.mark.parametrize("place", [5.0, 2.3, 7.5])
    def test_a_pole_is_none(self, place):
        """Also where a step ends in it, and Python divides by zero."""
        assert len(found(lambda t, state: 1 / (t - place))) == 0
        assert len(found(f"1/(t - {place})")) == 0
        assert found(f"(t - 4)/(t - {place})") == pytest.approx([4.0], rel=1e-12)
        assert len(found("tan(t)")) == 3  # zeros at pi, 2 pi, 3 pi

    def test_a_rotation_vector_that_turns_over_crosses_nothing(self):
        """It is pi - 1 and then -pi - 1 at half a turn."""
        assert found("h.c.rotation.z - 1", t_end=6.0) == pytest.approx([1.0], rel=1e-9)

    def test_infinity_is_refused(self):
        with pytest.raises(mp.InputError, match="event 'e': its function is infinite at t = 0 s"):
            found(lambda t, state: np.inf)
        with pytest.raises(mp.InputError, match="event 'e': its function is infinite at t = "):
            found(lambda t, state: 1.0 if t < 5 else -np.inf)

    def test_noise_is_refused(self):
        rng = np.random.default_rng(0)
        with pytest.raises(mp.InputError, match="event 'e': its function returned .* and then .* at the same time"):
            found(lambda t, state: rng.normal())

    def test_an_event_that_touches_at_the_start_is_none(self):
        """The angle is zero at the start and at no later time."""
        assert len(found("j.angle")) == 0


def test_what_may_be_missed_is_said(monkeypatch):
    """A function of Python is looked at a thousand times in a run at least."""
    events = (
        mp.Event(name="own", when=lambda t, state: t - 1),
        mp.Event(name="pulse", when="exp(-t) - 0.5"),
        mp.Event(name="plain", when="h.e.position.y + sin(t)*j.angle"),
        mp.Event(name="quick", when="sin(1e8*t)"),
    )
    notes = mp.simulate(spinning(1.0), t_end=10.0, events=events[:3]).notes
    assert "events 'own', 'pulse': crossings that come back within 0.01 s may be missed" in notes
    assert not any("plain" in note for note in notes)
    monkeypatch.setattr(search, "SHORTEST", 0.01)
    notes = mp.simulate(spinning(1.0), t_end=10.0, events=events[2:]).notes
    assert notes == ("events change very quickly: crossings that come back within 0.1 s may be missed",)


def test_a_stated_width_is_looked_through():
    """A function of Python is positive for 2 ms of 10 s, which a thousand looks may step over."""
    event = mp.Event(name="blink", when=lambda t, state: 1e-3 - abs(t - 3.3337), direction=1)
    run = mp.simulate(spinning(1.0), t_end=10.0, events=[event], shortest_event=1e-3)
    assert run.events["blink"] == pytest.approx([3.3327], rel=1e-9)
    assert not any("may be missed" in note for note in run.notes)


class TestContradictions:
    """Events that activate and deactivate one closure at one time."""

    def system(self):
        return spinning(1.0).with_(
            closures=(Closure(name="c", type="point_on_plane", a="ground", b="h.c", active=False),)
        )

    def test_of_one_event(self):
        with pytest.raises(mp.InputError, match="event 'e' activates and deactivates closure 'c'"):
            mp.Event(name="e", when="t - 1", activates=("c",), deactivates=("c",))

    def test_of_two_events(self):
        events = [mp.Event(name=kind, when="2*t - 1", **{kind: ("c",)}) for kind in ("activates", "deactivates")]
        with pytest.raises(mp.SimulationError, match=r"'activates' and 'deactivates' .* same time, t = 0.5 s"):
            mp.simulate(self.system(), t_end=1.0, events=events)


class TestSearch:
    """The search within a panel, and roots."""

    def test_extrema_and_roots_to_round_off(self):
        assert root(lambda x: x**3 - 2, 1.0, 2.0, -1.0, 6.0) == pytest.approx(2 ** (1 / 3), rel=1e-15)
        assert root(lambda x: 1 / x, -1.0, 2.0, -1.0, 0.5) is None
        x, value = dip(lambda x: (x - 0.3) ** 2 - 1e-14, 1.0, 0.0, 1.0)
        assert (x, value) == (pytest.approx(0.3, abs=1e-7), pytest.approx(0, abs=1e-14))
        assert dip(lambda x: (x - 0.3) ** 2 + 1e-14, 1.0, 0.0, 1.0) is None

    @pytest.mark.parametrize("depth", 10.0 ** -np.arange(1, 13))
    def test_two_crossings_between_nodes(self, depth):
        times = node_times(0.0, 1.0)
        for sign in (1.0, -1.0):

            def function(t, sign=sign):
                return sign * ((t - 0.6) ** 2 - depth**2)

            got = [c.t for c in crossings(function, times, [function(t) for t in times], left=False)]
            np.testing.assert_allclose(got, [0.6 - depth, 0.6 + depth], rtol=1e-9)


SYSTEMS = {
    "rotor": ("j.angle", "h.e.position.x", "h.e.position.y", "h.e.velocity.y"),
    "pendulum": ("j.angle", "j.rate", "h.e.position.y", "h.e.velocity.x"),
    "two": ("j.angle", "k.rate", "i.e.position.x", "i.e.position.y", "i.e.velocity.y"),
    "tumbling": ("h.e.position.x", "h.e.position.z", "h.e.velocity.y", "h.c.position.y"),
    "beam": ("arm.tip.position.y", "arm.modal.1", "j.rate", "arm.tip.velocity.y"),
}


def random_system(kind, rng):
    if kind == "rotor":
        return spinning(10 ** rng.uniform(0, 2))
    if kind == "beam":
        joint = mp.Joint(name="j", type="revolute", parent="ground", child="arm", rate=rng.normal())
        return mp.System(bodies={"arm": uniform_beam(modes=1)}, joints=(joint,), gravity=GRAVITY)
    arm = mp.rigid_body("h", mass=1.0, centre=np.array([0.6, 0.05, 0]), inertia=np.diag([0.2, 0.3, 0.4]),
                        interfaces={"c": np.zeros(3), "e": np.array([1.0, 0.1, 0.2])})  # fmt: skip
    if kind == "tumbling":
        spin = {"velocity": rng.normal(size=3), "angular_velocity": 5 * rng.normal(size=3)}
        free = mp.Joint(name="j", type="free", parent="ground", child="h", **spin)
        return mp.System(bodies={"h": arm}, joints=(free,), gravity=GRAVITY)
    hinges = [mp.Joint(name="j", type="revolute", parent="ground", child="h", rate=8 * rng.normal())]
    bodies = {"h": arm}
    if kind == "two":
        bodies["i"] = arm.with_(name="i")
        hinges.append(mp.Joint(name="k", type="revolute", parent="h.e", child="i", rate=3 * rng.normal()))
    return mp.System(bodies=bodies, joints=tuple(hinges), gravity=GRAVITY)


def random_text(names, rng):
    a, b = rng.choice(names, 2)
    p, q, w = rng.uniform(0.3, 2), rng.normal(), 10 ** rng.uniform(0, 1.7)
    forms = (
        a,
        f"{p}*{a} + {q}*{b}",
        f"sin({w / 10}*{a} + {q})",
        f"{a}*{b}",
        f"{a} + {q}*sin({w}*t)",
        f"{a}**2 + {q}*{b}",
    )
    return str(rng.choice(forms))


def values(text, run, names):
    known = {"t": run.time, "sin": np.sin}
    for k, name in enumerate(names):
        text, known[f"c{k}"] = text.replace(name, f"c{k}"), channel(run, name)
    return eval(text, known) + 0 * run.time


def channel(run, name):
    owner, _, rest = name.partition(".")
    words = rest.split(".")
    if words[0] == "modal":
        return run[f"{owner}.modal"][:, int(words[1]) - 1]
    found = run[".".join([owner, *words[:-1]])] if words[-1] in "xyz" and name not in run.channels else run[name]
    return found[:, "xyz".index(words[-1])] if found.ndim == 2 else found


def near_extremum(g, rng):
    """Return a level that some extremum of the samples passes by a little, or that all cross."""
    turns = np.flatnonzero((g[1:-1] - g[:-2]) * (g[2:] - g[1:-1]) < 0) + 1
    if len(turns) == 0 or rng.random() < 0.3:
        return rng.uniform(g.min(), g.max())
    return g[rng.choice(turns)] + rng.choice([-1, 1]) * 10 ** rng.uniform(-5, -1) * np.ptp(g)


@pytest.mark.parametrize("k", range(cases(100) if FULL else 8))
def test_random_events_against_dense_sampling(k):
    """Five events of a random motion: those of the roots of a spline through 20,001 samples, no more and no fewer."""
    rng = np.random.default_rng(k if FULL <= 1 else None)
    kind, method = list(SYSTEMS)[k % 5], ["explicit", "explicit", "generalised_alpha", "rosenbrock"][k % 4]
    system, names = random_system(kind, rng), SYSTEMS[kind]
    options = {"t_end": 2.0, "output_step": 1e-4, "method": method, "rtol": 1e-6 if method == "explicit" else 1e-4}
    before = mp.simulate(system, **options)
    texts = [f"{text} - {near_extremum(values(text, before, names), rng)}" for text in
             (random_text(names, rng) for _ in range(5))]  # fmt: skip
    run = mp.simulate(system, **options, events=[mp.Event(name=f"e{i}", when=text) for i, text in enumerate(texts)])
    for i, text in enumerate(texts):
        g = values(text, run, names)
        spline = CubicSpline(run.time, g)
        right = spline.roots(extrapolate=False)
        right = right[(right > 1e-9) & (right <= 2.0)]
        got = run.events[f"e{i}"]
        assert len(got) == len(right), (kind, method, text)
        np.testing.assert_allclose(spline(got), 0, atol=1e-6 * np.ptp(g))
