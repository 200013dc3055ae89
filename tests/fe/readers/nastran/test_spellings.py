"""What Nastran takes in several ways: solids numbered either way round, spellings of cards, axes of materials."""

import numpy as np
import pytest
from fe.decks import BAR, GRIDS, PBAR, STEEL, free

import modalprep as mp
from modalprep.errors import InputError
from modalprep.fe.mesh.cells import CELLS

SOLIDS = {
    **{"CTETRA 4": "tetra", "CPYRAM 5": "pyramid", "CPENTA 6": "wedge", "CHEXA 8": "hexahedron"},
    **{"CTETRA 10": "tetra10", "CPYRAM 13": "pyramid13", "CPENTA 15": "wedge15", "CHEXA 20": "hexahedron20"},
}


@pytest.mark.parametrize("name", SOLIDS)
def test_left_handed_solids_are_turned(read, name):
    """The mirror image of a solid with the same numbers is left-handed, and has the same frequencies."""
    kind = SOLIDS[name]
    cell = CELLS[kind]
    order = list(cell.nastran_order or range(cell.count))
    x = cell.node_coordinates() * (1.0, 1.3, 0.7)
    x[:, 0] += 0.2 * x[:, 2]
    numbers = [""] * cell.count
    for k, place in enumerate(order):
        numbers[place] = str(k + 1)
    found = []
    for mirrored in (x, x * (1, -1, 1)):
        grids = "".join(f"GRID,{k},,{a:.12f},{b:.12f},{c:.12f}\n" for k, (a, b, c) in enumerate(mirrored, 1))
        mesh = read(grids + free([name.split()[0], "9", "3", *numbers]) + "PSOLID,3,7\n" + STEEL)
        root = {"root": mp.Interface(box=((-9, -9, -9), (9, 9, 0.01)), position=(0.1, 0.0, 0.0))}
        model = mp.assemble(mesh, {}, root)
        modes = mp.craig_bampton(model, modes=3, truncation=()).table.frequency[:3]
        found.append((model.rigid.m, *modes))
    assert any("1 solids are numbered left-handed and are turned (first element 9)" in note for note in mesh.notes)
    np.testing.assert_allclose(found[1], found[0], rtol=1e-9)


SAME = [
    "GRID*,2,0,2.0,0.0E+0\n*,0.\n",
    "GRID           2              2.      0.      0.       0\n",
    "GRID,2,,.2+1,0.\n",
    "PBAR,5,7,1.-2,3.0E-6,2.-6,.4-5\n",
    "CBAR,9,5,1,2,0.,1.0,0.0\n",
]


@pytest.mark.parametrize("card", SAME)
def test_a_card_may_be_there_twice_in_other_spellings(read, card):
    mesh = read(GRIDS + BAR + PBAR + STEEL + card)
    assert (len(mesh.points), len(mesh.cells["line"])) == (4, 1)


@pytest.mark.parametrize("card", ["GRID,2,,2.0001\n", "GRID,2,,2.,,,,3\n", "PBAR,5,7,1.-2,3.0E-6,2.-6,.4-5,1.\n"])
def test_a_card_that_differs_is_refused(read, card):
    with pytest.raises(InputError, match="has this id; keep one of the two"):
        read(GRIDS + BAR + PBAR + STEEL + card)


def test_matrices_of_aerodynamics_are_left_out_with_a_note(read):
    aero = "DMI,W2GJ,0,2,1,0,,4,1\nDMI,W2GJ,1,1,.1,.1,.1,.1\nAERO,,1.3,100.,1.-5\nSPLINE1,3,4,5,6\nAEFACT,9,.1,.2\n"
    mesh = read(GRIDS + BAR + PBAR + STEEL + aero)
    [note] = [note for note in mesh.notes if "DMI" in note]
    assert all(f"{count} {name}" in note for count, name in ((2, "DMI"), (1, "AERO"), (1, "SPLINE1"), (1, "AEFACT")))
    assert note.endswith("they carry no stiffness, mass or constraints")


PLY = "PCOMP,91\n,20,.1,0.,,20,.1,90.\nMAT8,20,1.+7,1.+6,.25,4.+5,4.+5,4.+5,1000.\n"
NORMAL = "CORD2R,3,,0.,0.,0.,1.,0.,0.\n,0.,0.,1.\n"  # z along x, x along z, y along -y


@pytest.mark.parametrize(
    "element", ["CQUAD4,1,91,1,2,3,4,3\n", "CTRIA3,1,91,1,2,3,3\n", "CQUAD8,1,91,1,2,3,4\n,,,,,,,3\n"]
)
def test_y_of_a_system_whose_x_is_normal_to_a_shell(read, element):
    mesh = read(GRIDS + NORMAL + element + PLY)
    [axis] = next(iter(mesh.data["axis"].values()))
    np.testing.assert_allclose(axis, [0, -1, 0], atol=1e-12)
    assert any("1 shells have x of their MCID along the normal" in note for note in mesh.notes)
    assert mp.assemble(mesh, {}, {"root": mp.Interface(node=1, kind="node")}).rigid.m == pytest.approx(
        1000 * 0.2 * (1 if "TRIA" in element else 2), rel=1e-9
    )


def test_a_system_beside_the_normal_is_projected(read):
    mesh = read(GRIDS + NORMAL.replace("1.,0.,0.\n", "1.,0.,.01\n") + "CQUAD4,1,91,1,2,3,4,3\n" + PLY)
    assert not any("MCID" in note for note in mesh.notes)
    assert abs(mesh.data["axis"]["quad"][0][1]) < 1e-12
