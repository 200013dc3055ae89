"""Directional derivatives of FMUs: against linearise, whose equations are built in Python, and against differences."""

import ctypes

import numpy as np
import pytest
from compare import assert_close
from multibody.trees import with_dampers

import modalprep as mp
from modalprep.body.rigid import rigid_body
from modalprep.examples import small_systems, uniform_beam
from modalprep.multibody.model.joint_element import HingeElement
from modalprep.multibody.model.loads import AxialSpring, PointForce
from modalprep.runtime.fmu import write_fmu
from modalprep.runtime.model import model_of

pytest.importorskip("ziglang")
fmpy = pytest.importorskip("fmpy")
slaves = pytest.importorskip("fmpy.fmi2")
slaves3 = pytest.importorskip("fmpy.fmi3")
BEAM = with_dampers(uniform_beam(modes=2))
GRAVITY = np.array([1.0, -9.81, 2.0])
ENDS = {"root": np.zeros(3), "tip": np.array([1.0, 0.3, 0.2])}
HUB = rigid_body("hub", mass=50.0, centre=ENDS["tip"] / 2, inertia=np.diag([10.0, 20.0, 25.0]), interfaces=ENDS)


def craft(free):
    """A beam on a hinge with spring, damper and motor, on a hub that is free or on the ground; forces on its tip."""
    motor = HingeElement(stiffness=300.0, damping=40.0, drive=10.0)
    hinge = mp.Joint(name="hinge", type="revolute", parent="hub.tip" if free else "ground", child="arm", elements=motor)
    loads = [PointForce(name="push", at="arm.tip", force=(30.0, -400.0, 70.0), torque=(10.0, 20.0, 30.0))]
    loads += [PointForce(name="thrust", at="arm.tip", force=(3.0, -44.0, 7.0), torque=(1.0, 2.0, 3.0), axes="body")]
    if not free:
        return mp.System(bodies={"arm": BEAM}, joints=(hinge,), gravity=GRAVITY, loads=loads)
    joints = [mp.Joint(name="base", type="free", parent="ground", child="hub"), hinge]
    joints += [mp.Joint(name="ball", type="spherical", parent="arm.tip", child="end")]
    return mp.System(bodies={"hub": HUB, "arm": BEAM, "end": HUB}, joints=joints, gravity=GRAVITY, loads=loads)


class Opened:
    """An FMU for model exchange in the state at which its derivatives are asked for."""

    def __init__(self, system, folder, fmi):
        write_fmu(system, folder / "craft.fmu", t_end=1.0, fmi=fmi)
        about = fmpy.read_model_description(folder / "craft.fmu")
        own = {"guid": about.guid, "modelIdentifier": "craft", "instanceName": "one"}
        own["unzipDirectory"] = fmpy.extract(folder / "craft.fmu", folder / "unpacked")
        self.unit = slaves.FMU2Model(**own) if fmi == "2" else slaves3.FMU3Model(**own)
        self.unit.instantiate()
        if fmi == "2":
            self.unit.setupExperiment()
        self.unit.enterInitializationMode()
        self.unit.exitInitializationMode()
        self.unit.enterContinuousTimeMode()
        self.fmi, self.about = fmi, about
        self.references = {each.name: each.valueReference for each in about.modelVariables}
        rates = [each for each in about.modelVariables if each.derivative is not None]
        self.rates = [each.name for each in rates]
        self.states = [each.derivative.name for each in rates]
        self.inputs = [each.name for each in about.modelVariables if each.causality == "input"]

    def of(self, names):
        return [self.references[name] for name in names]

    def get(self, names):
        read = self.unit.getReal if self.fmi == "2" else self.unit.getFloat64
        return np.array(read(self.of(names)))

    def put(self, state, inputs):
        self.unit.setContinuousStates((ctypes.c_double * len(state))(*state), len(state))
        (self.unit.setReal if self.fmi == "2" else self.unit.setFloat64)(self.of(self.inputs), list(inputs))

    def along(self, unknown, known, seed):
        given = self.of(unknown), self.of(known), list(seed)
        return np.array(self.unit.getDirectionalDerivative(*given))

    def matrix(self, unknown, known):
        return np.array([self.along(unknown, [name], [1.0]) for name in known]).T


