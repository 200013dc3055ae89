"""Functions of the user in a run: none is lost, none runs for ever, and what goes wrong has its own sentence."""

import gc
from itertools import product
from types import MappingProxyType

import numpy as np
import pytest
from size import some

import modalprep as mp
from modalprep.examples import uniform_beam
from modalprep.multibody import Callback

ROD = mp.rigid_body("rod", mass=1.0, inertia=np.eye(3), centre=np.array([1.0, 0, 0]), interfaces={"root": np.zeros(3)})


def pendulum(function=None, body=ROD):
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="arm")
    loads = () if function is None else (Callback(name="law", function=function),)
    return mp.System(bodies={"arm": body}, joints=(hinge,), gravity=np.array([0, -9.81, 0]), loads=loads)


def torque(value):
    return lambda t, state: {"hinge": np.array([value(t, state)])}


class TestReferenceWithEvents:
    """The reference implementation and the event functions are both called from compiled code."""

    def test_it_is_called_to_the_end(self):
        """With its callback dropped, a segmentation fault in three of four runs."""
        low = mp.Event(name="low", when="hinge.angle + 0.2")
        arm = pendulum(body=uniform_beam(modes=1))
        runs = [
            mp.simulate(arm, t_end=1.0, events=(low,), reference=reference, progress=lambda t: gc.collect())
            for reference in (True, False)
        ]
        assert [run.status for run in runs] == ["done", "done"]
        # both runs have the same method and tolerance: they differ by round-off alone, which a second amplifies little
        assert runs[0].events["low"] == pytest.approx(runs[1].events["low"], rel=1e-8)
        assert runs[0]["hinge.angle"] == pytest.approx(runs[1]["hinge.angle"], rel=1e-8, abs=1e-8)

    def test_what_it_raises_is_raised(self):
        def stops(t, state):
            if t > 0.1:
                raise ValueError("enough")
            return 0.0

        low = mp.Event(name="low", when="hinge.angle + 20")
        with pytest.raises(ValueError, match="enough"):
            mp.simulate(pendulum(torque(stops)), t_end=1.0, events=(low,), reference=True)


class TestNoise:
    """A law without a smooth course: steps go towards zero, and the run would never end."""

    @pytest.mark.parametrize("method", ["auto", "explicit", "rosenbrock", "generalised_alpha"])
    def test_drawn_in_each_call(self, method):
        calls, draw = [], np.random.default_rng(0)

        def noise(t, state):
            calls.append(t)
            return draw.standard_normal()

        with pytest.raises(mp.SimulationError, match=r"callback 'law' change as much .* draw noise before the run"):
            mp.simulate(pendulum(torque(noise)), t_end=1.0, method=method)
        assert len(calls) < 20_000  # 341 457, and no end, without the sentence

    def test_function_of_time_without_a_course(self):
        rough = torque(lambda t, state: np.sin(1e15 * t))
        with pytest.raises(mp.SimulationError, match="draw noise before the run"):
            mp.simulate(pendulum(rough), t_end=1.0)

    @pytest.mark.parametrize("amplitude", [0.0, 1e-9])
    def test_below_the_tolerance_it_is_accepted(self, amplitude):
        draw = np.random.default_rng(0)
        run = mp.simulate(pendulum(torque(lambda t, state: amplitude * draw.standard_normal())), t_end=0.2)
        assert run.status == "done"

    def test_jumps_are_accepted(self):
        """Steps are short at a jump, but the course between is smooth."""
        run = mp.simulate(pendulum(torque(lambda t, state: np.sign(np.sin(2e3 * t)))), t_end=0.05)
        assert run.status == "done"

    def test_fixed_steps_take_noise(self):
        draw = np.random.default_rng(0)
        run = mp.simulate(pendulum(torque(lambda t, state: draw.standard_normal())), t_end=0.1, step=1e-3)
        assert run.status == "done"


