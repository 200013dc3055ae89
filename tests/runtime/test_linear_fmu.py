"""Linear equations as FMUs: against the exponential of the matrix, and their derivatives against the matrices."""

from zipfile import ZipFile

import numpy as np
import pytest
import scipy

import modalprep as mp
from modalprep.errors import InputError
from modalprep.examples import uniform_beam
from modalprep.multibody.model.joint_element import HingeElement
from modalprep.runtime.fmu import write_linear_fmu

pytest.importorskip("ziglang")
fmpy = pytest.importorskip("fmpy")
validation = pytest.importorskip("fmpy.validation")
slaves = pytest.importorskip("fmpy.fmi2")
END, STEP = 1.0, 0.05
STIFF = HingeElement(stiffness=2e3, damping=40.0)
HINGE = mp.Joint(name="hinge", type="revolute", parent="ground", child="arm", elements=STIFF)
ARM = mp.System(bodies={"arm": uniform_beam(modes=2)}, joints=(HINGE,))
EQUATIONS = mp.linearise(ARM, inputs=["hinge", "arm.tip.force.y"], outputs=["arm.tip.position.y", "hinge.angle"])
START = {"hinge.angle": 0.1, "arm.modal_rate.1": 0.2, "arm.tip.force.y": 3.0}


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("linear")
    for fmi in "23":
        own = {"fmi": fmi, "start": START, "t_end": END, "output_step": STEP}
        write_linear_fmu(EQUATIONS, folder / f"arm{fmi}.fmu", **own)
        assert validation.validate_fmu(str(folder / f"arm{fmi}.fmu")) == []
    return folder


@pytest.mark.parametrize("fmi", ["2", "3"])
@pytest.mark.parametrize(("kind", "tolerance"), [("CoSimulation", 1e-11), ("ModelExchange", 1e-5)])
def test_a_run_is_the_exponential(files, fmi, kind, tolerance):
    """A torque that jumps at half time, a force that is held: the exact solution in two parts."""
    n, ni = EQUATIONS.B.shape
    whole = np.zeros((n + ni, n + ni))
    whole[:n] = np.hstack([EQUATIONS.A, EQUATIONS.B])
    wanted = []
    z = np.array([START.get(name, 0.0) for name in (*EQUATIONS.states, *EQUATIONS.inputs)])
    for k in range(round(END / STEP) + 1):
        z[n] = 0.0 if k * STEP < 0.5 - 1e-9 else 50.0
        wanted.append([EQUATIONS.C[0] @ z[:n] + EQUATIONS.D[0] @ z[n:], z[0]])
        z = scipy.linalg.expm(whole * STEP) @ z
    rows = [(0.0, 0.0, 3.0), (0.5, 0.0, 3.0), (0.5, 50.0, 3.0), (END, 50.0, 3.0)]
    found = fmpy.simulate_fmu(
        str(files / f"arm{fmi}.fmu"),
        fmi_type=kind,
        stop_time=END,
        output_interval=STEP,
        relative_tolerance=1e-8,
        input=np.array(rows, dtype=[("time", float), ("hinge", float), ("arm.tip.force.y", float)]),
        output=["arm.tip.position.y", "hinge.angle"],
        record_events=False,
    )
    for column, name in enumerate(("arm.tip.position.y", "hinge.angle")):
        own = np.array(wanted)[:, column]
        np.testing.assert_allclose(found[name], own, atol=tolerance * np.abs(own).max())


def test_directional_derivatives_are_the_matrices(files, tmp_path):
    description = fmpy.read_model_description(files / "arm2.fmu")
    assert description.coSimulation.providesDirectionalDerivative
    with ZipFile(files / "arm2.fmu") as archive:
        archive.extractall(tmp_path)
    unit = slaves.FMU2Slave(
        guid=description.guid, unzipDirectory=str(tmp_path), modelIdentifier="arm2", instanceName="one"
    )
    unit.instantiate()
    reference = {each.name: each.valueReference for each in description.modelVariables}
    known = [reference[name] for name in (*EQUATIONS.states, *EQUATIONS.inputs)]
    unknown = [reference[f"der({name})"] for name in EQUATIONS.states]
    unknown += [reference[name] for name in EQUATIONS.outputs]
    wanted = np.block([[EQUATIONS.A, EQUATIONS.B], [EQUATIONS.C, EQUATIONS.D]])
    rows = np.array([unit.getDirectionalDerivative(unknown, [one], [1.0]) for one in known]).T
    np.testing.assert_array_equal(rows, wanted)
    seed = np.arange(1.0, len(known) + 1)
    np.testing.assert_allclose(unit.getDirectionalDerivative(unknown, known, list(seed)), wanted @ seed, rtol=1e-12)
    unit.freeInstance()


def test_names_that_stand_twice_are_refused(tmp_path):
    twice = mp.linearise(ARM, inputs=["hinge"], outputs=["arm.tip.velocity.y"] * 2)
    with pytest.raises(InputError, match="two variables 'arm.tip.velocity.y'"):
        write_linear_fmu(twice, tmp_path / "arm.fmu", t_end=END)
