"""The integration of 20-node hexahedra: what decks say of it, and what is asked for instead."""

import numpy as np
import pytest
from calculix import deck as calculix_deck
from fe.ansys_decks import STEEL, deck, eblock, nblock
from fe.decks import STEEL as NASTRAN_STEEL
from structured import box

import modalprep as mp
from modalprep.fe.mesh.cells import CELLS
from modalprep.pipeline.building.model import read_pipeline_mesh
from modalprep.pipeline.schema.load import load

POINTS, BRICKS = box("hexahedron20", (2, 2, 1), (0.2, 0.2, 0.01))
NAMES = ("full", "reduced_stiffness", "reduced")


@pytest.fixture
def abaqus(tmp_path):
    def write(*, more="", **cells):
        path = tmp_path / "plate.inp"
        path.write_text(calculix_deck(POINTS, [0, 1, 2], **(cells or {"C3D20R": BRICKS})) + more)
        return path

    return write


def integration(mesh, section=None):
    """The integration of each block that is assembled, with the number of its elements."""
    model = assembled(mesh, section)
    return {block.integration: len(block.nodes) for block in model.strain_energy.blocks}


def assembled(mesh, section):
    group = next(name for name, rows in mesh.groups.items() if "hexahedron20" in rows)
    sections = {} if section is None else {group: section}
    return mp.assemble(mesh, sections, {"root": mp.Interface(box=((-1, -1, -1), (1e-6, 1, 1)))})


@pytest.mark.parametrize(
    ("dialect", "expected", "points"),
    [
        (None, "reduced", "2 x 2 x 2 points, and their mass too"),
        ("calculix", "reduced", "2 x 2 x 2 points, and their mass too"),
        ("abaqus", "reduced_stiffness", "2 x 2 x 2 points, their mass with 3 x 3 x 3"),
    ],
)
def test_an_abaqus_deck_says_it_by_the_type(abaqus, dialect, expected, points):
    mesh = mp.read_mesh(abaqus(), dialect=dialect)
    assert integration(mesh) == {expected: 4}
    assert f"4 hexahedra of 20 nodes are integrated with {points}, as the deck says" in mesh.notes
    full = mp.read_mesh(abaqus(C3D20=BRICKS), dialect=dialect)
    assert integration(full) == {"full": 4}
    assert not [note for note in full.notes if "integrated" in note]


def test_elements_of_one_set_may_differ(abaqus):
    mesh = mp.read_mesh(abaqus(C3D20R=BRICKS[:1], C3D20=BRICKS[1:]))
    assert integration(mesh) == {"full": 3, "reduced": 1}
    assert (
        "1 hexahedra of 20 nodes are integrated with 2 x 2 x 2 points, and their mass too, as the deck says"
        in mesh.notes
    )


def test_a_property_of_the_user_keeps_it_or_says_another(abaqus):
    mesh = mp.read_mesh(abaqus())
    steel = mp.Material(E=2.1e11, nu=0.3, rho=7800.0)
    assert integration(mesh, mp.Solid(material=steel)) == {"reduced": 4}
    full = mp.Solid(material=steel, integration="full")
    assert integration(mesh, full) == {"full": 4}
    told = "group 'E' has the integration of its property, 'full', where its mesh says another"
    assert told in assembled(mesh, full).notes
    assert told not in assembled(mesh, mp.Solid(material=steel)).notes


@pytest.mark.parametrize("asked", NAMES)
def test_the_user_may_ask_for_it_in_place_of_the_deck(abaqus, asked, tmp_path):
    mesh = mp.read_mesh(abaqus(), integration=asked)
    assert integration(mesh) == {asked: 4}
    assert mesh.notes[-1].endswith(f"as integration = {asked!r} asks")
    assert integration(mp.read_mesh(abaqus(C3D20=BRICKS), integration=asked)) == {asked: 4}
    pipeline = tmp_path / "plate.toml"
    pipeline.write_text(
        f'[mesh]\nfile = "plate.inp"\nintegration = "{asked}"\n[interfaces.root]\nbox = [[-1, -1, -1], [1e-6, 1, 1]]\n'
    )
    np.testing.assert_array_equal(
        read_pipeline_mesh(load(pipeline)).data["integration"]["hexahedron20"], NAMES.index(asked)
    )


