"""Bushings that are turned by half a turn: the run ends there, with a sentence, where their torques would jump."""

import numpy as np
import pytest

import modalprep as mp
from modalprep.cli import main
from modalprep.multibody.integration.method_selection import METHODS
from modalprep.multibody.results.validity import failures

FILE = """
[bodies.b]
mass = 1.0
centre = [0, 0, 0]
inertia = [1, 1, 1]
interfaces = { c = [0, 0, 0] }
[joints.j]
type = "revolute"
child = "b.c"
start = { rate = RATE }
[bushings.k]
between = ["ground", "b.c"]
stiffness = [0, 0, 0, 10, 10, 10]
damping = [0, 0, 0, 0, 0, 0]
[simulation]
t_end = 2.0
output = ["j.angle"]
"""


def on_axle(stiffness, rate, axis=(0, 0, 1.0)):
    """A body of 1 kg m^2 about its axle, held by a bushing."""
    wheel = mp.rigid_body("b", mass=1.0, centre=np.zeros(3), inertia=np.eye(3), interfaces={"c": np.zeros(3)})
    axle = mp.Joint(name="j", type="revolute", parent="ground", child="b", axis=np.array(axis), rate=rate)
    mount = mp.multibody.Bushing(name="k", between=("ground", "b.c"), stiffness=np.array(stiffness, dtype=float))
    return mp.System(bodies={"b": wheel}, joints=(axle,), loads=(mount,))


def test_a_wound_bushing_ends_the_run_with_exit_code_1(tmp_path, capsys):
    """15 rad/s and 10 N m/rad: 4.74 rad at most by energy, and half a turn at asin(pi w / 15) / w; it went to 27.55."""
    job = tmp_path / "job.toml"
    job.write_text(FILE.replace("RATE", "15.0"))
    assert main(["simulate", str(job)]) == 1
    w = np.sqrt(10.0)
    said = capsys.readouterr().err
    assert f"ended at t = {np.arcsin(np.pi * w / 15) / w:.4g}" in said
    assert "bushing 'k' passes half a turn, where its torque would jump: make it an element of a joint" in said
    assert mp.read_result(tmp_path / "output/job/job-run.h5")["j.angle"].max() < np.pi
    job.write_text(FILE.replace("RATE", "9.9"))  # up to 3.1306 rad
    assert main(["simulate", str(job)]) == 0


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("axis", [(0, 0, 1.0), (1.0, -2.0, 0.5)])
def test_half_a_turn_is_found_by_every_method(method, axis):
    """Also at once about an axis between those of the bushing, and backwards, whatever the length of the steps."""
    w, run = 0.01, mp.simulate(on_axle([0, 0, 0, 1e-4, 1e-4, 1e-4], -2.0, axis), t_end=5.0, method=method, rtol=1e-3)
    assert run.status == "diverged"
    assert run.time[-1] == pytest.approx(np.arcsin(np.pi * w / 2) / w, abs=0.01)  # the step of the outputs
    assert "passes half a turn" in failures(run, 1e-3, 1.0)[0]


def test_an_axis_without_stiffness_turns_on():
    run = mp.simulate(on_axle([1e3, 1e3, 1e3, 50, 50, 0], 9.0), t_end=5.0)
    assert run.status == "done"
    np.testing.assert_allclose(run["j.angle"][-1], 45.0, rtol=1e-5)


def test_an_event_before_half_a_turn_ends_the_run_as_it_should():
    event = mp.Event(name="stop", when="j.angle - 3.141", terminal=True)
    run = mp.simulate(on_axle([0, 0, 0, 10, 10, 10], 15.0), t_end=2.0, events=[event])
    assert run.status == "done"
    assert run["j.angle"][-1] == pytest.approx(3.141, abs=1e-8)
