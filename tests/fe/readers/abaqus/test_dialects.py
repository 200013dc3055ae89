"""What Abaqus and CalculiX take differently; values of CalculiX are those of its version 2.20."""

import math

import numpy as np
import pytest
from fe.abaqus_decks import BEAM, NODES, SECTION, STEEL, E, G, displacements

import modalprep as mp
from modalprep.cli import main
from modalprep.pipeline.building.model import read_pipeline_mesh
from modalprep.pipeline.schema.load import load

CIRC = "*BEAM SECTION, ELSET=b, MATERIAL=steel, SECTION=CIRC\n{}\n0, 1, 0\n"
HELD = "*BOUNDARY\n1, ENCASTRE\n"
ASKS = 'give dialect = "abaqus" or "calculix"'


@pytest.mark.parametrize("sizes", ["0.05, 0.05", "0.05, 0.03"])
def test_circ_of_calculix_has_the_diameters_of_an_ellipse(read, sizes):
    """A = pi a b / 4, second moments A a^2 / 16; the torsion of an ellipse is pi a^3 b^3 / (16 (a^2 + b^2))."""
    a, b = map(float, sizes.split(","))
    mesh = read(BEAM + CIRC.format(sizes) + STEEL)
    section = mesh.properties["b"]
    assert section.A == pytest.approx(math.pi * a * b / 4, rel=1e-12)
    assert (section.Iy, section.Iz) == pytest.approx((section.A * b**2 / 16, section.A * a**2 / 16), rel=1e-12)
    assert pytest.approx(math.pi * a**3 * b**3 / (16 * (a**2 + b**2)), rel=1e-12) == section.J
    assert any("read as a deck of CalculiX (SECTION=CIRC with two diameters in line 8)" in note for note in mesh.notes)


def test_the_first_frequencies_of_an_ellipse_are_those_of_calculix(read):
    """Eight B32R of 50 x 100 mm, 1 m: CalculiX has 37.10868 and 73.91242 Hz, its coarse solids are 2.5 % higher."""
    nodes = "".join(f"{k + 1}, {k / 16}, 0, 0\n" for k in range(17))
    lines = "".join(f"{k}, {2 * k - 1}, {2 * k}, {2 * k + 1}\n" for k in range(1, 9))
    text = f"*NODE\n{nodes}*ELEMENT, TYPE=B32R, ELSET=b\n{lines}" + CIRC.format(".05, .1")
    text += "*MATERIAL, NAME=steel\n*ELASTIC\n2.1e11, .3\n*DENSITY\n7800.\n"
    model = mp.assemble(read(text), {}, {"root": mp.Interface(node=1, kind="node")})
    assert mp.craig_bampton(model, modes=2).table.frequency[:2] == pytest.approx([37.10868, 73.91242], rel=0.03)


def test_circ_of_one_size_is_asked_for(read):
    text = BEAM + CIRC.format("0.05") + STEEL
    with pytest.raises(mp.InputError, match=ASKS):
        read(text)
    diameter, radius = (read(text, dialect=name).properties["b"].A for name in ("calculix", "abaqus"))
    assert radius == pytest.approx(math.pi * 0.05**2, rel=1e-12)
    assert diameter == pytest.approx(math.pi * 0.05**2 / 4, rel=1e-12)


@pytest.mark.parametrize(
    ("more", "factor", "proof"),
    [
        ("*ELEMENT, TYPE=B33, ELSET=c\n8, 1, 2\n", 1.0, "TYPE=B33"),
        ("*PREPRINT, ECHO=NO\n", 1.0, "*PREPRINT"),
        ("*STEP\n*STATIC\n*OUTPUT, FIELD\n*END STEP\n", 1.0, "*OUTPUT, FIELD"),
        ("*ELEMENT, TYPE=B32R, ELSET=c\n8, 1, 2, 3\n", 0.25, "TYPE=B32R"),
        ("*STEP\n*STATIC, SOLVER=PARDISO\n*END STEP\n", 0.25, "SOLVER=PARDISO"),
        ("*STEP\n*FREQUENCY, STORAGE=YES\n3\n*END STEP\n", 0.25, "*FREQUENCY, STORAGE"),
        ("*NSET, NSET=n\n1, 2\n*RIGID BODY, NSET=n, REF NODE=1, ROT NODE=3\n", 0.25, "*RIGID BODY, ROT NODE"),
    ],
)
def test_what_only_one_of_them_has_proves_the_dialect(read, more, factor, proof):
    mesh = read(BEAM + CIRC.format("0.05") + STEEL + more)
    assert mesh.properties["b"].A == pytest.approx(factor * math.pi * 0.05**2, rel=1e-12)
    assert any(f"({proof} in line" in note for note in mesh.notes)


