"""Numbers with units in pipeline files; factors by the definitions of the units (BIPM, NIST SP 811)."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from modalprep.pipeline.schema.analysis import EnsembleTable
from modalprep.pipeline.schema.base import first_message
from modalprep.pipeline.schema.pipeline import Pipeline
from modalprep.pipeline.schema.quantities import UNITS, in_si

MESH = {"file": "a.msh", "length_unit": "mm"}

VALUES = [  # text, unit of the key, number
    ("210 GPa", "Pa", 2.1e11), ("30e6 psi", "Pa", 30e6 * 6894.757293168361), ("7850 kg/m^3", "kg/m^3", 7850.0),
    ("7.85 g/cm3", "kg/m^3", 7850.0), ("7.85e-9 t/mm^3", "kg/m^3", 7850.0), ("2 mm", "m", 0.002), ("1 in", "m", 0.0254),
    ("10 deg", "rad", math.pi / 18), ("0.5 rev", "rad", math.pi), ("60 rpm", "rad/s", 2 * math.pi), ("60 rpm", "Hz",
    1.0),
    ("5 Hz", "rad/s", 10 * math.pi), ("2 kHz", "Hz", 2000.0), ("40 N m/rad", "N m/rad", 40.0), ("40 N m", "N m/rad",
    40.0),
    ("1 N m/deg", "N m/rad", 180 / math.pi), ("50 N/mm", "N/m", 5e4), ("1 lbf", "N", 4.4482216152605), ("3 kN*m",
    "N m", 3e3),
    ("36 km/h", "m/s", 10.0), ("9.81 m/s**2", "m/s^2", 9.81), ("4 kg·mm^2", "kg m^2", 4e-6), ("0.1 1/s", "1/s", 0.1),
    ("2e4 nT", "T", 2e-5), ("1 day", "s", 86400.0), ("-3. mm", "m", -0.003), (".5mm", "m", 0.0005), ("3 N m^-1",
    "N/m", 3.0),
    ("1 slinch", "kg", 175.12683524647636), ("1 slug", "kg", 14.593902937206364),
]  # fmt: skip


@pytest.mark.parametrize(("text", "unit", "expected"), VALUES)
def test_factors(text, unit, expected):
    assert in_si(text, (unit,)) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize(
    "text", ["2*t", "1/t", "sin(t)", "5", "mm", "", "2 furlong", "1 2 mm", "2 mm^x", "3 m//s", "1" * 99]
)
def test_what_is_no_quantity(text):
    assert in_si(text, ("m",)) is None


@pytest.mark.parametrize(
    ("text", "unit"), [("2 kg", "m"), ("5 mm", "N m"), ("3 1/s", "Hz"), ("3 deg", "m"), ("1 N", "N/m")]
)
def test_another_dimension_is_refused(text, unit):
    with pytest.raises(ValueError, match="has another dimension than"):
        in_si(text, (unit,))


@given(st.text(max_size=100))
def test_any_text_is_a_number_or_none(text):
    try:
        assert in_si(text, ("m",)) is None or isinstance(in_si(text, ("m",)), float)
    except ValueError as error:
        assert "has another dimension than" in str(error)  # noqa: PT017


def test_a_pipeline_of_quantities():
    """The file with units means what that in SI means; coordinates are in millimetres, as the mesh is."""
    text = Pipeline.model_validate({
        "mesh": MESH,
        "materials": {"steel": {"E": "210 GPa", "nu": 0.3, "rho": "7.85 g/cm^3"}},
        "properties": {
            "rib": {"type": "beam", "material": "steel", "section": {"shape": "rod", "diameter": "2 cm"},
                    "offset": ["1 mm", 0.0], "nsm": "2 g/mm"},
            "skin": {"type": "shell", "plies": [{"material": "steel", "thickness": "1 mm", "angle": "45 deg"}]},
            "wheel": {"type": "mass", "mass": "500 g", "inertia": ["1 kg mm^2"] * 3 + [0, 0, 0]},
            "bolt": {"type": "spring", "translation": ["1 kN/mm", 0, 0], "rotation": ["2 N m/rad", 0, 0]},
        },
        "interfaces": {"root": {"near": ["1 cm", 0, 5]},
                       "hole": {"cylinder": {"point": ["1 in", 0, 0], "axis": [0, 0, 1], "radius": "4.5 mm"}}},
        "bodies": {"arm": {"mass": "2 t", "centre": ["5 cm", 0, 0], "interfaces": {"root": ["1 mm", 0, 0]}}},
        "joints": {"hinge": {"type": "revolute", "child": "arm.root", "stiffness": "3 N m/deg", "torque": "2 kN m",
                             "limits": {"lower": "-10 deg", "stiffness": "1 kN m/rad"}, "start": {"rate": "60 rpm"}}},
        "forces": {"push": {"at": "arm.root", "force": ["1 kN", "3*t", 0]}},
        "environment": {"gravity": [0, 0, "-981 cm/s^2"]},
        "simulation": {"t_end": "2 min", "output_step": "10 ms"},
    })  # fmt: skip
    values = [
        text.materials["steel"].E, text.materials["steel"].rho, text.properties["rib"].section.diameter,
        text.properties["rib"].offset[0], text.properties["rib"].nsm, text.properties["skin"].plies[0].thickness,
        text.properties["wheel"].mass, text.properties["wheel"].inertia[0], text.properties["bolt"].translation[0],
        text.interfaces["root"].near[0], text.interfaces["root"].near[2], text.interfaces["hole"].cylinder.point[0],
        text.interfaces["hole"].cylinder.radius, text.bodies["arm"].mass, text.bodies["arm"].centre[0],
        text.joints["hinge"].stiffness, text.joints["hinge"].torque, text.joints["hinge"].limits.lower,
        text.joints["hinge"].start.rate, text.forces["push"].force[0], text.environment.gravity[2],
        text.simulation.t_end,
    ]  # fmt: skip
    expected = [
        2.1e11, 7850.0, 0.02, 0.001, 2.0, 0.001, 0.5, 1e-6, 1e6, 10.0, 5.0, 25.4, 4.5, 2000.0, 0.05, 540 / math.pi,
        2000.0,
        -math.pi / 18, 2 * math.pi, 1000.0, -9.81, 120.0,
    ]  # fmt: skip
    assert values == pytest.approx(expected, rel=1e-14)
    assert text.forces["push"].force[1] == "3*t"


@pytest.mark.parametrize(("change", "message"), [
    ({"simulation": {"t_end": "2 m"}}, "'2 m' has another dimension than s; write for example '20 ms' or 0.02"),
    ({"simulation": {"t_end": "soon"}}, "'soon' is no number with a unit of s"),
    ({"simulation": {"t_end": "-2 s"}}, "Input should be greater than 0"),
    ({"interfaces": {"a": {"near": ["2 kg", 0, 0]}}}, "near: '2 kg' has another dimension than m"),
    ({"joints": {"a": {"type": "revolute", "child": "b.root", "torque": "2 mm"}}},
    "'2 mm' has another dimension than N m"),
])  # fmt: skip
def test_a_sentence_for_each_wrong_text(change, message):
    with pytest.raises(ValidationError) as error:
        Pipeline.model_validate({"mesh": MESH, **change})
    assert message in first_message(error.value)


def test_the_reference_names_every_unit(project):
    text = (project / "docs" / "reference" / "pipeline-files.md").read_text()
    listed = text.split("Units are products of")[1].split("divided by")[0]
    named = set(
        listed.replace(";", ",").replace("\n", " ").replace(" and parts of them", "").replace(" ", "").split(",")
    )
    assert set(UNITS) - named == {"lb", "mA", "kA", "mT", "uT", "nT"}


def test_parameters_of_ensembles():
    """The name of a parameter says which units it has."""
    parameters = {"hinge.angle": {"normal": ["0 deg", "18 deg"]}, "stay.stiffness": ["1 N/mm", 5.0],
                  "gravity.y": ["-981 cm/s^2", 0]}  # fmt: skip
    table = EnsembleTable(parameters=parameters, channels=["hinge.angle"])
    assert table.parameters["hinge.angle"].normal == pytest.approx([0.0, math.pi / 10])
    assert table.parameters["stay.stiffness"] == [1000.0, 5.0]
    assert table.parameters["gravity.y"] == pytest.approx([-9.81, 0.0])
    for name, text, message in (
        ("hinge.angle", "2 mm", "'2 mm' has another dimension than rad"),
        ("hinge.angle", "much", "'much' is not a number with a unit of rad"),
        ("push.amplitude", "2 N", "'2 N' is not a number without a unit; write the number in SI units"),
    ):
        with pytest.raises(ValidationError, match=message):
            EnsembleTable(parameters={name: [text]}, channels=["hinge.angle"])
