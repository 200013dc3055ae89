"""Abaqus input files: what is read, and one message for what cannot be."""

import json

import numpy as np
import pytest

import modalprep as mp
from modalprep.cli import main

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
        ("10, 0, 0, 0", "10, 0, zero, 0", "line 4: coordinate 2 of node 10 is 'zero', which is no number"),
        ("10, 0, 0, 0", "10, 0, nan, 0", "line 4: coordinate 2 of node 10 = nan is not finite"),
        ("TYPE=B31", "TYPE=CONN3D2", "line 15: element type 'CONN3D2' has no counterpart here"),
        ("3, 50, 30", "3, 50", "line 15: element 3, 50 of type B31 needs a number and 2 nodes"),
        ("3, 50, 30", "3, 50, 31", "line 15: element 3 refers to node 31, which is not there"),
        ("skin, 3", "skin, every", "set 'every' contains itself"),
        ("1, 3, 2", "1, 3, 0", "GENERATE needs first, last and step"),
        ("*Heading", "*INSTANCE, NAME=b-1, PART=b", "line 2: *INSTANCE is one of part 'b', which is not before it"),
        ("*Heading", "*INCLUDE, INPUT=more.inp", "line 2: *INCLUDE names the file more.inp, which is not there"),
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


def test_a_trailing_comma_does_not_swallow_the_next_element(read):
    mesh = read(BEAMS.replace("1, 1, 2\n2, 2, 3\n", "1, 1, 2,\n2, 2, 3,\n"))
    assert mesh.cells["line"].tolist() == [[0, 1], [1, 2]]


def test_an_element_over_three_lines_and_a_keyword_over_two(read):
    mesh = read(DECK.replace("1, 10, 20,\n30, 40", "1, 10,\n20,\n30, 40,").replace("s4r, ELSET", "s4r,\n ELSET"))
    assert mesh.cells["quad"].tolist() == [[0, 1, 2, 3]]
    assert set(mesh.groups["skin"]) == {"quad", "triangle"}


def test_unknown_keywords_are_counted_and_loads_of_steps_are_not(read):
    text = BEAMS + "*FOO\n1, 2\n*BEAM FOO\n*FOO\n*STEP\n*STATIC\n*CLOAD\n3, 1, 1.\n*END STEP\n"
    (note,) = read(text).notes
    assert note.startswith("left out: 2 *FOO (first in line 8), 1 *BEAM FOO (line 10); ")


def test_nodes_beyond_those_of_the_element_are_counted(read):
    mesh = read(BEAMS.replace("B31", "T3D2").replace("1, 1, 2\n", "1, 1, 2, 3\n"))
    assert mesh.cells["line"].tolist() == [[0, 1], [1, 2]]
    assert mesh.notes[0].startswith("left out: 1 extra nodes in *ELEMENT, TYPE=T3D2 (line 6); ")


def test_what_was_left_out_reaches_the_user(tmp_path, capsys):
    (tmp_path / "beam.inp").write_text(BEAMS + "*FOO\n")
    (tmp_path / "beam.toml").write_text(PIPELINE)
    assert main(["modes", str(tmp_path / "beam.toml")]) == 0
    printed = capsys.readouterr()
    assert "left out: 1 *FOO (line 8)" in " ".join((printed.out + printed.err).split())


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (BEAMS + "*NODE\n3, 5, 0, 0\n", "line 9: node 3 is there twice and differs"),
        (BEAMS + "*ELEMENT, TYPE=T3D2\n2, 1, 3\n", "line 9: element 2 is there twice and differs"),
        (BEAMS + "*NODE, INPUT=more.txt\n", "line 8: *NODE names the file more.txt, which is not there"),
        (BEAMS + "*NSET\n1\n", "line 8: *NSET has no NSET"),
        (BEAMS + "*NSET, NSET=n\nALL\n", "set 'n' names 'ALL', which is no number and no set of the file"),
    ],
    ids=range(5),
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


