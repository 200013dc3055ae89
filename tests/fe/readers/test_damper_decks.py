"""Dampers of the programs' decks in the damping matrix of the model."""

import numpy as np
import pytest

import modalprep as mp

BARS = """GRID,1,,0.,0.,0.
GRID,2,,3.,4.,0.
GRID,3,,3.,4.,0.
GRID,4,,0.,5.,0.
CBAR,1,5,1,2,0.,0.,1.
CBAR,2,5,1,4,0.,0.,1.
CBAR,3,5,4,3,0.,0.,1.
PBAR,5,7,.01,3.-6,2.-6,4.-6
MAT1,7,2.+11,,.3,8000.
"""
X, Y, TURN = 0, 1, 5


def of_nastran(tmp_path, cards, unit=("m", "kg")):
    (tmp_path / "deck.bdf").write_text(BARS + cards + "ENDDATA\n")
    mesh = mp.read_mesh(tmp_path / "deck.bdf", *unit)
    return mp.assemble(mesh, {}, {"root": mp.Interface(node=1, kind="node")})


def between(model, pairs):
    """The damping matrix of dampers of c between components of two nodes, or of one with the ground."""
    C = np.zeros((model.n_dof, model.n_dof))
    for c, *ends in pairs:
        row = np.zeros(model.n_dof)
        for sign, (node, direction) in zip((-1, 1), ends, strict=False):
            row[model.dof[node, : len(direction)]] += sign * np.asarray(direction)
        C += c * np.outer(row, row)
    return C


UNIT = np.eye(6)
ALONG = [0.6, 0.8, 0]
CARDS = {
    "CDAMP1,9,3,2,1,3,1\nPDAMP,2,8.,3,20.\n": [(20, (1, UNIT[X]), (2, UNIT[X]))],
    "CDAMP2,9,20.,2,6,3,6\n": [(20, (1, UNIT[TURN]), (2, UNIT[TURN]))],
    "CDAMP2,9,20.,2,2\n": [(20, (1, UNIT[Y]))],
    "CVISC,9,3,1,2\nPVISC,2,8.,9.,,3,20.,30.\n": [
        (20, (0, ALONG), (1, ALONG)),
        (30, (0, [0, 0, 0, *ALONG]), (1, [0, 0, 0, *ALONG])),
    ],
    "CBUSH,9,3,2,3,,,,0\nPBUSH,3,K,5.,,,,,,+\n+,,B,20.,,,,,30.\n": [
        (20, (1, UNIT[X]), (2, UNIT[X])),
        (30, (1, UNIT[TURN]), (2, UNIT[TURN])),
    ],
    "CBUSH,9,3,2,3,,,,0\nPBUSH,3,B,,20.\n": [(20, (1, UNIT[Y]), (2, UNIT[Y]))],
    "CBUSH1D,9,3,1,2\nPBUSH1D,3,5.,20.\n": [(20, (0, ALONG), (1, ALONG))],
    "CBUSH1D,9,3,2,3,4\nPBUSH1D,3,,20.\nCORD2R,4,,0.,0.,0.,0.,0.,1.\n,0.,1.,0.\n": [(20, (1, UNIT[Y]), (2, UNIT[Y]))],
}


@pytest.mark.parametrize(("cards", "pairs"), CARDS.items(), ids=[cards.split(",")[0] for cards in CARDS])
def test_dampers_of_nastran(tmp_path, cards, pairs):
    model = of_nastran(tmp_path, cards)
    np.testing.assert_allclose(model.damping.toarray(), between(model, pairs), atol=1e-12)
    bare = of_nastran(tmp_path, "")
    assert bare.damping is None
    stiff = ",K,5." in cards or "1D,3,5." in cards
    assert (abs(model.K - bare.K).max() > 1) == stiff


def test_units_of_dampers(tmp_path):
    """N s/mm are 1000 N s/m; N s mm are 0.001 N m s."""
    model = of_nastran(tmp_path, "CDAMP2,9,20.,2,1,3,1\nCDAMP2,8,20.,2,6,3,6\n", ("mm", "t"))
    at = model.dof[1]
    assert model.damping[at[X], at[X]] == pytest.approx(20e3)
    assert model.damping[at[TURN], at[TURN]] == pytest.approx(20e-3)


def test_a_bar_in_one_dimension_with_mass_is_refused(tmp_path):
    with pytest.raises(mp.InputError, match="PBUSH1D 3: its mass M is not read; give it by CONM2 at both ends"):
        of_nastran(tmp_path, "CBUSH1D,9,3,1,2\nPBUSH1D,3,5.,20.,1.\n")
    with pytest.raises(mp.InputError, match="CVISC 9: it has no line, as its grids coincide"):
        of_nastran(tmp_path, "CVISC,9,3,2,3\nPVISC,3,20.\n")


INP = """*NODE
1, 0., 0., 0.
2, 3., 4., 0.
3, 3., 4., 0.
4, 0., 5., 0.
*ELEMENT, TYPE=B31, ELSET=BARS
1, 1, 2
2, 1, 4
3, 4, 3
*BEAM SECTION, ELSET=BARS, SECTION=RECT, MATERIAL=STEEL
.1, .2
0., 0., 1.
*MATERIAL, NAME=STEEL
*ELASTIC
2.E11, .3
*DENSITY
8000.
"""
DASHPOTS = {
    "*ELEMENT, TYPE=DASHPOTA, ELSET=D\n9, 1, 2\n*DASHPOT, ELSET=D\n\n20.\n": [(20, (0, ALONG), (1, ALONG))],
    "*ELEMENT, TYPE=DASHPOT2, ELSET=D\n9, 2, 3\n*DASHPOT, ELSET=D\n6, 6\n20.\n": [
        (20, (1, UNIT[TURN]), (2, UNIT[TURN]))
    ],
    "*ELEMENT, TYPE=DASHPOT1, ELSET=D\n9, 2\n*DASHPOT, ELSET=D\n2\n20.\n": [(20, (1, UNIT[Y]))],
}


@pytest.mark.parametrize(("cards", "pairs"), DASHPOTS.items(), ids=["DASHPOTA", "DASHPOT2", "DASHPOT1"])
def test_dashpots_of_abaqus(tmp_path, cards, pairs):
    (tmp_path / "deck.inp").write_text(INP + cards)
    mesh = mp.read_mesh(tmp_path / "deck.inp", "m", "kg", dialect="abaqus")
    model = mp.assemble(mesh, {}, {"root": mp.Interface(node=1, kind="node")})
    np.testing.assert_allclose(model.damping.toarray(), between(model, pairs), atol=1e-12)