class TestStiff:
    """A law that changes with the motion so fast that explicit steps would not reach the end."""

    SENTENCE = r"the load of callback '{}' is too stiff .* use dampers, springs or bushings"

    LAWS = MappingProxyType({
        "damper": lambda joint: -1e9 * joint.rate.item(),
        "spring": lambda joint: -1e18 * joint.position.item() - joint.rate.item(),
    })  # fmt: skip

    @pytest.mark.parametrize(("law", "method"), some(product(LAWS, ["auto", "explicit"]), 2))
    def test_ends_with_a_sentence(self, law, method):
        """Both have rates of some 1e9 1/s: a second takes 1e10 evaluations, and took more than 500 s without a word."""
        calls = []

        def stiff(t, state):
            calls.append(t)
            return self.LAWS[law](state.joint("hinge"))

        with pytest.raises(mp.SimulationError, match=self.SENTENCE.format("law")):
            mp.simulate(pendulum(torque(stiff)), t_end=1.0, method=method)
        assert len(calls) < 60_000

    def test_the_sentence_names_the_stiff_one(self):
        laws = tuple(
            Callback(name=name, function=torque(lambda t, state, c=c: -c * state.joint("hinge").rate.item()))
            for name, c in (("soft", 1.0), ("brake", 1e9), ("none", 0.0))
        )
        with pytest.raises(mp.SimulationError, match=self.SENTENCE.format("brake")):
            mp.simulate(pendulum().with_(loads=laws), t_end=1.0)

    def test_long_run_of_a_law_that_is_not_stiff(self):
        """A rate of 1e3 1/s is worth its 2e4 evaluations; the exact motion follows the torque within 1/rate."""
        brake = torque(
            lambda t, state: (
                9.81 * np.cos(state.joint("hinge").position.item()) - 2e3 * (state.joint("hinge").rate.item() - 1)
            )
        )
        run = mp.simulate(pendulum(brake), t_end=8.0, method="explicit")
        # 2 kg m2 against 2e3 N m s/rad: the rate of 1 rad/s is reached with a time constant of 1 ms
        assert run["hinge.angle"][-1] == pytest.approx(8.0 - 1e-3, rel=1e-5)

    @pytest.mark.parametrize("t_end", [1e9, 1e17])
    def test_steps_too_short_for_any_end(self, t_end):
        """Without callbacks too: a fast rotor over thirty years had no end, over longer the body "had no inertia"."""
        spin = mp.Joint(name="hinge", type="revolute", parent="ground", child="arm", rate=1e3)
        with pytest.raises(mp.SimulationError, match=r"so short that the rest of the run .* lower t_end"):
            mp.simulate(pendulum().with_(joints=(spin,)), t_end=t_end, output_step=t_end / 100)


class TestEvents:
    """Event functions of the user."""

    @pytest.mark.parametrize(
        ("value", "words"),
        [
            (np.nan, "event 'low': its function is not a number at t = 0 s"),
            ("low", "event 'low': its function returned 'low' at t = 0 s; return a number"),
            (None, "event 'low': its function"),
            (np.ones(2), r"event 'low': its function returned array\(\[1., 1.\]\)"),
        ],
    )
    def test_value_that_is_no_number(self, value, words):
        with pytest.raises(mp.InputError, match=words):
            mp.simulate(pendulum(), t_end=0.1, events=(mp.Event(name="low", when=lambda t, state: value),))

    def test_value_that_is_none_later(self):
        late = mp.Event(name="late", when=lambda t, state: np.nan if t > 0.05 else 1.0)
        with pytest.raises(mp.InputError, match="event 'late': its function is not a number at t = 0.0"):
            mp.simulate(pendulum(), t_end=0.1, events=(late,))

    def test_two_of_one_name(self):
        """The times of the first were lost."""
        twice = [mp.Event(name="low", when=f"hinge.angle + {x}") for x in (0.1, 0.2)]
        with pytest.raises(mp.InputError, match="2 events have the name 'low'; give each its own"):
            mp.simulate(pendulum(), t_end=0.1, events=twice)


class TestUnstable:
    @pytest.mark.parametrize("method", ["explicit", "rosenbrock", "generalised_alpha"])
    def test_fixed_step_too_long_for_a_law(self, method):
        """A damper of 1e9 N m s/rad on 2 kg m2 has a time constant of 2 ns: trials overflow, no load is infinite."""
        damper = torque(lambda t, state: -1e9 * state.joint("hinge").rate.item())
        with pytest.raises(mp.SimulationError, match=r"unstable with the fixed step of 0.01 s, body 'arm'"):
            mp.simulate(pendulum(damper), t_end=1.0, method=method, step=0.01)

    def test_load_that_is_not_finite(self):
        with pytest.raises(mp.InputError, match=r"callback 'law': load on 'hinge' is not finite at t = 0 s"):
            mp.simulate(pendulum(torque(lambda t, state: np.inf)), t_end=1.0)

    def test_load_without_bound_on_a_rigid_body(self):
        """A rigid body has no modes to drop."""
        with pytest.raises(mp.SimulationError, match=r"body 'arm' moves fastest; look for loads that jump") as raised:
            mp.simulate(pendulum(torque(lambda t, state: 1 / (t - 0.5) ** 2)), t_end=1.0)
        assert "modes" not in str(raised.value)

    @pytest.mark.parametrize("reference", [False, True])
    def test_body_without_inertia(self, reference):
        """A point mass on its own hinge: no deflection is too large, nothing resists the turn."""
        point = mp.rigid_body(
            "bob", mass=1.0, inertia=np.zeros((3, 3)), centre=np.zeros(3), interfaces={"root": np.zeros(3)}
        )
        with pytest.raises(mp.SimulationError, match=r"body 'arm' can turn or move without .* inertia") as raised:
            mp.simulate(pendulum(body=point), t_end=1.0, reference=reference)
        assert "deflection" not in str(raised.value)
