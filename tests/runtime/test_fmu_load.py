"""FMUs as loads: two systems beside each other, against the one system that both make, and loads that are sampled."""

import pickle
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import modalprep as mp
from modalprep.body.rigid import rigid_body
from modalprep.errors import InputError, SimulationError
from modalprep.examples import uniform_beam
from modalprep.multibody.evaluation.feedback import feedback
from modalprep.multibody.model.events import Event
from modalprep.multibody.model.joint_element import HingeElement
from modalprep.multibody.model.loads import SampledLoad
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.run import run_pipeline
from modalprep.runtime.fmu import write_fmu
from modalprep.runtime.fmu_load import fmu_load

END, STEP = 1.0, 0.1
ENDS = {"root": np.zeros(3), "tip": np.array([1.0, 0, 0])}
ROD = rigid_body("rod", mass=1.0, centre=[0.5, 0, 0], inertia=np.eye(3) / 12, interfaces=ENDS)
DISC = rigid_body("disc", mass=1.0, centre=np.zeros(3), inertia=0.2 * np.eye(3), interfaces={"root": np.zeros(3)})
SHAFT = rigid_body("shaft", mass=1e-9, centre=np.zeros(3), inertia=1e-9 * np.eye(3), interfaces={"end": np.zeros(3)})
SPRING = HingeElement(stiffness=20.0)
DOWN = np.array([0, -9.81, 0])


def pendulum(*loads, **more):
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="rod", **more)
    return mp.System(bodies={"rod": ROD}, joints=(hinge,), gravity=DOWN, loads=loads)


def whole():
    """A pendulum that turns a disc by a spring."""
    clutch = mp.Joint(name="clutch", type="revolute", parent="rod.root", child="disc", elements=SPRING)
    alone = pendulum()
    return replace(alone, bodies={"rod": ROD, "disc": DISC}, joints=(*alone.joints, clutch))


def rotor():
    """The disc on the spring, whose other end is moved from outside."""
    base = mp.Joint(name="base", type="revolute", parent="ground", child="shaft", motion=0.0)
    clutch = mp.Joint(name="clutch", type="revolute", parent="shaft.end", child="disc", elements=SPRING)
    aside = mp.Joint(
        name="aside", type="revolute", parent="ground", child="beam"
    )  # at rest: the library of other tests
    bodies = {"shaft": SHAFT, "disc": DISC, "beam": uniform_beam(modes=1)}
    return mp.System(bodies=bodies, joints=(base, clutch, aside))


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    pytest.importorskip("ziglang")
    pytest.importorskip("fmpy")
    folder = tmp_path_factory.mktemp("load")
    for fmi in ("2", "3"):
        write_fmu(rotor(), folder / f"rotor{fmi}.fmu", fmi=fmi, t_end=END, output_step=0.01, rtol=1e-8)
    return folder


INPUTS = {"base.motion_input": "hinge.angle", "base.motion_rate_input": "hinge.rate"}


def coupled(folder, step, fmi="2"):
    """Return the run of the pendulum with the disc in an FMU, and the energy that the FMU gives back."""
    load = fmu_load("rotor", folder / f"rotor{fmi}.fmu", "hinge", ["-base.drive"], inputs=INPUTS, step=step)
    run = mp.simulate(pendulum(load), t_end=END, output_step=STEP, rtol=1e-9)
    slave = load.sample.slave
    slave.step(END)
    return run, slave.get(["energy.work"])["energy.work"]


@cache
def reference():
    return mp.simulate(whole(), t_end=END, output_step=STEP, rtol=1e-10)["hinge.angle"]


def test_an_fmu_beside_a_system_is_the_whole_system(files):
    """Errors fall with the first power of the step, and so does the energy that the exchange makes, which is stated."""
    runs = {step: coupled(files, step) for step in (4e-3, 2e-3)}
    errors = [np.abs(run["hinge.angle"] - reference()).max() for run, _ in runs.values()]
    assert errors[0] < 0.02 * np.ptp(reference())
    np.testing.assert_allclose(errors[0] / errors[1], 2.0, rtol=0.1)
    for run, given in runs.values():
        made = run["energy.work"][-1] + given  # what one side gives the other does not get
        np.testing.assert_allclose(run.stats["exchange.rotor.work"], run["energy.work"][-1], rtol=0.02)
        np.testing.assert_allclose(run.stats["exchange.rotor.error"], -made, rtol=0.1)
    said, quiet = (any("out of balance" in note for note in coupled(files, step)[0].notes) for step in (0.05, 1e-3))
    assert said
    assert not quiet


def test_runs_begin_anew_in_both_versions(files):
    first, again = (coupled(files, 0.01, fmi)[0]["hinge.angle"] for fmi in "23")
    np.testing.assert_array_equal(first, again)
    load = fmu_load("rotor", files / "rotor2.fmu", "hinge", ["-base.drive"], inputs=INPUTS, step=0.01)
    system = pendulum(load)
    for _ in range(2):
        np.testing.assert_array_equal(mp.simulate(system, t_end=END, output_step=STEP, rtol=1e-9)["hinge.angle"], first)
    copy = pickle.loads(pickle.dumps(system))  # for another process
    np.testing.assert_array_equal(mp.simulate(copy, t_end=END, output_step=STEP, rtol=1e-9)["hinge.angle"], first)
    default = fmu_load("rotor", files / "rotor2.fmu", "hinge", ["-base.drive"], inputs=INPUTS)
    assert default.period == 0.01  # of the default experiment


