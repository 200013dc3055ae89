"""FMUs in a process without modalprep, run by FMPy with its own integrator (CVode) or by the kernels inside."""

import ctypes
import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pytest
from size import FULL

import modalprep as mp
from modalprep.errors import InputError
from modalprep.examples import large_cantilever, small_systems, uniform_beam
from modalprep.multibody.model.constraints import Closure
from modalprep.multibody.model.events import Event
from modalprep.multibody.model.joint_element import HingeElement
from modalprep.multibody.model.loads import Callback, PointForce
from modalprep.multibody.model.time_function import TimeFunction
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.fmu import fmu_of_pipeline
from modalprep.pipeline.schema.load import load
from modalprep.pipeline.systems.read import read_system
from modalprep.runtime.fmu import write_fmu

pytest.importorskip("ziglang")
fmpy = pytest.importorskip("fmpy")
KINDS = {"cs": "CoSimulation", "me": "ModelExchange"}
STEP, END = 0.05, 2.0
TIP = "arm.tip.position[2]"
BEAM = uniform_beam(modes=2)


def arm(drive=0.0, damping=40.0, force=(0.0, 0.0, 0.0), gravity=-9.81, angle=0.0):
    """A beam on a damped hinge with a drive, under gravity, with a force at its tip."""
    motor = HingeElement(damping=damping, drive=drive)
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="arm", elements=motor, angle=angle)
    push = PointForce(name="push", at="arm.tip", force=force)
    return mp.System(bodies={"arm": BEAM}, joints=(hinge,), gravity=np.array([0, gravity, 0]), loads=(push,))


def imported(jobs, folder):
    """Return the runs of FMUs in another process, and what FMPy's validation says."""
    given, results = folder / "jobs.json", folder / "results.npz"
    given.write_text(json.dumps(jobs))
    script = Path(__file__).with_name("importing.py")
    subprocess.run([sys.executable, "-I", script, given, results], check=True)
    found = dict(np.load(results))
    return found, json.loads(str(found.pop("problems")))


def channel(run, name):
    """Return the history of an output as FMI names it."""
    base, _, number = name.partition("[")
    return run[base][:, int(number[:-1]) - 1] if number else run[base]


def apart(found, run, outputs):
    """Return the largest difference of all outputs, each over its largest value."""
    time, *columns = found
    worst = 0.0
    for name, column in zip(outputs, columns, strict=True):
        own = channel(run, name)
        there = np.interp(run.time, time, column)
        worst = max(worst, np.abs(there - own).max() / np.abs(own).max())
    return worst


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """The FMU of the arm, of both versions."""
    folder = tmp_path_factory.mktemp("fmu")
    for fmi in ("2", "3"):
        write_fmu(arm(), folder / f"arm{fmi}.fmu", fmi=fmi, t_end=END, output_step=STEP, rtol=1e-6)
    return folder


def jobs_of(folder, name, outputs, stop, step, tolerances, **own):
    return [
        {
            "name": f"{kind}{fmi}",
            "file": str(folder / f"{name}{fmi}.fmu"),
            "kind": KINDS[kind],
            "stop": stop,
            "step": step,
            "tolerance": tolerances[kind],
            "outputs": outputs,
            **own,
        }
        for fmi in "23"
        for kind in tolerances
    ]


