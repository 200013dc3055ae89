"""Values in other units are noticed, those of real structures are not."""

import re
from dataclasses import replace

import numpy as np
import pytest

import modalprep as mp
from modalprep.examples import beam_mesh, spinup_section
from modalprep.fe.properties.plausible import implausible_body, implausible_sections
from modalprep.pipeline.building.model import read_pipeline_mesh
from modalprep.pipeline.schema.load import load

STEEL = {"E": 2.1e11, "nu": 0.3, "rho": 7850.0}


def shell(thickness=2e-3, **changes):
    return {"skin": mp.Shell(material=mp.Material(**STEEL | changes), thickness=thickness)}


@pytest.mark.parametrize(
    ("section", "words"),
    [
        (shell(E=2.1e5), "modulus of 'skin'.*did you mean 2.1e.05 MPa?"),
        (shell(E=210.0), "modulus of 'skin'.*did you mean 210 GPa?"),
        (shell(E=2.1e17), "modulus of 'skin'.*give SI units"),
        (shell(rho=7.85), "density of 'skin'.*did you mean 7.85 g/cm.3?"),
        (shell(rho=7.85e-6), "density of 'skin'.*did you mean 7.85e-06 kg/mm.3?"),
        (shell(rho=7.85e6), "density of 'skin'.*give SI units, check length_unit and mass_unit"),
        (shell(thickness=2.0), "thickness of 'skin'.*did you mean 2 mm?"),
        (shell(thickness=2e-9), "thickness of 'skin'.*give SI units"),
        ({"bar": mp.Truss(material=mp.Material(**STEEL), A=100.0)}, "area of 'bar'.*did you mean 100 mm.2?"),
        ({"bar": mp.Solid(material=mp.Material(**STEEL | {"E": 2.1e5}))}, "modulus of 'bar'"),
    ],
)
def test_other_units_are_noticed(section, words):
    """On a mesh of 2 m, as without its unit of mm."""
    (note,) = implausible_sections(section, 2.0)
    assert re.search(words, note)


def test_real_materials_are_not_doubted():
    """Rubber, wood, a honeycomb core of 16 kg/m^3, diamond, osmium, a film of 5 um on 2 m, a gel, a rigid one."""
    core = mp.fe.Orthotropic(E1=1e6, E2=1e6, nu12=0.3, G12=1e6, G13=1e8, G23=6e7, rho=16.0)
    sections = {
        "a": shell(E=1.5e6, rho=1100.0)["skin"],
        "b": shell(E=1e10, rho=500.0)["skin"],
        "c": mp.Shell(plies=(mp.fe.Ply(material=core, thickness=0.02),)),
        "d": shell(E=1.2e12, rho=3500.0)["skin"],
        "f": shell(E=2e4, rho=1000.0)["skin"],
        "g": shell(E=5e13)["skin"],
        "e": shell(E=5.5e11, rho=22590.0, thickness=5e-6)["skin"],
    }
    assert implausible_sections(sections, 2.0) == []


def test_a_model_says_it_once_for_each_value():
    """Also without a pipeline file, and for the properties of a deck."""
    alloy = mp.Material(E=70e3, nu=0.3, rho=2700.0)
    mesh = beam_mesh(4).with_(properties={"beam": replace(spinup_section(), material=alloy)})
    model = mp.assemble(mesh, {}, {"root": mp.Interface(group="root", kind="node")})
    assert sum("the modulus of 'beam'" in note for note in model.notes) == 1


BODIES = [  # size (m), mass (kg), first frequency (Hz), m per unit of the file, what a note says
    (120.0, 9e4, 0.26, 1.0, "size .* did you mean length_unit = 'mm'"),  # a bracket of 120 mm in aluminium
    (2000.0, 6e10, 0.01, 1e3, "mass .* did you mean length_unit = 'm'"),  # 2 m, read as km
    (3e-4, 1e-6, 1e5, 1e-3, "size .* did you mean length_unit = 'm'"),  # 0.3 m in a file in m, read as mm
    (1e-7, 1e-9, 1e8, 1e-3, "check length_unit"),
    (1.0, 8.0, 1e-3, 1.0, "first frequency 0.001 Hz is implausible"),
    (1.0, 8.0, 1e6, 1.0, "first frequency 1e.06 Hz is implausible"),
]


@pytest.mark.parametrize(("size", "mass", "frequency", "scale", "words"), BODIES)
def test_bodies_of_another_unit(size, mass, frequency, scale, words):
    assert re.search(words, " ".join(implausible_body(size, mass, frequency, scale)))


@pytest.mark.parametrize(("size", "mass", "frequency"), [
    (0.12, 0.09, 260.0), (80.0, 2e4, 0.4), (2e-3, 1e-5, 5e4), (10.0, 12.0, 0.05), (1.0, 8.0, None),
])  # fmt: skip
def test_bodies_that_are_right(size, mass, frequency):
    """A bracket, a rotor blade of 80 m, a part of a watch, a thin boom, a rigid body."""
    assert implausible_body(size, mass, frequency, 1.0) == []


def test_shipped_pipelines_are_not_doubted(project):
    """No false alarm: the sections of every pipeline file with a mesh, by the size of the mesh."""
    for file in sorted((project / "pipelines").glob("*.toml")):
        source = load(file)
        pipeline = source.pipeline
        if pipeline.mesh is not None:
            mesh = read_pipeline_mesh(source)
            materials = {name: table.build() for name, table in pipeline.materials.items()}
            sections = {name: table.build(materials) for name, table in pipeline.properties.items()}
            size = float(np.ptp(mesh.points, axis=0).max())
            assert implausible_sections(mesh.properties | sections, size) == [], file.name