def test_proofs_of_both_prove_nothing(read):
    text = BEAM + CIRC.format("0.05") + STEEL + "*PREPRINT\n*STEP\n*STATIC, SOLVER=PARDISO\n*END STEP\n"
    with pytest.raises(mp.InputError, match=r"\*PREPRINT in line \d+ is of Abaqus, SOLVER=PARDISO in line \d+ of"):
        read(text)


def test_other_sections_do_not_need_the_dialect(read):
    assert read(BEAM + SECTION + STEEL).notes == ()


def test_an_unknown_dialect_and_one_of_other_files_are_refused(read, tmp_path):
    with pytest.raises(mp.InputError, match="dialect of a deck: 'ansys'"):
        read(BEAM + SECTION + STEEL, dialect="ansys")
    (tmp_path / "a.bdf").write_text("GRID,1\n")
    with pytest.raises(mp.InputError, match="'dialect' is for decks of Abaqus and CalculiX"):
        mp.read_mesh(tmp_path / "a.bdf", dialect="abaqus")


def test_the_pipeline_file_says_the_dialect(tmp_path):
    (tmp_path / "beam.inp").write_text(BEAM + CIRC.format("0.05") + STEEL)
    text = '[mesh]\nfile = "beam.inp"\ndialect = "abaqus"\n[interfaces.root]\nnode = 1\nkind = "node"\n'
    (tmp_path / "job.toml").write_text(text + "[reduction]\nmodes = 2\n")
    mesh = read_pipeline_mesh(load(tmp_path / "job.toml"))
    assert mesh.properties["b"].A == pytest.approx(math.pi * 0.05**2, rel=1e-12)


def test_a_first_pipeline_file_has_the_dialect(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "beam.inp").write_text(BEAM + CIRC.format("0.05") + STEEL)
    assert main(["init", "beam.inp", "--length-unit", "m"]) == 2
    assert "or --dialect" in " ".join(capsys.readouterr().err.split())
    assert main(["init", "beam.inp", "--length-unit", "m", "--dialect", "ccx"]) == 2
    assert main(["init", "beam.inp", "--length-unit", "m", "--dialect", "calculix"]) == 0
    assert read_pipeline_mesh(load(tmp_path / "beam.toml")).properties["b"].A == pytest.approx(math.pi * 0.05**2 / 4)


def test_one_thickness_of_calculix_is_that_of_both_directions(read):
    """CalculiX 2.20: RECT of .05 alone has the frequencies of a square."""
    text = BEAM + SECTION.replace(".02, .05", ".02") + STEEL
    assert read(text, dialect="calculix").properties["b"].A == pytest.approx(4e-4, rel=1e-12)
    with pytest.raises(mp.InputError, match="size 2 of RECT"):
        read(text)


NORMALS = ["1, 1, 0, 1, 0\n2, 2, 0, 2, 0\n", "b, 1, 0, 1, 0\n", "b, 1, .3, 1, -.2\nb, 2, .3, 1, .2\n"]


@pytest.mark.parametrize("lines", NORMALS)
def test_normals_of_beams_are_axis_2_in_abaqus(read, lines):
    """A normal takes the place of t x n1, as far as it stands across the beam."""
    text = BEAM + SECTION + STEEL
    turned = read(text + "*NORMAL\n" + lines)
    np.testing.assert_allclose(np.abs(turned.data["up"]["line"]), [[0, 1, 0]] * 2, atol=1e-12)
    for plain in (read(text), read(text + "*NORMAL\n" + lines, dialect="calculix")):
        np.testing.assert_allclose(np.abs(plain.data["up"]["line"]), [[0, 0, 1]] * 2, atol=1e-12)
    assert plain.notes == ("left out: 1 *NORMAL (line 16); model them otherwise where they matter",)


def test_normals_along_a_beam_are_refused(read):
    with pytest.raises(mp.InputError, match="a direction n1 along it"):
        read(BEAM + SECTION + STEEL + "*NORMAL\n1, 1, 1, 0, 0\n")