@pytest.fixture(scope="module")
def unit(tmp_path_factory):
    return Opened(craft(free=True), tmp_path_factory.mktemp("craft"), "2")


def test_rates_and_outputs_change_as_differences_say(unit):
    """A free body, a ball joint, forces that turn with a deflected tip and forces that do not, all inputs."""
    rng = np.random.default_rng(3)
    state, inputs = unit.get(unit.states), unit.get(unit.inputs)
    state[:-1] += 0.05 * rng.normal(size=len(state) - 1)
    unit.put(state, inputs)
    known = unit.states + unit.inputs
    outputs = ["arm.tip.position[2]", "hinge.reaction_torque[3]", "energy.kinetic"]
    outputs = [each for each in unit.references if each.startswith("hinge.") and "[" in each][:3] + outputs[::2]
    unknown = unit.rates + outputs
    found = unit.matrix(unknown, known)
    assert_close(unit.get(unit.states), state, 0.0)  # asking changes nothing

    def difference(k, step):
        ends = []
        for sign in (1, -1):
            moved = np.concatenate([state, inputs])
            moved[k] += sign * step
            unit.put(*np.split(moved, [len(state)]))
            ends.append(unit.get(unknown))
        unit.put(state, inputs)
        return (ends[0] - ends[1]) / (2 * step)

    for k in range(len(known)):
        step = 2e-3 if k < len(state) else 10.0
        own = (4 * difference(k, step / 2) - difference(k, step)) / 3
        # errors of the differences: step^4 and round-off over the step
        np.testing.assert_allclose(found[:, k], own, atol=1e-8 * np.abs(own).max(), err_msg=known[k])
    seed = rng.normal(size=len(known))
    whole = unit.along(unknown, known, seed)
    exact = len(unit.rates) - 1  # the rate of the work is a difference
    assert_close(whole[:exact], found[:exact] @ seed, 1e-12)


def test_they_are_the_matrices_of_linearise(tmp_path):
    """Of the rates to round-off: twice the exact derivative, once compiled. Outputs are differences of order six."""
    system = craft(free=False)
    unit = Opened(system, tmp_path, "3")
    text = (tmp_path / "unpacked" / "modelDescription.xml").read_text()  # FMPy looks for the attribute of FMI 2
    assert text.count('providesDirectionalDerivatives="true"') == text.count('providesAdjointDerivatives="true"') == 2
    linear = mp.linearise(system, inputs=["hinge", "arm.tip.force.y"], outputs=["arm.tip.position.y"])
    names = [unit.states[k] for k in range(len(unit.states) - 1)]
    known = [*names, "hinge.drive_input", "push.force[2]"]
    rates = [f"der({name})" for name in names]
    found = unit.matrix(rates, known)
    np.testing.assert_allclose(found, np.hstack([linear.A, linear.B]), atol=1e-11 * np.abs(linear.A).max())
    (output,) = unit.matrix(["arm.tip.position[2]"], known)
    assert_close(output, np.hstack([linear.C, linear.D])[0], 1e-9)
    rng = np.random.default_rng(0)
    seed = rng.normal(size=len(rates))
    back = unit.unit.getAdjointDerivative(unit.of(rates), unit.of(known), list(seed), len(known))
    assert_close(np.array(back), seed @ found, 1e-12)


def test_other_variables_are_refused(unit):
    with pytest.raises(Exception, match="fmi2GetDirectionalDerivative"):
        unit.along(unit.rates[:1], ["gravity[2]"], [1.0])


def test_what_has_none_says_so():
    """Exact derivatives are compiled for trees with point forces and elements of joints."""
    spring = AxialSpring(name="wire", between=("ground", "rod.tip"), stiffness=10.0)
    rod = small_systems()["rigid bodies in trees"]
    system = mp.System(bodies=rod.bodies, joints=rod.joints, loads=(spring,))
    model = model_of(system, t_end=1.0)
    assert not model.differentiable
    assert any("no directional derivatives, because of element 'wire'" in note for note in model.notes)
    assert model_of(rod, t_end=1.0).differentiable