@pytest.mark.parametrize(
    ("fields", "expected"),
    [("", "full"), (",,THREE", "full"), (",,2,,FULL", "reduced_stiffness"), (",,TWO", "reduced_stiffness")],
)
def test_a_nastran_deck_says_it_by_psolid(tmp_path, fields, expected):
    order = CELLS["hexahedron20"].nastran_order
    lines = [f"GRID,{k},,{x:.6f},{y:.6f},{z:.6f}" for k, (x, y, z) in enumerate(POINTS, start=1)]
    for k, brick in enumerate(BRICKS + 1, start=1):
        g = [str(grid) for grid in _on_card(brick, order)]
        lines += [f"CHEXA,{k},5,{','.join(g[:6])}", f",{','.join(g[6:14])}", f",{','.join(g[14:])}"]
    path = tmp_path / "plate.bdf"
    path.write_text("\n".join([*lines, f"PSOLID,5,7{fields}", NASTRAN_STEEL, "ENDDATA"]))
    assert integration(mp.read_mesh(path)) == {expected: 4}


def _on_card(brick, order):
    """Grids as the card has them: node i of the cell is the grid at place ``order[i]``."""
    grids = np.empty(20, dtype=int)
    grids[list(order)] = brick
    return grids


@pytest.mark.parametrize(
    ("lines", "expected"),
    [
        (["ET,1,186"], "reduced_stiffness"),
        (["ET,1,186", "KEYOPT,1,2,1"], "full"),
        (["ET,1,95"], "full"),
        (["ET,1,95", "KEYOPT,1,11,1"], "reduced_stiffness"),
    ],
)
def test_an_ansys_deck_says_it_by_its_options(tmp_path, lines, expected):
    mesh = mp.read_mesh(deck(tmp_path, [*lines, *STEEL, *nblock(POINTS), *eblock(*(BRICKS + 1).tolist())]))
    assert integration(mesh) == {expected: 4}


def test_elements_that_differ_from_those_of_the_deck_are_told(tmp_path):
    points, bricks = box("hexahedron", (1, 1, 1))
    path = tmp_path / "cube.inp"
    path.write_text(calculix_deck(points, [0, 1, 2], C3D8R=bricks))
    assert [note for note in mp.read_mesh(path).notes if note.startswith("1 elements of C3D8R have incompatible modes")]
    shell = "*SHELL SECTION, ELSET=E, MATERIAL=S\n.01\n"
    path.write_text(calculix_deck(points, [0], section=shell, S4R=bricks[:, :4]))
    for dialect, count in (("calculix", 1), ("abaqus", 0)):
        notes = mp.read_mesh(path, dialect=dialect).notes
        assert sum(note.startswith("1 elements of S4R are shells here") for note in notes) == count
    cdb = deck(tmp_path, ["ET,1,185", "KEYOPT,1,2,1", *STEEL, *nblock(points), *eblock(*(bricks + 1).tolist())])
    assert [note for note in mp.read_mesh(cdb).notes if note.startswith("SOLID185 with KEYOPT(2) = 1")]


def test_refusals(abaqus, tmp_path):
    with pytest.raises(mp.InputError, match="integration of a deck: 'selective'"):
        mp.read_mesh(abaqus(), integration="selective")
    points, bricks = box("hexahedron", (1, 1, 1))
    (tmp_path / "cube.inp").write_text(calculix_deck(points, [0, 1, 2], C3D8=bricks))
    with pytest.raises(mp.InputError, match="'integration' is of hexahedron20 and wedge15 cells; leave it out"):
        mp.read_mesh(tmp_path / "cube.inp", integration="full")
    (tmp_path / "part.msh").write_text("")
    with pytest.raises(mp.InputError, match="'integration' is for decks; give that of each solid"):
        mp.read_mesh(tmp_path / "part.msh", integration="full")
