"""Forms in which Ansys writes its archives, predefined systems, and decks that are told by their content."""

import numpy as np
import pytest
from fe.ansys_decks import STEEL, UNIT_CUBE, deck, eblock, nblock
from fe.decks import BAR, GRIDS, PBAR
from fe.decks import STEEL as MAT1

import modalprep as mp
from modalprep.errors import InputError
from modalprep.fe.readers.digest import mesh_digest

CUBE = ["ET,1,185", *nblock(UNIT_CUBE), *eblock(range(1, 9))]
DATA = ["MPDATA,{0}, 1,EX  ,       1, 1,  2.1e11,", "MPDATA,{0}, 1,NUXY,       1, 1,  0.3,"]
DATA += ["MPTEMP,{0}, 1, 1, 0.0", "MPDATA,{0}, 1,DENS,       1, 1,  7800.0,"]


def mass_of(mesh):
    return mp.assemble(mesh, {}, {"root": mp.Interface(group="type1_mat1")}).rigid.m


@pytest.mark.parametrize("version", ["UNBL", "R5.0", "R5.3", "R11.0", "unbl"])
def test_the_lines_of_every_version_of_cdwrite(tmp_path, version):
    """Blocks end in N,version,LOC and EN,version,ATTR; properties are unblocked or in the form of a release."""
    cube = [line.replace("R5.3", version) for line in CUBE]
    lines = [*cube, f"EN,{version},ATTR,       -1,", *(line.format(version) for line in DATA)]
    mesh = mp.read_mesh(deck(tmp_path, lines))
    assert (len(mesh.points), {kind: len(rows) for kind, rows in mesh.cells.items()}) == (8, {"hexahedron": 1})
    assert mass_of(mesh) == pytest.approx(7800, rel=1e-12)
    assert mesh.properties["type1_mat1"].material.E == 2.1e11


@pytest.mark.parametrize("form", ["(1i7,2i9,6e21.13)", "(1i8,2i8,6e16.9)", "(i9,2i9,6e21.13e3)", "(3i10,3e20.12)"])
def test_the_formats_of_nodes(tmp_path, form):
    """Widths of each item count, one after the other; a count of one may be left out."""
    widths = {
        "(1i7,2i9,6e21.13)": (7, 9, 9, 21),
        "(1i8,2i8,6e16.9)": (8, 8, 8, 16),
        "(i9,2i9,6e21.13e3)": (9, 9, 9, 21),
    }
    label, *zeros, real = widths.get(form, (10, 10, 10, 20))
    rows = [
        f"{k:{label}d}" + "".join(f"{0:{w}d}" for w in zeros) + "".join(f"{x:{real}.8E}" for x in point)
        for k, point in enumerate(UNIT_CUBE, 1)
    ]
    lines = ["ET,1,185", *STEEL, "NBLOCK,6,SOLID,8,8", form, *rows, "N,UNBL,LOC,-1,", *eblock(range(1, 9))]
    mesh = mp.read_mesh(deck(tmp_path, lines))
    np.testing.assert_allclose(mesh.points, UNIT_CUBE, atol=1e-12)


# The centroid of the cube is (.5, .5, .5): radius and circumference of each system there, by hand.
C, H, S = np.sqrt(1 / 2), np.sqrt(1 / 3), np.sqrt(1 / 6)
AXES = {
    1: [[C, C, 0], [-C, C, 0], [0, 0, 1]],
    2: [[H, H, H], [-C, C, 0], [-S, -S, 2 * S]],
    5: [[C, 0, C], [C, 0, -C], [0, 1, 0]],
    6: [[0, C, C], [0, -C, C], [1, 0, 0]],
}


@pytest.mark.parametrize("system", AXES)
def test_predefined_systems_of_elements(tmp_path, system):
    """Cylindrical about z (1), y (5) and x (6), and spherical (2): radius, angle about the axis, and the third."""
    wood = ["MP,EX,1,14e9", "MP,EY,1,1e9", "MP,EZ,1,9e8", "MP,GXY,1,5e8", "MP,GYZ,1,3e8", "MP,GXZ,1,4e8"]
    wood += ["MP,PRXY,1,.3", "MP,PRYZ,1,.4", "MP,PRXZ,1,.28", "MP,DENS,1,500"]
    lines = ["ET,1,185", *wood, *nblock(UNIT_CUBE), *eblock(range(1, 9), system=system)]
    found = mp.read_mesh(deck(tmp_path, lines)).data["frame"]["hexahedron"][0]
    np.testing.assert_allclose(found, AXES[system], atol=1e-12)
    assert np.linalg.det(found) == pytest.approx(1.0)


def test_a_spherical_system_of_its_own(tmp_path):
    """LOCAL of kind 2 at (.5, .5, 0): at the middle of the cube the radius is z."""
    wood = ["MP,EX,1,14e9", "MP,EY,1,1e9", "MP,EZ,1,9e8", "MP,GXY,1,5e8", "MP,GYZ,1,3e8", "MP,GXZ,1,4e8"]
    wood += ["MP,PRXY,1,.3", "MP,PRYZ,1,.4", "MP,PRXZ,1,.28", "MP,DENS,1,500", "LOCAL,11,2,.5,.5,0"]
    mesh = mp.read_mesh(deck(tmp_path, ["ET,1,185", *wood, *nblock(UNIT_CUBE), *eblock(range(1, 9), system=11)]))
    np.testing.assert_allclose(mesh.data["frame"]["hexahedron"][0][0], [0, 0, 1], atol=1e-12)


COMMANDS = ["ET,1,185", *STEEL, "BLOCK,0,1,0,1,0,1", "ESIZE,.5", "VMESH,ALL"]


def test_a_deck_of_commands_has_a_sentence_of_its_own(tmp_path):
    with pytest.raises(InputError, match="makes its model by commands, BLOCK in line 6 first, and lists no nodes"):
        mp.read_mesh(deck(tmp_path, COMMANDS))


# ---------------------------------------------------------------- endings that several programs use

ABAQUS = "** a bar\n*Heading\n*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n*ELEMENT, TYPE=T3D2, ELSET=bar\n7, 1, 2\n"
NASTRAN = "$ a bar\nSOL 103\nCEND\nBEGIN BULK\n" + GRIDS + BAR + PBAR + MAT1 + "ENDDATA\n"
ANSYS = "\n".join(["/COM,ANSYS RELEASE 2023 R1", "/PREP7", *CUBE, *STEEL, "*SET,_x,1", "FINISH\n"])


@pytest.mark.parametrize("ending", [".dat", ".inp", ".ans", ".txt"])
@pytest.mark.parametrize(("text", "kind"), [(ABAQUS, "line"), (NASTRAN, "line"), (ANSYS, "hexahedron")])
def test_decks_are_told_by_their_content(tmp_path, text, kind, ending):
    path = tmp_path / f"deck{ending}"
    path.write_text(text)
    assert kind in mp.read_mesh(path).cells
    assert len(mesh_digest(path)) == 64


def test_other_endings_count_and_a_text_of_nothing_is_no_mesh(tmp_path):
    (tmp_path / "deck.bdf").write_text(ANSYS)
    with pytest.raises(InputError, match="has no GRID"):
        mp.read_mesh(tmp_path / "deck.bdf")
    (tmp_path / "note.txt").write_text("a note\n")
    with pytest.raises(InputError, match="the format '.txt' is not known"):
        mp.read_mesh(tmp_path / "note.txt")