# Tolerances: simulate is run ten times as exactly at least; both integrators control the error of a step, of which a
# run has hundreds. CVode's is that of states alone, so accelerations and forces of stiff modes are not compared; in the
# bracket it follows vibrations of 50 kHz, which a looser tolerance leaves out.
@pytest.mark.parametrize(
    ("name", "outputs", "stop", "step", "allowed"),
    [
        ("spinup-beam", ["hub.rate", "beam.tip.deflection[2]", "energy.work"], 4.0, 0.02, (2e-5, 1e-7)),
        pytest.param(
            *("slider-crank", ["rod.modal[1]", "slide.displacement", "energy.work"], 0.06, 2e-4, (2e-5, 1e-7)),
            marks=pytest.mark.skipif(not FULL, reason="minutes: it compiles another library"),
        ),
        ("bracket-pendulum", ["shoulder.angle", "lower.bolt_b.position[2]"], 0.04, 1e-3, (5e-4, 1e-4)),
    ],
)
def test_shipped_systems_run_without_modalprep(name, outputs, stop, step, allowed, project, tmp_path):
    source = load(project / "pipelines" / f"{name}.toml")
    quiet = Reporter(quiet=True)
    for fmi in ("2", "3"):
        fmu_of_pipeline(source, tmp_path, quiet, target=tmp_path / f"{name}{fmi}.fmu", fmi=fmi)
    jobs = jobs_of(tmp_path, name, outputs, stop, step, {"cs": 1e-7, "me": allowed[1]})
    found, problems = imported(jobs, tmp_path)
    assert not any(problems.values())
    run = mp.simulate(read_system(source, tmp_path, quiet), t_end=stop, output_step=step, rtol=1e-8)
    for job, history in found.items():
        assert apart(history, run, outputs) < (allowed[0] if job.startswith("me") else 2e-5), job
    np.testing.assert_array_equal(found["cs2"], found["cs3"])


def linkage(left, right, rate=0.0, gravity=-9.81):
    """A linkage of four bars: two rods on hinges 1.5 m apart at some angles, their ends joined by a bar."""
    rod = small_systems()["rigid bodies in trees"].bodies["rod"]
    hinges = [
        mp.Joint(name=name, type="revolute", parent="ground", child=name, position=[x, 0, 0], angle=angle, rate=rate)
        for name, x, angle in (("left", 0.0, left), ("right", 1.5, right))
    ]
    bar = Closure(name="bar", type="distance", a="left.tip", b="right.tip")
    bodies = {hinge.name: rod for hinge in hinges}
    return mp.System(bodies=bodies, joints=hinges, closures=(bar,), gravity=np.array([0, gravity, 0]))


@pytest.mark.slow  # it compiles another library
def test_rigid_bodies_in_closed_loops(tmp_path):
    """A linkage of four bars under gravity, up to an event."""
    system, event = linkage(0.3, -0.2), Event(name="low", when="right.tip.position.y + 0.6", terminal=True)
    outputs = ["left.angle", "right.rate", "right.tip.position[2]"]
    for fmi in "23":
        write_fmu(system, tmp_path / f"bars{fmi}.fmu", fmi=fmi, t_end=1.0, output_step=STEP, events=[event])
    found, problems = imported(jobs_of(tmp_path, "bars", outputs, 1.0, STEP, {"cs": 1e-8, "me": 1e-8}), tmp_path)
    assert not any(problems.values())
    run = mp.simulate(system, t_end=1.0, output_step=STEP, rtol=1e-10, events=[event])
    assert np.ptp(run["right.angle"]) > 0.3
    for job, history in found.items():
        assert abs(history[0, -1] - run.events["low"][0]) < 1e-6, job
        assert apart(history, run, outputs) < 2e-6, job


@pytest.mark.slow  # it compiles another library
def test_a_change_point_is_told(tmp_path):
    """A parallelogram that passes through one line at an angle of zero: once, by steps of its own and of others."""
    system = linkage(0.3, 0.3, rate=-4.0, gravity=0.0)
    model = write_fmu(system, tmp_path / "arm2.fmu", t_end=0.2)
    assert any("tells where closed loops come near a change point" in note for note in model.notes)
    run = mp.simulate(system, t_end=0.2, output_step=0.01, rtol=1e-9)
    assert "pass a change point" in run.notes[0]
    instance = Instance(tmp_path / "arm", tmp_path / "arm2.fmu")
    made = instance.begun()
    assert not any(instance.step(made, 0.01 * k, 0.01) for k in range(20))
    assert abs(instance.get(made, "right.angle") - run["right.angle"][-1]) < 1e-6
    (told,) = instance.said
    crossed = np.interp(0.0, -run["left.angle"], run.time)
    assert abs(float(re.match(r"near t = (\S+) s the closed loops come close", told)[1]) - crossed) < 0.05
    other = instance.begun(exchange=True)
    for k, t in enumerate(run.time):
        states = [run[name][k] for name in ("left.angle", "right.angle", "left.rate", "right.rate")]
        assert instance.complete(other, t, [*states, 0.0]) == 0
    assert len(instance.said) == 2


