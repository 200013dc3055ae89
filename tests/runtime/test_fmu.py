"""FMUs in a process without modalprep, run by FMPy with its own integrator (CVode) or by the kernels inside."""

import ctypes
import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pytest

import modalprep as mp
from modalprep.errors import InputError
from modalprep.examples import uniform_beam
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
pytest.importorskip("fmpy")
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
        for kind in KINDS
    ]


# Tolerances: simulate is run ten times as exactly at least; both integrators control the error of a step, of which a
# run has hundreds. CVode's is that of states alone, so accelerations and forces of stiff modes are not compared.
@pytest.mark.parametrize(
    ("name", "outputs", "stop", "tolerance"),
    [
        ("spinup-beam", ["hub.rate", "beam.tip.deflection[2]", "energy.work"], 4.0, 2e-5),
        ("slider-crank", ["rod.modal[1]", "slide.displacement", "energy.work"], 0.06, 2e-5),
    ],
)
def test_shipped_systems_run_without_modalprep(name, outputs, stop, tolerance, project, tmp_path):
    source = load(project / "pipelines" / f"{name}.toml")
    quiet = Reporter(quiet=True)
    step = source.pipeline.simulation.output_step
    for fmi in ("2", "3"):
        fmu_of_pipeline(source, tmp_path, quiet, target=tmp_path / f"{name}{fmi}.fmu", fmi=fmi)
    jobs = jobs_of(tmp_path, name, outputs, stop, step, {"cs": 1e-7, "me": 1e-7})
    found, problems = imported(jobs, tmp_path)
    assert not any(problems.values())
    run = mp.simulate(read_system(source, tmp_path, quiet), t_end=stop, output_step=step, rtol=1e-9)
    for job, history in found.items():
        assert apart(history, run, outputs) < tolerance, job
    np.testing.assert_array_equal(found["cs2"], found["cs3"])


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

    def new(self, token=None):
        where = f"{(self.folder / 'resources').as_uri()}".encode()
        return self.c.fmi2Instantiate(b"one", 1, (token or self.token).encode(), where, self.callbacks, 0, 0)

    def begun(self):
        made = ctypes.c_void_p(self.new())
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

    def get(self, made, name):
        value = (ctypes.c_double * 1)()
        assert self.c.fmi2GetReal(made, (ctypes.c_uint * 1)(self.references[name]), ctypes.c_size_t(1), value) == 0
        return value[0]

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


def test_what_an_fmu_cannot_carry_is_refused(tmp_path):
    brake = Callback(name="brake", function=lambda t, state: {})
    for options, said in (
        ({"system": replace(arm(), loads=(brake,))}, "'brake' is a Python function"),
        ({"events": (Event(name="down", when="hinge.angle", terminal=True),)}, "'down', which ends the run"),
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
