"""Bodies of the shipped bracket, panel and satellite by weak forms and by compiled loops, and what they do in a run."""

import dataclasses
import re

import numpy as np
import pytest
from size import FULL

import modalprep as mp
from modalprep.pipeline.building.build import build_body
from modalprep.pipeline.console import Reporter

# Of the largest number: K agrees to 1e-15 of its own, which stretches; what bends is 1e6 times softer. The panels of
# the satellite are alike: round-off mixes modes whose frequencies nearly agree (2.2e-8 in H).
SAME = {"bracket": 1e-8, "panel": 1e-8, "satellite": 1e-7}
RUN = 1e-6  # steps are chosen for 1e-8, of which small deflections have less
AXIS = {"bracket": (0, 0, 1), "panel": (0, 1, 0), "satellite": (1, 0, 0)}  # of the hinge at the root, across gravity
GRAVITY = {"bracket": (0, -9.81, 0), "panel": (0, 0, -9.81), "satellite": (0, -9.81, 0)}


COARSE = {  # shape, its parameters, and what the file says otherwise
    "bracket": (  # a block of 100 tetrahedra
        "box",
        {"length": 0.08, "width": 0.024, "height": 0.008, "size": 0.012},
        {
            "[properties.body]": "[properties.box]",
            'length_unit = "mm"': "",
            "near = [16, 12, 0]": "near = [0.03, 0.012, 0.004]",
            'group = "bolt_a"': 'group = "root"',
            'group = "bolt_b"': 'group = "tip"',
        },
    ),
    "panel": (
        "stiffened-panel",
        {"length": 1.2, "width": 0.8, "stiffeners": 4, "size": 0.2},
        {"[[1.1, -0.4, 0]": "[[0.9, -0.4, 0]"},  # two rows of elements
    ),
}


@pytest.fixture(scope="module", params=["bracket", "panel", pytest.param("satellite", marks=pytest.mark.slow)])
def bodies(request, project, tmp_path_factory):
    """Name and both bodies; of the shipped meshes and all modes at the full size."""
    name = request.param
    if name == "satellite" and not FULL:
        pytest.skip("minutes: its smallest mesh is the shipped one")
    folder = tmp_path_factory.mktemp(name)
    text = (project / "pipelines" / f"{name}.toml").read_text().replace("../meshes", str(project / "meshes"))
    if not FULL:
        shape, parameters, changes = COARSE[name]
        mp.make_mesh(shape, folder / "coarse.msh", **parameters)
        text = re.sub(r'file = ".*msh"', f'file = "{folder}/coarse.msh"', text)
        text = re.sub(r"^modes = \d+", "modes = 6", text, flags=re.MULTILINE)
        for before, after in changes.items():
            text = text.replace(before, after)
    made = []
    for forms in ("compiled", "plain"):
        file = folder / forms / f"{name}.toml"
        file.parent.mkdir()
        file.write_text(text.replace("[mesh]\n", f'[mesh]\nforms = "{forms}"\n'))
        made.append(build_body(file, file.parent, Reporter(quiet=True)).body)
    return name, *made


def arrays(record, path=""):
    """Yield every array of floats in a record with its name."""
    for field in dataclasses.fields(record):
        value = getattr(record, field.name)
        if dataclasses.is_dataclass(value):
            yield from arrays(value, f"{path}{field.name}.")
        elif isinstance(value, np.ndarray) and value.dtype.kind == "f" and np.nansum(np.abs(value)) > 0:
            yield path + field.name, value


@pytest.mark.filterwarnings("ignore::modalprep.ModalprepWarning")
def test_bodies(bodies):
    """Reduction, integrals of the mass, geometric stiffness, recovered shapes."""
    case, wanted, found = bodies
    own = dict(arrays(found))
    for name, value in arrays(wanted):
        np.testing.assert_allclose(own[name], value, rtol=0, atol=SAME[case] * np.nanmax(np.abs(value)), err_msg=name)
    assert {"frequency", "P", "Kg_A", "Kg_W", "Kg_F", "phi", "shape"} <= set(own)


@pytest.mark.filterwarnings("ignore::modalprep.ModalprepWarning")
def test_runs(bodies):
    """A pendulum of the body: hinge, deflections, forces."""
    name, *both = bodies
    runs = []
    for body in both:
        root = f"it.{body.interface_name[0]}"
        hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child=root, axis=np.array(AXIS[name], float))
        system = mp.System(bodies={"it": body}, joints=(hinge,), gravity=np.array(GRAVITY[name]))
        runs.append(mp.simulate(system, t_end=0.02, output_step=0.001, rtol=1e-8))
    wanted, found = runs
    tip = f"it.{both[0].interface_name[-1]}"
    for channel in ("hinge.angle", f"{tip}.position", f"{tip}.deflection", "energy.kinetic", "energy.strain"):
        scale = np.abs(wanted[channel]).max()
        np.testing.assert_allclose(found[channel], wanted[channel], rtol=0, atol=RUN * scale, err_msg=channel)
    assert np.abs(wanted["hinge.angle"]).max() > 1e-4