@pytest.mark.slow  # it compiles another library
def test_loops_far_from_change_points_are_told_nothing_of_them(tmp_path):
    write_fmu(linkage(1.2, 1.0), tmp_path / "arm2.fmu", t_end=0.2)
    instance = Instance(tmp_path / "arm", tmp_path / "arm2.fmu")
    assert instance.step(instance.begun(), 0.0, 0.2) == 0
    assert not instance.said


def test_an_event_ends_the_run(tmp_path):
    """Where `simulate` ends; the joint has come to its limit before, where an integrator has to stop for the kink."""
    event = Event(name="down", when="arm.tip.position.y + 5*cos(t)", direction=-1, terminal=True)
    motor = HingeElement(damping=40.0, lower=-0.3, limit_stiffness=1e5, limit_damping=0.1)
    system = replace(arm(), joints=(replace(arm().joints[0], elements=motor),))
    for fmi in "23":
        model = write_fmu(system, tmp_path / f"arm{fmi}.fmu", fmi=fmi, t_end=END, output_step=STEP, events=[event])
        assert {"event.down", "hinge.lower_limit"} <= {each.name for each in model.variables}
        assert not model.notes
    outputs = ["hinge.angle", TIP]
    found, problems = imported(jobs_of(tmp_path, "arm", outputs, END, STEP, {"cs": 1e-9, "me": 1e-9}), tmp_path)
    assert not any(problems.values())
    run = mp.simulate(system, t_end=END, output_step=STEP, rtol=1e-10, events=[event])
    (when,) = run.events["down"]
    assert run["hinge.angle"].min() < -0.3 < 0.8 * END - when
    for job, history in found.items():
        assert abs(history[0, -1] - when) < 1e-7, job
        assert apart(history, run, outputs) < 1e-6, job


def test_an_event_that_passes_and_comes_back_within_a_step_ends_the_run(tmp_path):
    """It is negative for 2 ms in the middle of a second, where `simulate` ends; steps are longer."""
    event = Event(name="brief", when="(t - 0.503)^2 - 1e-6 + 1e-9*hinge.angle", terminal=True)
    write_fmu(arm(), tmp_path / "arm2.fmu", t_end=1.0, output_step=1.0, rtol=1e-4, events=[event])
    run = mp.simulate(arm(), t_end=1.0, output_step=1.0, rtol=1e-4, events=[event])
    instance = Instance(tmp_path / "arm", tmp_path / "arm2.fmu")
    made = instance.begun()
    assert instance.step(made, 0.0, 1.0) == 2  # fmi2Discard
    assert abs(instance.get(made, "time") - run.events["brief"][0]) < 1e-9


