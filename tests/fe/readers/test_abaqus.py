"""Abaqus input files: what is read, and one message for what cannot be."""

import os
from pathlib import Path

import numpy as np
import pytest

import modalprep as mp
from modalprep.cli import main

DATA = Path(os.environ.get("MODALPREP_DATA", Path(__file__).parents[4] / "shared" / "data"))
needs_data = pytest.mark.skipif(not (DATA / "calculix").is_dir(), reason="the folder of foreign decks is not there")
ADVICE = (
    "give masses, springs and directions of beams as properties, rigid links as connections, supports as interfaces"
)
PIPELINE = """
[mesh]
file = "beam.inp"
[materials.steel]
E = 210e9
nu = 0.3
rho = 7800.0
[properties.b]
type = "beam"
material = "steel"
A = 1e-4
Iy = 1e-9
Iz = 1e-9
J = 2e-9
up = [0.0, 0.0, 1.0]
[interfaces.root]
node = 1
"""
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
        ("TYPE=B31", "TYPE=CPE4", "line 15: element type 'CPE4' has no counterpart here"),
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


# ---------------------------------------------------------------- nothing is dropped silently

BEAMS = """*NODE
1, 0, 0, 0
2, 1, 0, 0
3, 2, 0, 0
*ELEMENT, TYPE=B31, ELSET=b
1, 1, 2
2, 2, 3
"""
PART = "*PART, NAME=p\n" + BEAMS + "*END PART\n*ASSEMBLY, NAME=a\n*INSTANCE, NAME=p-1, PART=p\n*END INSTANCE\n"


def test_a_trailing_comma_does_not_swallow_the_next_element(read):
    mesh = read(BEAMS.replace("1, 1, 2\n2, 2, 3\n", "1, 1, 2,\n2, 2, 3,\n"))
    assert mesh.cells["line"].tolist() == [[0, 1], [1, 2]]


@needs_data
def test_every_element_of_a_deck_with_trailing_commas_is_read():
    mesh = mp.read_mesh(DATA / "calculix" / "dloadlinIf.inp", "mm")
    assert len(mesh.cells["hexahedron"]) == 15  # lines of its *ELEMENT block
    steel = mp.Material(E=209e9, nu=0.3, rho=7850.0)
    model = mp.assemble(mesh, {"elall": mp.Solid(material=steel)}, {"left": mp.Interface(group="left")})
    # the incompatible modes of CalculiX are not quite ours
    assert mp.craig_bampton(model, modes=1).table.frequency[0] == pytest.approx(9.586253, rel=1e-3)
    assert mesh.notes == (
        "left out: 15 extra nodes in *ELEMENT, TYPE=C3D8I (first in line 197), 1 *BOUNDARY (line 222); " + ADVICE,
    )


def test_an_element_over_three_lines_and_a_keyword_over_two(read):
    mesh = read(DECK.replace("1, 10, 20,\n30, 40", "1, 10,\n20,\n30, 40,").replace("s4r, ELSET", "s4r,\n ELSET"))
    assert mesh.cells["quad"].tolist() == [[0, 1, 2, 3]]
    assert set(mesh.groups["skin"]) == {"quad", "triangle"}


def test_keywords_with_mass_stiffness_or_constraints_are_counted(read):
    """Also a keyword that nobody knows; sections, materials and the loads of a step are not counted."""
    text = BEAMS + "*BEAM SECTION, ELSET=b\n*MATERIAL, NAME=m\n*ELASTIC\n1.,.3\n*MASS, ELSET=b\n5.\n"
    text += "*MPC\nBEAM, 3, 2\n*BOUNDARY\n1, 1, 6\n*MPC\nBEAM, 1, 2\n*FOO\n"
    text += "*STEP\n*STATIC\n*CLOAD\n3, 1, 1.\n*BOUNDARY\n3, 1\n*END STEP\n*Tie, name=t\n"
    assert read(text).notes == (
        "left out: 2 *MPC (first in line 14), 2 *BOUNDARY (first in line 16), 1 *MASS (line 12), 1 *FOO (line 20), "
        "1 *TIE (line 28); " + ADVICE,
    )


def test_nodes_beyond_those_of_the_element_are_counted(read):
    mesh = read(BEAMS.replace("1, 1, 2\n", "1, 1, 2, 3\n"))
    assert mesh.cells["line"].tolist() == [[0, 1], [1, 2]]
    assert mesh.notes == ("left out: 1 extra nodes in *ELEMENT, TYPE=B31 (line 6); " + ADVICE,)


