"""Runs that take long say where they are, how much longer they will take, and what makes their steps short."""

import re

import numpy as np
import pytest

import modalprep as mp
from modalprep.body.rigid import rigid_body
from modalprep.multibody import HingeElement
from modalprep.multibody.integration import endless
from modalprep.pipeline.console import Reporter


class Enough(Exception):
    """Ends a run that would go on for minutes."""


def pendulum(**element):
    """A body whose inertia about the hinge is .1 + 1 * .5^2 = .35 kg m^2."""
    body = rigid_body(
        "a", mass=1.0, centre=np.array([0.5, 0, 0]), inertia=np.diag([0.01, 0.1, 0.1]), interfaces={"root": np.zeros(3)}
    )
    hinge = mp.Joint(name="p", type="revolute", parent="ground", child="a.root", elements=HingeElement(**element))
    return mp.System(bodies={"a": body}, joints=(hinge,), gravity=np.array([0, -9.81, 0]))


def lines_of(system, caplog, count=2):
    """Return the first lines that a run of .2 s writes."""

    def progress(t):
        if len(caplog.records) >= count:
            raise Enough

    with pytest.raises(Enough):
        mp.simulate(system, t_end=0.2, progress=progress)
    return [record.getMessage() for record in caplog.records]


def test_friction_with_a_tiny_transition_velocity(monkeypatch, caplog):
    """It ran over 100 s without a word. The rate is the slope of the friction over the inertia, 1e9 / .35 = 3e9 1/s."""
    monkeypatch.setattr(endless, "FIRST", 0.2)
    for line in lines_of(pendulum(friction=100.0, transition_velocity=1e-7), caplog):
        assert re.search(r"t = \S+ of 0.2 s after \d+ s, .* more at this rate: steps are of \S+ s, since", line)
        assert "the friction, of a transition velocity of 1e-07, of joint 'p' changes with the motion" in line
        assert "at a rate of 3e+09 1/s" in line


def test_quick_runs_say_nothing(caplog):
    mp.simulate(pendulum(), t_end=0.2)
    assert not caplog.records


def test_forecast_is_right_for_steady_progress(monkeypatch, caplog):
    """By a clock of its own: a fifth of the run in 10 s leaves 40 s."""
    clock = iter([0.0, 10.0])
    monkeypatch.setattr(endless, "perf_counter", lambda: next(clock))

    class Steady:
        class steps:
            clock = np.zeros(1, np.dtype([("time", float), ("last_step", float)])).view(np.recarray)

        class loading:
            t_end = 5.0

    lines = endless.Forecast()
    lines.look(Steady)
    Steady.steps.clock[0].time = 1.0
    lines.look(Steady)
    assert [record.getMessage() for record in caplog.records] == ["t = 1 of 5 s after 10 s, 40 s more at this rate"]


def test_quiet_reporters_keep_them_back(caplog):
    with Reporter(quiet=True).progress("run", 1.0):
        endless.LOG.warning("a line")
    with Reporter().progress("run", 1.0):
        endless.LOG.warning("another line")
    assert [record.getMessage() for record in caplog.records] == ["another line"]