def test_events_that_only_report_are_indicators(tmp_path):
    """The zeros of the indicators are the events of `simulate`, in every function that expressions have."""
    texts = (
        "hinge.angle + 0.4",
        "arm.tip.position.x - 9.5 + 0*sinh(t)",
        "exp(hinge.rate) - 2^(hinge.angle + 0.1)/sqrt(1 + t)",
        "log(1 + t) + tan(0.1*hinge.angle) - asin(0.1*t) - acos(0.1*t)/2 + atan(t) - tanh(t) - cosh(0.1*t) + 1.2",
    )
    events = [Event(name=f"e{k}", when=text) for k, text in enumerate(texts)]
    model = write_fmu(arm(), tmp_path / "arm2.fmu", t_end=END, events=events)
    assert any("in model exchange only: e0, e1, e2, e3" in note for note in model.notes)
    run = mp.simulate(arm(), t_end=END, output_step=0.01, rtol=1e-9, events=events)
    outputs = [f"event.e{k}" for k in range(len(texts))]
    job = {"name": "run", "file": str(tmp_path / "arm2.fmu"), "kind": KINDS["cs"], "stop": END, "step": 0.01}
    found, _ = imported([{**job, "tolerance": 1e-9, "outputs": outputs}], tmp_path)
    time, *values = found["run"]
    for event, value in zip(events, values, strict=True):
        there = np.flatnonzero(np.diff(np.sign(value)))
        crossed = time[there] - value[there] * 0.01 / np.diff(value)[there]
        assert len(crossed)
        np.testing.assert_allclose(crossed, run.events[event.name], atol=1e-4)  # straight lines between outputs


def test_a_controller_in_the_importing_program(files, tmp_path):
    """As `simulate` with the torques that the controller gave, each held up to the next communication point."""
    law = {"input": "hinge.drive_input", "gains": {"hinge.angle": -4e3, "hinge.rate": -3e3}}
    outputs = ["hinge.angle", "hinge.rate", TIP, "energy.work"]
    jobs = jobs_of(files, "arm", outputs, END, STEP, {"cs": 1e-8}, law=law)
    found, _ = imported(jobs, tmp_path)
    gains = np.array(list(law["gains"].values()))
    for job, history in found.items():
        torque = gains @ history[1:3]
        torque[0] = 0.0  # it is first called after a step
        pieces = [
            (t if k < len(torque) - 2 else np.inf, u)
            for k, (t, u) in enumerate(zip(history[0][1:], torque, strict=False))
        ]
        run = mp.simulate(arm(TimeFunction(pieces)), t_end=END, output_step=STEP, rtol=1e-10)
        assert apart(history, run, outputs) < 1e-6, job


def test_prescribed_motion_is_an_input(tmp_path):
    """Value, rate and acceleration at each communication point: errors fall with the third power of the step."""
    system = replace(arm(), joints=(mp.Joint(name="hinge", type="revolute", parent="ground", child="arm", motion=0.0),))
    moved = replace(system, joints=(replace(system.joints[0], motion="0.05*(1 - cos(3*t))"),))
    end = 1.0
    run = mp.simulate(moved, t_end=end, output_step=end, rtol=1e-10)
    write_fmu(system, tmp_path / "arm2.fmu", t_end=end)
    instance = Instance(tmp_path / "arm", tmp_path / "arm2.fmu")
    names = [f"hinge.motion{part}_input" for part in ("", "_rate", "_acceleration")]
    errors = {}
    for steps in (50, 100):
        made = instance.begun()
        for k in range(steps):
            t = k * end / steps
            law = 0.05 * np.array([1 - np.cos(3 * t), 3 * np.sin(3 * t), 9 * np.cos(3 * t)])
            assert not any(instance.put(made, name, value) for name, value in zip(names, law, strict=True))
            assert instance.step(made, t, end / steps) == 0
        own = instance.get(made, "arm.modal[1]"), instance.get(made, "energy.work"), instance.get(made, "hinge.angle")
        wanted = run["arm.modal"][-1, 0], run["energy.work"][-1], run["hinge.angle"][-1]
        errors[steps] = np.abs(np.array(own) / wanted - 1)
    assert np.all(errors[50] < 1e-3)
    np.testing.assert_allclose(errors[50] / errors[100], 8.0, rtol=0.15)