def test_what_was_left_out_reaches_the_user(tmp_path, capsys):
    (tmp_path / "beam.inp").write_text(BEAMS + "*MPC\nBEAM, 3, 2\n")
    (tmp_path / "beam.toml").write_text(PIPELINE)
    assert main(["modes", str(tmp_path / "beam.toml")]) == 0
    printed = capsys.readouterr()
    assert "left out: 1 *MPC (line 8)" in " ".join((printed.out + printed.err).split())


def test_one_part_with_one_instance_is_read(read):
    mesh = read(PART.replace("PART=p\n*END INST", "PART=p\n0., 0., 0.\n*END INST") + "*NSET, NSET=r, INSTANCE=p-1\n1\n")
    assert mesh.nodes("r").tolist() == [0]
    assert mesh.notes == ()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (PART + "*INSTANCE, NAME=p-2, PART=p\n*END INSTANCE\n", "line 13: the deck has several instances; export it"),
        (PART.replace("*END INST", "0., 0., 1.\n*END INST"), "line 11: the instance is moved from where its part lies"),
        (PART + "*NODE\n1, 5, 0, 0\n", "line 14: node 1 of the assembly has the number of a node of the part"),
        (PART + "*NODE\n1, 0, 0, 0\n", "line 14: node 1 of the assembly has the number of a node of the part"),
        (PART + "*ELSET, ELSET=b\n2\n", "line 13: *ELSET has the name b of a set of the part"),
        (BEAMS + "*NODE\n3, 5, 0, 0\n", "line 9: node 3 is there twice and differs"),
        (BEAMS + "*ELEMENT, TYPE=T3D2\n2, 1, 3\n", "line 9: element 2 is there twice and differs"),
        (BEAMS.replace("*NODE", "*NODE, SYSTEM=C"), "line 1: *NODE gives coordinates in axes of its own"),
        ("*SYSTEM\n0., 0., 1.\n" + BEAMS, "line 1: *SYSTEM gives coordinates in axes of its own"),
        (BEAMS + "*NGEN\n1, 3, 1\n", "line 8: *NGEN makes what the file does not list; export every node"),
        (BEAMS + "*ELGEN, ELSET=b\n1, 2, 1, 1\n", "line 8: *ELGEN makes what the file does not list"),
        (BEAMS + "*ELCOPY, OLD SET=b, ELEMENT SHIFT=9\n", "line 8: *ELCOPY makes what the file does not list"),
        (BEAMS + "*NODE, INPUT=more.txt\n", "line 8: *NODE has INPUT=more.txt, another file"),
        (BEAMS + "*NSET, NSET=n, ELSET=b\n", "line 8: *NSET takes the nodes of ELSET=b; list their numbers"),
        (BEAMS + "*NSET\n1\n", "line 8: *NSET has no name"),
        (BEAMS + "*NSET, NSET=n\nALL\n", "set 'n' names 'ALL', which is no number and no set of the file"),
    ],
    ids=range(16),
)
def test_what_would_be_read_wrongly_is_refused(read, text, words):
    with pytest.raises(mp.InputError) as caught:
        read(text)
    assert words in str(caught.value)


def test_names_of_sets_do_not_depend_on_capitals(read):
    """As in Abaqus; the group keeps the spelling that came first."""
    mesh = read(DECK.replace("skin, 3", "SKIN, 3").replace("TYPE=B31, ELSET=bar", "TYPE=B31, ELSET=Skin"))
    assert {kind: len(rows) for kind, rows in mesh.groups["skin"].items()} == {"quad": 1, "triangle": 1, "line": 1}
    assert set(mesh.groups["every"]) == {"quad", "triangle", "line"}
    assert "Skin" not in mesh.groups
    assert read(BEAMS + "*NSET, NSET=root\n1\n*NSET, NSET=ROOT\n3\n").nodes("root").tolist() == [0, 2]


def test_masses_and_springs_without_values_are_noted(tmp_path):
    """Their keywords are skipped: a point mass of 5 kg would be lost without a word."""
    text = BEAMS + "*ELEMENT, TYPE=MASS, ELSET=m\n98, 1\n*ELEMENT, TYPE=SPRINGA, ELSET=s\n99, 1, 2\n"
    path = tmp_path / "deck.inp"
    path.write_text(text)
    line = text[: text.index("*ELEMENT, TYPE=MASS")].count("\n") + 1
    rest = "have mass or stiffness only by a property of that set, 'mass' or 'spring'"
    assert mp.read_mesh(path).notes == (
        f"elements: 1 of TYPE=MASS in set m (line {line}) {rest}",
        f"elements: 1 of TYPE=SPRINGA in set s (line {line + 2}) {rest}",
    )
