"""One name for one thing: keys of pipeline files are the fields of the records that they fill."""

import dataclasses
import inspect

import pytest

import modalprep as mp
from modalprep.fe import Orthotropic, Ply, Recover, StressPoint, read_matrices
from modalprep.multibody import (
    AxialSpring,
    Bushing,
    CentralGravity,
    Closure,
    Conductor,
    Coupler,
    Deployment,
    Dipole,
    ExpelledGas,
    Orbit,
    RotationalSpring,
    Water,
    feedback,
)
from modalprep.pipeline.schema import (
    changing,
    environment,
    fe,
    force_elements,
    properties,
    reduction,
    system,
)
from modalprep.pipeline.schema.responses import response, strength
from modalprep.reduction import Load, Rayleigh

# Record or function, table, and what only one of them has: names come from the table's own key, functions of time and
# other files are read on the way.
PAIRS = {
    "material": (mp.Material, properties.MaterialTable, set(), set()),
    "lamina": (Orthotropic, properties.OrthotropicTable, set(), set()),
    "beam": (mp.Beam, properties.BeamTable, {"fibres", "bar"}, {"section"}),
    "truss": (mp.Truss, properties.TrussTable, set(), set()),
    "shell": (
        mp.Shell,
        properties.ShellTable,
        {"bending_material", "bending_ratio", "shear_material", "shear_ratio"},
        {"symmetric"},
    ),
    "ply": (Ply, properties.PlyTable, set(), set()),
    "mass": (mp.PointMass, properties.MassTable, set(), set()),
    "spring": (mp.Spring, properties.SpringTable, set(), set()),
    "interface": (mp.Interface, fe.InterfaceTable, set(), set()),
    "connection": (mp.Connection, fe.ConnectionTable, set(), set()),
    "stress": (StressPoint, fe.StressTable, set(), set()),
    "recovery": (Recover, fe.RecoveryTable, set(), set()),
    "matrices": (read_matrices, fe.MatricesTable, set(), set()),
    "load": (Load, reduction.LoadTable, set(), set()),
    "rayleigh": (Rayleigh, reduction.RayleighTable, set(), set()),
    "event": (mp.Event, changing.EventTable, set(), set()),
    "control": (feedback, environment.ControlTable, set(), {"force", "torque"}),
    "axial spring": (AxialSpring, force_elements.AxialSpringTable, set(), set()),
    "rotational spring": (RotationalSpring, force_elements.RotationalSpringTable, set(), set()),
    "bushing": (Bushing, force_elements.BushingTable, set(), set()),
    "closure": (Closure, system.ClosureTable, set(), set()),
    "coupler": (Coupler, system.CouplerTable, set(), set()),
    "planet": (CentralGravity, environment.CentralTable, set(), set()),
    "orbit": (Orbit, environment.OrbitTable, set(), {"altitude", "mu"}),
    "dipole": (Dipole, environment.DipoleTable, set(), set()),
    "conductor": (Conductor, force_elements.ConductorTable, set(), set()),
    "water": (Water, environment.WaterTable, set(), set()),
    "jet": (ExpelledGas, changing.JetTable, {"source"}, {"depletion"}),
    "deployment": (Deployment, changing.DeploymentTable, set(), set()),
}
DRIVEN = {"base", "forces"}  # where Python has inputs by name
for function, table, only_function, only_table in (
    (mp.response.harmonic_response, response.HarmonicTable, set(), {"lowest", "highest", "points", "spacing", "notch"}),
    (mp.response.sweep_response, response.SweepTable, set(), set()),
    (mp.response.random_response, response.RandomTable, {"band"}, {"lowest", "highest", "coherence", "notch"}),
    (mp.response.transient_response, response.TransientTable, set(), set()),
):
    PAIRS[function.__name__] = (function, table, {"body", "inputs"} | only_function, DRIVEN | only_table)
SOURCE = {"response", "channels"}
PAIRS |= {
    "shock spectrum": (
        mp.response.shock_spectrum, strength.ShockTable, {"time", "acceleration", "frequency"},
        SOURCE | {"lowest", "highest", "points"},
    ),
    "S-N curve": (
        mp.response.SNCurve, strength.FatigueTable, set(), SOURCE | {"scale", "repeats", "duration", "method"},
    ),
}  # fmt: skip
LABELS = {"name", "type", "kind"}


def names(record):
    if dataclasses.is_dataclass(record):
        return {field.name for field in dataclasses.fields(record)} - LABELS
    return set(inspect.signature(record).parameters) - LABELS


@pytest.mark.parametrize("pair", PAIRS)
def test_keys_are_fields(pair):
    record, table, only_record, only_table = PAIRS[pair]
    keys = set(table.model_fields) - LABELS
    assert names(record) - keys == only_record
    assert keys - names(record) == only_table


@pytest.mark.parametrize("theory", ["timoshenko", "euler-bernoulli"])
def test_theories_of_beams_have_one_name(theory):
    """As written in a file, so in Python."""
    steel = mp.Material(E=210e9, nu=0.3, rho=7800.0)
    assert mp.Beam(material=steel, A=1.0, Iy=1.0, Iz=1.0, J=1.0, theory=theory).theory == theory
    properties.BeamTable(type="beam", material="steel", A=1.0, Iy=1.0, Iz=1.0, J=1.0, theory=theory)


def test_another_theory_is_refused():
    steel = mp.Material(E=210e9, nu=0.3, rho=7800.0)
    with pytest.raises(mp.InputError, match="theory of a beam: 'euler' does not exist; known are timoshenko"):
        mp.Beam(material=steel, A=1.0, Iy=1.0, Iz=1.0, J=1.0, theory="euler")