@pytest.mark.parametrize(("option", "centroid"), [("OFFSET1", (0, -0.01, 0)), ("OFFSET2", (0, 0, -0.025))])
def test_offsets_are_in_thicknesses(read, option, centroid):
    """Offset 0.5: the nodes lie on the surface; CalculiX expands RECT of (.1, .04) from -.1 to 0 along axis 1."""
    mesh = read(BEAM + SECTION.replace("SECTION=RECT", f"SECTION=RECT, {option}=0.5") + STEEL)
    model = mp.assemble(mesh, {}, {"root": mp.Interface(node=1, kind="node")})
    np.testing.assert_allclose(model.rigid.s0 / model.rigid.m, np.add(centroid, (1, 0, 0)), atol=1e-12)


NODAL = "*BEAM SECTION, ELSET=b, MATERIAL=steel, SECTION=RECT, NODAL THICKNESS\n.3, .3\n0, 1, 0\n*NODAL THICKNESS\n"


def test_thicknesses_at_the_nodes_take_the_place_of_the_line(read):
    nodal = read(BEAM + NODAL + "1, .02, .05\n2, .02, .05\n3, .02, .05\n" + STEEL).properties["b"]
    assert nodal == read(BEAM + SECTION + STEEL).properties["b"]


@pytest.mark.parametrize("last", ["3, .02, .06\n", ""])
def test_thicknesses_that_differ_or_lack_are_refused(read, last):
    with pytest.raises(mp.InputError, match="has NODAL THICKNESS"):
        read(BEAM + NODAL + "1, .02, .05\n2, .02, .05\n" + last + STEEL)


def test_the_beam_u1_of_calculix(read):
    """Its I11 is that of bending along axis 1, its torsion constant I11 + I22: P L^3 / (3 E I) + P L / (k G A).

    CalculiX 2.20 with 16 elements of 1 m, 1 kN along axis 1: 3.984369e-4 m; 1 kN m about the beam: 2.476190e-3 rad.
    """
    user = "*USER ELEMENT, TYPE=U1, NODES=2, INTEGRATION POINTS=2, MAXDOF=6\n*ELEMENT, TYPE=U1, ELSET=b\n"
    text = NODES + user + "1, 1, 2\n*BEAM SECTION, ELSET=b, MATERIAL=steel, SECTION=GENERAL\n"
    text += ".005, 4e-6, 0., 1e-6, .83\n0, 1, 0\n*MATERIAL, NAME=steel\n*ELASTIC\n2.1e11, .3\n" + HELD
    u = displacements(read(text), {(2, 1): 1e3, (2, 2): 1e3, (2, 3): 1e3})[1]
    modulus, shear = 2.1e11, 2.1e11 / 2.6
    assert u[3] == pytest.approx(2.476190e-3, rel=1e-6)
    assert u[1] == pytest.approx(3.984369e-4, rel=5e-3)  # its shape functions lose shear
    for component, second in ((1, 4e-6), (2, 1e-6)):
        exact = 1e3 / (3 * modulus * second) + 1e3 / (0.83 * shear * 0.005)
        assert u[component] == pytest.approx(exact, rel=1e-9)


def test_other_user_elements_are_refused(read):
    with pytest.raises(mp.InputError, match="of TYPE=US3 is a subroutine"):
        read(BEAM + SECTION + STEEL + "*USER ELEMENT, TYPE=US3, NODES=3\n")


def test_a_box_of_unequal_walls_twists_by_bredt(read):
    """phi = T L / (G J) with J = 4 A^2 / sum(s / t) along the middles of the walls, 10 x 8 mm of four thicknesses."""
    walls = {"right": (0.04, 0.002), "top": (0.06, 0.003), "left": (0.04, 0.004), "bottom": (0.06, 0.001)}
    sizes = ".063, .042, .002, .003, .004, .001"
    J = 4 * (0.06 * 0.04) ** 2 / sum(s / t for s, t in walls.values())
    text = BEAM + SECTION.replace("RECT", "BOX").replace(".02, .05", sizes) + STEEL + HELD
    u = displacements(read(text), {(3, 3): 100.0})
    assert u[2, 3] == pytest.approx(100 * 2 / (G * J), rel=1e-9)
    assert E > G
