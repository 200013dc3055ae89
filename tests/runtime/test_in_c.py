"""The example in C: the spin-up by a fixed step, alike in C and in Python, and how many evaluations a step takes."""

import subprocess
import sys
import xml.etree.ElementTree as ET
from dataclasses import replace
from zipfile import ZipFile

import numpy as np
import pytest
from compare import assert_close

import modalprep as mp
from modalprep.examples import uniform_beam
from modalprep.multibody.model.joint_element import HingeElement
from modalprep.runtime.fmu import write_fmu

STEP, END = 0.01, 20.0
LAW = mp.multibody.TimeFunction([(15.0, "0.4*(t**2/2 + (7.5/pi)**2*(cos(pi*t/7.5) - 1))"), (float("inf"), "6*t - 45")])
FIXED = {"step": STEP, "method": "rosenbrock"}


@pytest.fixture(scope="module")
def spin_up():
    hub = mp.Joint(name="hub", type="revolute", parent="ground", child="beam", motion=LAW)
    return mp.System(bodies={"beam": uniform_beam(modes=6)}, joints=(hub,))


@pytest.mark.skipif(sys.platform != "linux", reason="loads a Linux library")
def test_twenty_seconds_of_spin_up(spin_up, project, tmp_path):
    """The fixed grid of steps is that of Python: both have the same numbers, and the lag of the published curve."""
    pytest.importorskip("ziglang")
    program = tmp_path / "spin_up"
    source = project / "docs" / "how-to" / "spin_up.c"
    subprocess.run([sys.executable, "-m", "ziglang", "cc", "-O1", "-o", program, source, "-ldl", "-lm"], check=True)
    write_fmu(spin_up, tmp_path / "beam.fmu", kind="cs", t_end=END, **FIXED)
    with ZipFile(tmp_path / "beam.fmu") as archive:
        archive.extractall(tmp_path / "fmu")
    about = ET.parse(tmp_path / "fmu" / "modelDescription.xml").getroot()
    output = next(v for v in about.iter("ScalarVariable") if v.get("name") == "beam.tip.deflection[2]")
    (library,) = (tmp_path / "fmu" / "binaries").rglob("*.so")
    own = [library, about.get("guid"), (tmp_path / "fmu" / "resources").as_uri(), output.get("valueReference")]
    ran = subprocess.run([program, *own, str(STEP), str(END)], capture_output=True, text=True, check=True)
    found = np.array([line.split() for line in ran.stdout.splitlines()], dtype=float)
    run = mp.simulate(spin_up, END, output_step=1.0, **FIXED)
    assert_close(found[:, 0], run.time[1:], 1e-12)
    lag = run["beam.tip.deflection.y"][1:]
    assert_close(found[:, 1], lag, 1e-9)
    assert lag[6] == pytest.approx(-0.574, abs=0.005)  # at 7 s; the curve has its largest, -0.5738 m, at 6.8 s
    assert f"{round(END / STEP)} steps in " in ran.stderr


@pytest.mark.parametrize("angle", [0.0, 2.0])
def test_a_fixed_step_takes_the_same_number_of_evaluations_everywhere(spin_up, angle):
    """Four stages, and one at the end that begins the next step: no iteration, and no step that is rejected."""
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="beam", angle=angle)
    pendulum = mp.System(bodies=spin_up.bodies, joints=(hinge,), gravity=np.array([0, -9.81, 0]))
    for system in (spin_up, pendulum):
        stats = mp.simulate(system, 1.0, output_step=0.5, **FIXED).stats
        assert stats["rejected"] == stats["halved"] == 0
        assert stats["evaluations"] <= 5 * stats["steps"] + 5


@pytest.mark.skipif(sys.platform != "linux", reason="loads a Linux library")
def test_the_s_function_steps_as_the_fmu_does(spin_up, project, tmp_path):
    """Called as by Simulink, with stand-ins of its functions; an input that is held, against `simulate`."""
    pytest.importorskip("ziglang")
    program, stand_in = tmp_path / "s_function", project / "tests" / "runtime" / "simulink"
    source = project / "docs" / "how-to" / "s_function.c"
    options = ["-Wall", "-Wno-unused-function", "-Werror", "-DMATLAB_MEX_FILE", f"-I{stand_in}", "-ldl"]
    subprocess.run([sys.executable, "-m", "ziglang", "cc", "-o", program, source, *options], check=True)
    motor = HingeElement(damping=40.0, drive=0.0)
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="beam", elements=motor)
    system = mp.System(bodies=spin_up.bodies, joints=(hinge,))
    model = write_fmu(system, tmp_path / "beam.fmu", kind="cs", t_end=1.0, **FIXED)
    with ZipFile(tmp_path / "beam.fmu") as archive:
        archive.extractall(tmp_path / "fmu")
    references = {each.name: each.reference for each in model.variables}
    (library,) = (tmp_path / "fmu" / "binaries").rglob("*.so")
    own = [library, model.token, (tmp_path / "fmu" / "resources").as_uri()]
    own += [references["hinge.drive_input"], references["beam.tip.deflection[2]"], STEP, 50, 300.0]
    ran = subprocess.run([program, *map(str, own)], capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    driven = mp.System(bodies=spin_up.bodies, joints=(replace(hinge, elements=replace(motor, drive=300.0)),))
    run = mp.simulate(driven, 0.5, output_step=0.5, **FIXED)
    assert abs(float(ran.stdout) / run["beam.tip.deflection.y"][-1] - 1) < 1e-9
    own[1] = "another"
    ran = subprocess.run([program, *map(str, own)], capture_output=True, text=True)
    assert "cannot be initialised" in ran.stderr
