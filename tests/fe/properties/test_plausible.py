"""Values in other units are noticed, those of real structures are not."""

from dataclasses import replace

import pytest

import modalprep as mp
from modalprep.examples import beam_mesh, spinup_section
from modalprep.fe.properties.plausible import implausible_sections

STEEL = {"E": 2.1e11, "nu": 0.3, "rho": 7850.0}


def shell(thickness=2e-3, **changes):
    return {"skin": mp.Shell(material=mp.Material(**STEEL | changes), thickness=thickness)}


@pytest.mark.parametrize(
    ("section", "words"),
    [
        (shell(E=2.1e5), "modulus of 'skin'"),  # MPa
        (shell(E=2.1e17), "modulus of 'skin'"),
        (shell(rho=7.85), "density of 'skin'"),  # g/cm^3
        (shell(rho=7.85e6), "density of 'skin'"),
        (shell(thickness=2.0), "thickness of 'skin'"),  # mm
        (shell(thickness=2e-9), "thickness of 'skin'"),
        ({"bar": mp.Truss(material=mp.Material(**STEEL), A=100.0)}, "area of 'bar'"),  # mm^2
        ({"bar": mp.Solid(material=mp.Material(**STEEL | {"E": 2.1e5}))}, "modulus of 'bar'"),
    ],
)
def test_other_units_are_noticed(section, words):
    """On a mesh of 2 m, as without its unit of mm."""
    (note,) = implausible_sections(section, 2.0)
    assert words in note


def test_real_materials_are_not_doubted():
    """Rubber, wood, a honeycomb core of 16 kg/m^3, diamond, osmium, a film of 5 um on 2 m."""
    core = mp.fe.Orthotropic(E1=1e6, E2=1e6, nu12=0.3, G12=1e6, G13=1e8, G23=6e7, rho=16.0)
    sections = {
        "a": shell(E=1.5e6, rho=1100.0)["skin"],
        "b": shell(E=1e10, rho=500.0)["skin"],
        "c": mp.Shell(plies=(mp.fe.Ply(material=core, thickness=0.02),)),
        "d": shell(E=1.2e12, rho=3500.0)["skin"],
        "e": shell(E=5.5e11, rho=22590.0, thickness=5e-6)["skin"],
    }
    assert implausible_sections(sections, 2.0) == []


def test_a_model_says_it_once_for_each_value():
    """Also without a pipeline file, and for the properties of a deck."""
    alloy = mp.Material(E=70e3, nu=0.3, rho=2700.0)
    mesh = beam_mesh(4).with_(properties={"beam": replace(spinup_section(), material=alloy)})
    model = mp.assemble(mesh, {}, {"root": mp.Interface(group="root", kind="node")})
    assert sum("the modulus of 'beam'" in note for note in model.notes) == 1
