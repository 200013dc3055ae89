"""CAD files that gmsh's own kernel writes: a plate with two holes and a rounded corner, against its closed forms."""

import re
import signal
import subprocess
import sys

import numpy as np
import pytest
from fe.cad_parts import VOLUME, draw, plate
from fe.generated import needs_gmsh

import modalprep as mp
from modalprep.cli import main
from modalprep.errors import InputError
from modalprep.fe.mesh.select import NodeSet

pytestmark = needs_gmsh
PIPELINE = """
[mesh]
file = "plate{suffix}"
length_unit = "mm"
size = {size}

[materials.steel]
E = 210e9
nu = 0.3
rho = 7850.0

[properties.body]
type = "solid"
material = "steel"

[interfaces.small]
cylinder = {{ point = [15, 20, 0], axis = [0, 0, 1], radius = 4 }}

[interfaces.large]
cylinder = {{ point = [65, 20, 0], axis = [0, 0, 1], radius = 6 }}

[reduction]
modes = 4

[output]
pictures = "none"
"""


@pytest.fixture(scope="module")
def parts(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cad")
    draw(folder, plate, "plate")
    return folder


def mass(mesh, *groups):
    steel = mp.Solid(material=mp.Material(E=210e9, nu=0.3, rho=7850.0))
    base = {"base": mp.Interface(plane=((0, 0, 0), (0, 0, 1)))}
    return mp.assemble(mesh, dict.fromkeys(groups, steel), base).rigid.m


def two_cubes_that_touch(occ):
    occ.addBox(0, 0, 0, 1, 1, 1)
    occ.addBox(1, 0.2, 0.2, 0.5, 0.5, 0.5)


def two_cubes_that_overlap(occ):
    occ.addBox(0, 0, 0, 1, 1, 1)
    occ.addBox(0.5, 0.2, 0.2, 1, 0.5, 0.5)


def square(occ):
    occ.addRectangle(0, 0, 0, 1, 1)


@pytest.mark.parametrize("suffix", [".step", ".iges", ".brep"])
def test_mass_and_holes(parts, suffix):
    mesh = mp.read_mesh(parts / f"plate{suffix}", length_unit="mm", size=5)
    assert {kind: conn.shape[1] for kind, conn in mesh.cells.items()} == {"tetra10": 10, "triangle6": 6}
    assert set(mesh.groups) == {"body", *(f"face_{k}" for k in range(1, 10))}
    # parabolas for arcs of at most 22.5 degrees: (pi / 8)^4 / 180 of a circle's area, and the circles are 6 % of it
    assert mass(mesh, "body") == pytest.approx(7850 * VOLUME * 1e-9, rel=1e-5)
    walls = [set(mesh.nodes(f"face_{k}")) for k in range(1, 10)]
    for x, radius in ((0.015, 0.004), (0.065, 0.006)):
        hole = NodeSet(cylinder=((x, 0.02, 0), (0, 0, 1), radius)).nodes(mesh, np.arange(len(mesh.points)))
        assert set(hole) in walls
        assert len(hole) > 100
    bottom = NodeSet(plane=((0, 0, 0), (0, 0, 1))).nodes(mesh, np.arange(len(mesh.points)))
    assert set(bottom) in walls


def test_the_size_counts_in_the_unit_of_length(parts):
    one = mp.read_mesh(parts / "plate.step", length_unit="mm", size=8)
    other = mp.read_mesh(parts / "plate.step", size=0.008)
    np.testing.assert_array_equal(one.points, other.points)  # also: the same mesh every time
    np.testing.assert_array_equal(one.cells["tetra10"], other.cells["tetra10"])
    assert (one.scale, other.scale) == (1e-3, 1.0)


def test_a_file_without_unit_takes_the_given_one(parts):
    mesh = mp.read_mesh(parts / "plate.brep", length_unit="in", size=8, order=1)
    assert set(mesh.cells) == {"tetra", "triangle"}
    np.testing.assert_allclose(np.ptp(mesh.points, axis=0), 0.0254 * np.array([80, 40, 8]), rtol=1e-9)


def test_a_step_file_in_metres_and_an_iges_file_in_inches(parts, tmp_path):
    text = (parts / "plate.step").read_text()
    assert "SI_UNIT(.MILLI.,.METRE.)" in text
    (tmp_path / "a.stp").write_text(text.replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT($,.METRE.)"))
    metres = mp.read_mesh(tmp_path / "a.stp", length_unit="mm", size=8000)
    np.testing.assert_allclose(np.ptp(metres.points, axis=0), [80, 40, 8], rtol=1e-9)
    text = (parts / "plate.iges").read_text()
    assert "1.,2,2HMM,1" in text
    (tmp_path / "a.igs").write_text(text.replace("1.,2,2HMM,1", "1.,1,2HIN,1"))
    inches = mp.read_mesh(tmp_path / "a.igs", size=0.2)
    np.testing.assert_allclose(np.ptp(inches.points, axis=0), 0.0254 * np.array([80, 40, 8]), rtol=1e-6)


@pytest.mark.parametrize(("flag", "name", "metres"), [("6", "1HM ", 1.0), ("10", "2HCM", 0.01), ("3", "2HCM", 0.01)])
def test_iges_files_in_their_own_unit(parts, tmp_path, flag, name, metres):
    """A part of 80 m converted to millimetres has faces that do not meet: it is read in metres."""
    text = (parts / "plate.iges").read_text()
    assert "1.,2,2HMM,1" in text
    (tmp_path / "a.igs").write_text(text.replace("1.,2,2HMM,1", f"1.,{flag},{name.strip()},1"))
    mesh = mp.read_mesh(tmp_path / "a.igs", size=8 * metres)
    np.testing.assert_allclose(np.ptp(mesh.points, axis=0), metres * np.array([80, 40, 8]), rtol=1e-6)
    assert mass(mesh, "body") == pytest.approx(7850 * VOLUME * metres**3, rel=1e-4)


def test_names_of_an_assembly(tmp_path):
    """Parts have the names of their products; those that touch share their nodes."""
    draw(tmp_path, two_cubes_that_touch, "two", [".step"])
    names = iter(["assembly", "base plate", "lever"])
    product = re.compile(r"PRODUCT\('Open CASCADE STEP translator[^']*',\s*'[^']*'")
    text = product.sub(lambda mark: "PRODUCT('{0}','{0}'".format(next(names)), (tmp_path / "two.step").read_text())
    (tmp_path / "two.step").write_text(text)
    mesh = mp.read_mesh(tmp_path / "two.step", length_unit="mm", size=0.4)
    assert {"base plate", "lever"} <= set(mesh.groups)
    assert len(np.intersect1d(mesh.nodes("base plate"), mesh.nodes("lever"))) > 4


def test_the_unit_that_another_program_set_is_not_taken(parts):
    import gmsh

    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setString("Geometry.OCCTargetUnit", "M")
        gmsh.model.occ.importShapes(str(parts / "plate.step"))
    finally:
        gmsh.finalize()
    mesh = mp.read_mesh(parts / "plate.iges", length_unit="mm", size=8)
    np.testing.assert_allclose(np.ptp(mesh.points, axis=0), [0.08, 0.04, 0.008], rtol=1e-6)


@pytest.mark.skipif(not hasattr(signal, "SIGPIPE"), reason="a system without this signal")
def test_a_pipe_that_nobody_reads_does_not_end_the_program():
    """gmsh gives the signal its default, which is to end the program; Python ignores it and raises an error."""
    program = """
import os
from modalprep.fe.readers.gmsh_session import gmsh_session
with gmsh_session():
    pass
read, write = os.pipe()
os.close(read)
try:
    os.write(write, b"x")
except BrokenPipeError:
    print("still here")
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stdout == "still here\n"


def test_solids_that_touch_share_their_nodes(tmp_path):
    draw(tmp_path, two_cubes_that_touch, "two", [".step", ".brep"])
    for suffix, unit in ((".step", 1e-3), (".brep", 1.0)):
        mesh = mp.read_mesh(tmp_path / f"two{suffix}", size=0.4 * unit)
        assert {"body", "body_2"} <= set(mesh.groups)
        common = np.intersect1d(mesh.nodes("body"), mesh.nodes("body_2"))
        np.testing.assert_allclose(np.ptp(mesh.points[common], axis=0), [0, 0.5 * unit, 0.5 * unit], atol=1e-9 * unit)
        assert mass(mesh, "body", "body_2") == pytest.approx(7850 * 1.125 * unit**3, rel=1e-9)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({}, "give 'size', the edge of an element in the unit of length of the mesh"),
        ({"size": -1}, "size is -1; it must be a positive length"),
        ({"size": float("nan")}, "size is nan; it must be a positive length"),
        ({"size": 5, "order": 3}, "order is 3; elements have order 1 or 2"),
        ({"size": 0.01}, r"the mesh would have about 2\.1e\+11 elements, more than 500000; give a larger size"),
    ],
)
def test_sizes_that_cannot_be(parts, given, said):
    with pytest.raises(InputError, match=said):
        mp.read_mesh(parts / "plate.step", length_unit="mm", **given)


@pytest.mark.parametrize("suffix", [".step", ".iges", ".brep"])
def test_files_that_are_no_part(parts, tmp_path, capfd, suffix):
    draw(tmp_path, square, "square", [suffix])
    (tmp_path / f"text{suffix}").write_text("hello\n")
    whole = (parts / f"plate{suffix}").read_bytes()
    (tmp_path / f"half{suffix}").write_bytes(whole[: len(whole) // 2])
    capfd.readouterr()
    for name in ("square", "text", "half"):
        with pytest.raises(InputError, match="damaged") as caught:
            mp.read_mesh(tmp_path / f"{name}{suffix}", size=0.1)
        assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


def test_solids_that_overlap(tmp_path):
    draw(tmp_path, two_cubes_that_overlap, "two", [".brep"])
    with pytest.raises(InputError, match="the solids 'body' and 'body_2' overlap; cut one"):
        mp.read_mesh(tmp_path / "two.brep", size=0.3)


@pytest.mark.parametrize("given", [{"size": 1.0}, {"order": 2}])
def test_a_mesh_has_its_elements(project, given):
    with pytest.raises(InputError, match=f"'{next(iter(given))}' is for CAD files"):
        mp.read_mesh(project / "meshes" / "beam.msh", **given)


def test_a_pipeline_file_with_a_part(parts, tmp_path, capsys):
    (tmp_path / "plate.step").write_bytes((parts / "plate.step").read_bytes())
    job = tmp_path / "job.toml"
    job.write_text(PIPELINE.format(suffix=".step", size='"8 mm"'))
    assert main(["run", str(job), "--no-report"]) == 0
    body = mp.read_body(tmp_path / "output" / "job" / "job.h5")
    assert body.m == pytest.approx(7850 * VOLUME * 1e-9, rel=1e-4)
    capsys.readouterr()
    job.write_text(PIPELINE.format(suffix=".step", size=0))
    assert main(["run", str(job)]) == 2
    assert capsys.readouterr().err.count("\n") == 1