def test_a_motion_that_jumps_is_a_ramp(tmp_path):
    """In one communication step, as the polynomial of degree five between both ends, at rest at both."""
    system = replace(arm(), joints=(mp.Joint(name="hinge", type="revolute", parent="ground", child="arm", motion=0.0),))
    ramp = [(0.2, "0"), (0.7, "0.1*(10*(2*t-0.4)^3 - 15*(2*t-0.4)^4 + 6*(2*t-0.4)^5)"), (np.inf, "0.1")]
    moved = replace(system, joints=(replace(system.joints[0], motion=TimeFunction(ramp)),))
    run = mp.simulate(moved, t_end=1.0, output_step=1.0, rtol=1e-9)
    write_fmu(system, tmp_path / "arm2.fmu", t_end=1.0)
    instance = Instance(tmp_path / "arm", tmp_path / "arm2.fmu")
    made = instance.begun()
    assert instance.step(made, 0.0, 0.2) == 0
    assert instance.put(made, "hinge.motion_input", 0.1) == 0
    assert instance.get(made, "hinge.angle") == 0.0
    assert instance.step(made, 0.2, 0.5) == 0
    assert instance.step(made, 0.7, 0.3) == 0
    for name, wanted in (("hinge.angle", 0.1), ("arm.modal[1]", run["arm.modal"][-1, 0]), ("hinge.rate", 0.0)):
        assert abs(instance.get(made, name) - wanted) < 1e-6 * max(abs(wanted), 0.01), name


def test_terminals_are_those_of_the_schema(files):
    """Each member is a variable of the FMU, once."""
    etree = pytest.importorskip("lxml.etree")
    schema = Path(fmpy.__file__).parent / "schema" / "fmi3" / "fmi3TerminalsAndIcons.xsd"
    with ZipFile(files / "arm3.fmu") as archive:
        tree = etree.fromstring(archive.read("terminalsAndIcons/terminalsAndIcons.xml"))
    etree.XMLSchema(etree.parse(schema)).assertValid(tree)
    known = {each.name for each in fmpy.read_model_description(files / "arm3.fmu").modelVariables}
    members = {each.get("variableName") for each in tree.iter("TerminalMemberVariable")}
    assert {"arm.tip.velocity[3]", "push.force[2]"} <= members <= known


def test_an_input_may_be_a_straight_line(instance):
    """By `fmi2SetRealInputDerivatives`, in one step: as `simulate` with a torque that grows with time."""
    made = instance.begun()
    assert instance.put(made, "hinge.drive_input", 500.0) == 0
    assert instance.put_derivative(made, "hinge.drive_input", 4000.0) == 0
    assert instance.put_derivative(made, "gravity[2]", 1.0) == 3
    assert instance.step(made, 0.0, 0.5) == 0
    run = mp.simulate(arm("500 + 4000*t"), t_end=0.5, output_step=0.5, rtol=1e-9)
    assert abs(instance.get(made, "hinge.angle") / run["hinge.angle"][-1] - 1) < 1e-6
    assert abs(instance.get(made, "energy.work") / run["energy.work"][-1] - 1) < 1e-6


def test_inputs_parameters_and_start_values(files, tmp_path):
    """As `simulate` of a system that has the same jumps as functions of time, other constants and another start."""
    pieces = [
        {"until": 0.5, "hinge.drive_input": 0.0, "push.force[2]": 0.0},
        {"until": 1.0, "hinge.drive_input": 3000.0, "push.force[2]": 50.0},
        {"until": END, "hinge.drive_input": -500.0, "push.force[2]": -20.0},
    ]
    start = {"gravity[2]": -1.62, "hinge.damping": 80.0, "hinge.angle": 0.3}
    outputs = ["hinge.angle", TIP, "arm.modal[1]", "energy.work"]
    jobs = jobs_of(files, "arm", outputs, END, STEP, {"cs": 1e-8, "me": 1e-8}, pieces=pieces, start=start)
    found, _ = imported(jobs, tmp_path)

    def law(name):
        return TimeFunction([(p["until"] if p["until"] < END else np.inf, p[name]) for p in pieces])

    moved = arm(law("hinge.drive_input"), 80.0, (0, law("push.force[2]"), 0), -1.62, 0.3)
    run = mp.simulate(moved, t_end=END, output_step=STEP, rtol=1e-9)
    for job, history in found.items():
        same = np.append(np.diff(history[0]) > 0, True)  # after an event
        assert apart(history[:, same], run, outputs) < (1e-5 if job.startswith("me") else 2e-7), job


