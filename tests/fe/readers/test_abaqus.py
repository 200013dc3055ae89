"""Abaqus input files: what is read, and one message for what cannot be."""

import numpy as np
import pytest

import modalprep as mp

DECK = """** two plates and a beam
*Heading
*NODE, NSET=all
10, 0, 0, 0
20, 1, 0
30, 1, 1, 0
40, 0, 1, 0
50, 2., 0., 0.
*ELEMENT, TYPE=s4r, ELSET=skin
1, 10, 20,
30, 40
*ELEMENT, TYPE=S3, ELSET=skin
2, 20, 50, 30
*ELEMENT, TYPE=B31, ELSET=bar
3, 50, 30
*ELSET, ELSET=every
skin, 3
*ELSET, ELSET=two, GENERATE
1, 3, 2
*NSET, NSET=ends
10, 50
*MATERIAL, NAME=steel
"""


@pytest.fixture
def read(tmp_path):
    def reader(text, unit="m"):
        (tmp_path / "deck.inp").write_text(text)
        return mp.read_mesh(tmp_path / "deck.inp", unit)

    return reader


def test_sets_numbers_and_units(read):
    mesh = read(DECK, "mm")
    assert mesh.labels.tolist() == [10, 20, 30, 40, 50]
    np.testing.assert_allclose(mesh.points[4], [0.002, 0, 0])
    assert mesh.cells["quad"].tolist() == [[0, 1, 2, 3]]  # a line that ends in a comma goes on
    counts = {name: {kind: len(rows) for kind, rows in g.items()} for name, g in mesh.groups.items()}
    assert counts == {
        "skin": {"quad": 1, "triangle": 1},
        "bar": {"line": 1},
        "every": {"quad": 1, "triangle": 1, "line": 1},
        "two": {"quad": 1, "line": 1},
        "all": {"vertex": 5},
        "ends": {"vertex": 2},
    }
    assert mesh.nodes("ends").tolist() == [0, 4]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("10, 0, 0, 0", "10, 0, zero, 0", "line 4: node 10, 0, zero, 0 is not a number and coordinates"),
        ("10, 0, 0, 0", "10, 0, nan, 0", "the first is node 10"),
        ("TYPE=B31", "TYPE=S8R", "line 15: element type 'S8R' has no counterpart here"),
        ("3, 50, 30", "3, 50", "line 15: element 3, 50 of type B31 needs a number and 2 nodes"),
        ("3, 50, 30", "3, 50, 31", "line 15: element 3 refers to node 31, which is not there"),
        ("skin, 3", "skin, every", "set 'every' contains itself"),
        ("1, 3, 2", "1, 3, 0", "GENERATE needs first, last and step"),
        ("*Heading", "*PART, NAME=a\n*END PART\n*PART, NAME=b", "several parts; export it flat"),
        ("*Heading", "*INCLUDE, INPUT=more.inp", "*INCLUDE; export it flat"),
        (DECK[DECK.index("*ELEMENT") :], "", "holds no cells"),
    ],
)
def test_bad_decks(read, old, new, words):
    assert old in DECK
    with pytest.raises(mp.InputError) as caught:
        read(DECK.replace(old, new))
    assert words in str(caught.value)
    assert "deck.inp" in str(caught.value)


@pytest.mark.parametrize("end", range(0, len(DECK), 5))
def test_cut_short_anywhere(read, end):
    """Every prefix of the deck is read, or refused with a message that names it."""
    try:
        mesh = read(DECK[:end])
    except mp.InputError as error:
        message = str(error)
    else:
        message = mesh.source
    assert "deck.inp" in message