def test_a_sampled_controller_is_held():
    """As a run whose pieces begin from each other, with the torque of each as a number."""
    period = 0.1
    gains = np.array([-3.0, -2.0])

    def torque(state):
        return float(gains @ [*state.joint("hinge").position, *state.joint("hinge").rate])

    law = SampledLoad(name="law", sample=lambda t, state: {"hinge": torque(state)}, period=period)
    run = mp.simulate(pendulum(law), t_end=0.5, output_step=period, rtol=1e-10)
    angle, rate, angles = 0.0, 0.0, [0.0]
    for _ in range(5):
        held = HingeElement(drive=float(gains @ [angle, rate]))
        part = mp.simulate(
            pendulum(elements=held, angle=angle, rate=rate), t_end=period, output_step=period, rtol=1e-10
        )
        angle, rate = part["hinge.angle"][-1], part["hinge.rate"][-1]
        angles.append(angle)
    np.testing.assert_allclose(run["hinge.angle"], angles, rtol=1e-8, atol=1e-12)
    assert "exchange.law.work" not in run.stats
    first = mp.simulate(pendulum(law), t_end=0.25, output_step=0.05, rtol=1e-10)  # between two calls
    again = mp.simulate(pendulum(law), t_end=0.5, output_step=0.05, rtol=1e-10, start=first)
    assert again["hinge.angle"][0] == first["hinge.angle"][-1]


def test_short_periods_are_continuous_feedback():
    law = SampledLoad(
        name="law",
        sample=lambda t, s: {"hinge": -3 * s.joint("hinge").position - 2 * s.joint("hinge").rate},
        period=1e-3,
    )
    continuous = feedback("law", "hinge", ["-3*hinge.angle - 2*hinge.rate"])
    runs = [mp.simulate(pendulum(load), t_end=END, output_step=STEP) for load in (law, continuous)]
    np.testing.assert_allclose(*(run["hinge.angle"] for run in runs), atol=2e-3 * np.ptp(runs[0]["hinge.angle"]))


def test_what_has_no_sampled_loads_refuses_them():
    law = SampledLoad(name="law", sample=lambda t, state: {"hinge": 1.0}, period=0.1)
    system = pendulum(law)
    mp.simulate(system, t_end=0.2)
    with pytest.raises(InputError, match="'law' is sampled in time"):
        mp.linearise(system)
    with pytest.raises(InputError, match="'law' is sampled in time"):
        mp.run_sensitivities(system, ["hinge.angle"], ["gravity.y"], 0.2)
    with pytest.raises(InputError, match="period = 0"):
        SampledLoad(name="law", sample=law.sample, period=0)


def test_wrong_fmus_are_refused(files, tmp_path):
    rotor2 = files / "rotor2.fmu"
    (tmp_path / "text.fmu").write_text("no archive")
    write_fmu(rotor(), tmp_path / "me.fmu", kind="me", t_end=END)
    for path, outputs, more, said in (
        (tmp_path / "none.fmu", ["base.drive"], {}, "there is no file"),
        (tmp_path / "text.fmu", ["base.drive"], {}, "cannot be read as an FMU"),
        (tmp_path / "me.fmu", ["base.drive"], {}, "not for co-simulation"),
        (rotor2, ["base.drives"], {}, "output 'base.drives'"),
        (rotor2, ["base.drive"], {"inputs": {"angle": "hinge.angle"}}, "input 'angle'"),
        (rotor2, ["base.drive"], {"start": {"mass": 1.0}}, "start value 'mass'"),
        (rotor2, ["base.drive"], {"axes": "body"}, "body axes need a force"),
    ):
        with pytest.raises(InputError, match=said):
            fmu_load("rotor", path, "hinge", outputs, **{"inputs": INPUTS, **more})
    ended = rotor()
    write_fmu(ended, tmp_path / "ends.fmu", t_end=END, events=[Event(name="full", when="t - 0.5", terminal=True)])
    load = fmu_load("rotor", tmp_path / "ends.fmu", "hinge", ["-base.drive"], inputs=INPUTS, step=0.02)
    with pytest.raises(SimulationError, match="cannot go on from t = 0.48 s by 0.02 s: event 'full' ends the run"):
        mp.simulate(pendulum(load), t_end=END)


FILE = """
[bodies.rod]
mass = 1.0
centre = [0.5, 0, 0]
inertia = [0.0833333333333333, 0.0833333333333333, 0.0833333333333333]
interfaces = { root = [0, 0, 0], tip = [1, 0, 0] }

[joints.hinge]
type = "revolute"
child = "rod.root"

[environment]
gravity = [0, -9.81, 0]

[fmu.rotor]
file = "rotor3.fmu"
at = "hinge"
values = ["-base.drive"]
inputs = { "base.motion_input" = "hinge.angle", "base.motion_rate_input" = "hinge.rate" }
step = 0.002

[simulation]
t_end = 1.0
output_step = 0.1
rtol = 1e-9
"""


def test_an_fmu_of_a_pipeline_file(files, tmp_path):
    (tmp_path / "rotor3.fmu").write_bytes((files / "rotor3.fmu").read_bytes())
    (tmp_path / "system.toml").write_text(FILE)
    run_pipeline(tmp_path / "system.toml", tmp_path / "out", Reporter(quiet=True))
    run = mp.read_result(next((tmp_path / "out").rglob("*.h5")))
    np.testing.assert_allclose(run["hinge.angle"], coupled(files, 0.002)[0]["hinge.angle"], rtol=1e-6, atol=1e-9)
    (tmp_path / "system.toml").write_text(FILE.replace('"hinge.rate"', '"hinge.rates"'))
    with pytest.raises(InputError, match="FMU 'rotor': input 'base.motion_rate_input'.*no channel 'hinge.rates'"):
        run_pipeline(tmp_path / "system.toml", tmp_path / "out", Reporter(quiet=True))