class Instance:
    """An instance of the co-simulation by plain C calls."""

    def __init__(self, folder, file):
        with ZipFile(file) as archive:
            archive.extractall(folder)
        text = (folder / "modelDescription.xml").read_text()
        self.token = text.split('guid="')[1].split('"')[0]
        self.references = {
            line.split('name="')[1].split('"')[0]: int(line.split('valueReference="')[1].split('"')[0])
            for line in text.splitlines()
            if "<ScalarVariable" in line
        }
        (library,) = (folder / "binaries").glob("*/arm2.*")
        self.c, self.folder = ctypes.CDLL(str(library)), folder
        self.c.fmi2Instantiate.restype = ctypes.c_void_p
        self.said = []

        @ctypes.CFUNCTYPE(
            None, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p, ctypes.c_char_p
        )
        def log(environment, name, status, category, form, text):
            self.said.append(text.decode())

        self.log = log
        self.callbacks = (ctypes.c_void_p * 5)(ctypes.cast(log, ctypes.c_void_p), None, None, None, None)

    def new(self, token=None, exchange=False):
        where, token = f"{(self.folder / 'resources').as_uri()}".encode(), (token or self.token).encode()
        return self.c.fmi2Instantiate(b"one", 0 if exchange else 1, token, where, self.callbacks, 0, 0)

    def begun(self, exchange=False):
        made = ctypes.c_void_p(self.new(exchange=exchange))
        assert (
            self.c.fmi2SetupExperiment(made, 1, ctypes.c_double(1e-7), ctypes.c_double(0.0), 0, ctypes.c_double(0.0))
            == 0
        )
        assert self.c.fmi2EnterInitializationMode(made) == 0
        assert self.c.fmi2ExitInitializationMode(made) == 0
        return made

    def put(self, made, name, value):
        return self.c.fmi2SetReal(
            made, (ctypes.c_uint * 1)(self.references[name]), ctypes.c_size_t(1), (ctypes.c_double * 1)(value)
        )

    def put_derivative(self, made, name, value):
        reference = (ctypes.c_uint * 1)(self.references[name])
        return self.c.fmi2SetRealInputDerivatives(
            made, reference, ctypes.c_size_t(1), (ctypes.c_int * 1)(1), (ctypes.c_double * 1)(value)
        )

    def get(self, made, name):
        value = (ctypes.c_double * 1)()
        assert self.c.fmi2GetReal(made, (ctypes.c_uint * 1)(self.references[name]), ctypes.c_size_t(1), value) == 0
        return value[0]

    def complete(self, made, t, states):
        """Give a state, ask for its derivatives, and say that the step is complete."""
        numbers, rates = ((ctypes.c_double * len(states))(*values) for values in (states, [0.0] * len(states)))
        count, ends = ctypes.c_size_t(len(states)), (ctypes.c_int * 2)()
        self.c.fmi2SetTime(made, ctypes.c_double(t))
        self.c.fmi2SetContinuousStates(made, numbers, count)
        self.c.fmi2GetDerivatives(made, rates, count)
        return self.c.fmi2CompletedIntegratorStep(made, 1, ends, ctypes.byref(ends, 4))

    def step(self, made, t, h):
        return self.c.fmi2DoStep(made, ctypes.c_double(t), ctypes.c_double(h), 1)


@pytest.fixture
def instance(files, tmp_path):
    return Instance(tmp_path / "arm", files / "arm2.fmu")