def test_masses_and_springs_without_values_are_noted(read):
    """A point mass would be lost without a word."""
    rest = "have no mass or stiffness, because no keyword of the deck gives it"
    mesh = read(BEAMS + "*ELEMENT, TYPE=MASS, ELSET=m\n98, 1\n*ELEMENT, TYPE=SPRINGA, ELSET=s\n99, 1, 2\n")
    assert mesh.notes[0].startswith(f"1 elements of TYPE=MASS {rest}")
    assert mesh.notes[1].startswith(f"1 elements of TYPE=SPRINGA {rest}")


# ---------------------------------------------------------------- notes where they explain

APART = BEAMS + "*NODE\n8, 0, 1, 0\n9, 1, 1, 0\n*ELEMENT, TYPE=B31, ELSET=b\n3, 8, 9\n*MPC\nBEAM, 8, 1\n"
APART += "*BEAM SECTION, ELSET=b, MATERIAL=m, SECTION=RECT\n.01, .01\n"
APART += "*MATERIAL, NAME=m\n*ELASTIC\n2e11, .3\n*DENSITY\n7800.\n"


def test_a_refusal_tells_what_the_reader_left_out(read, tmp_path, capsys):
    """The rigid beam that is ignored is why the structure is in two parts."""
    mesh = read(APART, "m")
    root = {"root": mp.Interface(node=1)}
    assert mp.assemble(mesh, {}, root).notes == ()
    (tmp_path / "deck.toml").write_text(
        '[mesh]\nfile = "deck.inp"\nignore = ["*MPC"]\n[interfaces.root]\nnode = 1\n[reduction]\nmodes = 2\n'
    )
    assert main(["modes", str(tmp_path / "deck.toml")]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "the structure is in 2 disconnected parts" in said
    assert "(of deck.inp its reader noted: ignored: 1 *MPC)" in said


def test_quality_prints_the_notes(tmp_path, capsys):
    (tmp_path / "deck.inp").write_text(APART + "*FOO\n")
    assert main(["quality", str(tmp_path / "deck.inp")]) == 0
    assert "note: left out: 1 *FOO (line 22)" in " ".join(capsys.readouterr().out.split())
    assert main(["quality", str(tmp_path / "deck.inp"), "--json"]) == 0
    assert "left out: 1 *FOO" in json.loads(capsys.readouterr().out)["notes"][0]


def test_a_deck_runs_with_file_unit_interfaces_and_reduction(tmp_path, capsys):
    """The first bending of a cantilever of a round bar, 1.875104^2 / (2 pi) sqrt(E I / (rho A L^4)), in mm, t and s."""
    n = 20
    deck = "*NODE\n" + "".join(f"{k + 1}, {1000 * k / n}, 0, 0\n" for k in range(n + 1))
    deck += f"*ELEMENT, TYPE=B33, ELSET=b\n1, 1, 2\n*ELGEN, ELSET=b\n1, {n}, 1, 1\n"
    deck += "*BEAM SECTION, ELSET=b, MATERIAL=m, SECTION=CIRC\n5.\n"
    deck += "*MATERIAL, NAME=m\n*ELASTIC\n2.1e5, .3\n*DENSITY\n7.8e-9\n"
    (tmp_path / "rod.inp").write_text(deck)
    lines = '[mesh]\nfile = "rod.inp"\nlength_unit = "mm"\nmass_unit = "t"\n'
    lines += "[interfaces.root]\nnode = 1\n[reduction]\nmodes = 2\n"
    (tmp_path / "rod.toml").write_text(lines + "[output]\npictures = 0\n")
    assert main(["run", str(tmp_path / "rod.toml"), "--json", "--no-report"]) == 0
    files = json.loads(capsys.readouterr().out)["files"]
    body = mp.read_body(next(file for file in files if file.endswith(".h5")))
    expected = 1.875104**2 / (2 * np.pi) * np.sqrt(2.1e11 * 0.005**2 / 4 / 7800.0)
    assert body.frequency[0] == pytest.approx(expected, rel=1e-4)  # rotary inertia: (pi^2 / 2) (r / L)^2 of 6e-6