def test_saved_state_and_two_instances(instance):
    """A run that goes on from a saved state, also in another instance, is the same bit for bit."""
    one, other = instance.begun(), instance.begun()
    assert instance.put(one, "hinge.drive_input", 800.0) == 0
    assert instance.step(one, 0.0, 0.2) == 0
    state, size = ctypes.c_void_p(), ctypes.c_size_t()
    assert instance.c.fmi2GetFMUstate(one, ctypes.byref(state)) == 0
    assert instance.step(one, 0.2, 0.3) == 0
    first = [instance.get(one, name) for name in ("hinge.angle", TIP, "energy.work")]
    assert instance.c.fmi2SetFMUstate(one, state) == 0
    assert instance.step(one, 0.2, 0.3) == 0
    assert [instance.get(one, name) for name in ("hinge.angle", TIP, "energy.work")] == first
    assert instance.c.fmi2SerializedFMUstateSize(one, state, ctypes.byref(size)) == 0
    saved = ctypes.create_string_buffer(size.value)
    assert instance.c.fmi2SerializeFMUstate(one, state, saved, size) == 0
    again = ctypes.c_void_p()
    assert instance.c.fmi2DeSerializeFMUstate(other, saved, size, ctypes.byref(again)) == 0
    assert instance.step(other, 0.0, 0.1) == 0
    assert instance.get(other, "hinge.angle") != first[0]
    assert instance.c.fmi2SetFMUstate(other, again) == 0
    assert instance.get(other, "hinge.drive_input") == 800.0
    assert instance.step(other, 0.2, 0.3) == 0
    assert [instance.get(other, name) for name in ("hinge.angle", TIP, "energy.work")] == first


def test_wrong_calls_are_errors_with_a_sentence(instance):
    made = instance.begun()
    assert instance.put(made, "gravity[2]", -1.0) == 3  # fmi2Error: a parameter, after the initialisation
    assert "cannot be set now" in instance.said[-1]
    assert instance.put(made, "hinge.drive_input", float("nan")) == 3
    assert "not finite" in instance.said[-1]
    assert instance.new("another") is None
    assert "token differs" in instance.said[-1]
    model = instance.folder / "resources" / "model.bin"
    model.write_bytes(model.read_bytes()[:-8])
    assert instance.new() is None
    assert "damaged" in instance.said[-1]


def test_bodies_that_deflect_far_are_refused(tmp_path):
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="beam", axis=(0, 1, 0))
    system = mp.System(bodies={"beam": large_cantilever(modes=1, stations=2)}, joints=(hinge,))
    with pytest.raises(mp.InputError, match="an FMU cannot carry body 'beam', which has stations"):
        write_fmu(system, tmp_path / "beam.fmu", t_end=1.0)


def test_what_an_fmu_cannot_carry_is_refused(tmp_path):
    brake = Callback(name="brake", function=lambda t, state: {})
    for options, said in (
        ({"system": replace(arm(), loads=(brake,))}, "'brake' is a Python function"),
        ({"events": (Event(name="down", when=lambda t, state: t, terminal=True),)}, "'down' is a Python function"),
        ({"events": (Event(name="off", when="pin.gap", terminal=True),)}, "asks for 'pin.gap'"),
        ({"fmi": "1"}, "version of FMI"),
        ({"kind": "all"}, "kind of FMU"),
        ({"platforms": ["amiga"]}, "platform"),
    ):
        system = options.pop("system", arm())
        with pytest.raises(InputError, match=said):
            write_fmu(system, tmp_path / "arm.fmu", t_end=1.0, **options)
    assert not list(tmp_path.iterdir())


def test_functions_of_time_end_the_run_of_an_fmu(tmp_path):
    """An FMU whose drive is known up to t_end says so where it is asked for more."""
    write_fmu(arm(drive="100*sin(t)"), tmp_path / "arm2.fmu", t_end=0.5)
    instance = Instance(tmp_path / "arm", tmp_path / "arm2.fmu")
    made = instance.begun()
    assert "hinge.drive_input" not in instance.references
    assert instance.step(made, 0.0, 0.5) == 0
    assert instance.step(made, 0.5, 0.1) == 3
    assert "written up to t = 0.5 s" in instance.said[-1]
