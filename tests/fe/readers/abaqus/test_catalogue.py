"""A catalogue of small Abaqus and CalculiX decks, one for each keyword or trap: geometry, sets and spellings."""

import numpy as np
import pytest

import modalprep as mp

BAR = "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 2, 0, 0\n*ELEMENT, TYPE=T3D2, ELSET=bar\n1, 1, 2\n2, 2, 3\n"


# ---------------------------------------------------------------- spellings: all are the same two bars

SPELLINGS = {
    "lower case": BAR.lower().replace("elset=bar", "elset=bar"),
    "blanks": BAR.replace(", ", "  ,\t ").replace("*NODE", "*NODE  ").replace("TYPE=", "TYPE = "),
    "empty lines": BAR.replace("\n", "\n\n   \n"),
    "comments": BAR.replace("\n", "\n** a comment, with *KEYWORD\n"),
    "Windows line ends": BAR.replace("\n", "\r\n"),
    "old Macintosh line ends": BAR.replace("\n", "\r"),
    "byte-order mark": "\ufeff" + BAR,
    "commas at the end": BAR.replace("\n", ",\n").replace("*NODE,", "*NODE").replace("=bar,", "=bar"),
    "a comma at the end of a keyword": BAR.replace("=bar\n", "=bar,\n"),
    "a keyword that goes on": BAR.replace("TYPE=T3D2, ", "TYPE=T3D2,\n   "),
    "a keyword that goes on twice": BAR.replace("*ELEMENT, TYPE=T3D2, ", "*ELEMENT,\nTYPE=T3D2,\n   "),
    "an element that goes on": BAR.replace("1, 1, 2\n2, 2, 3", "1,\n1,\n2\n2, 2,\n3"),
    "exponents of Fortran": BAR.replace("3, 2, 0", "3, 2.D0, 0.d+00"),
    "missing coordinates": BAR.replace("3, 2, 0, 0", "3, 2"),
    "blank coordinates": BAR.replace("3, 2, 0, 0", "3, 2,,"),
    "quotes": BAR.replace("ELSET=bar", 'ELSET="bar"'),
    "no line end": BAR.rstrip(),
    "text before the first keyword": "a deck by somebody\n" + BAR,
    "two blocks": BAR.replace("2, 2, 3", "*ELEMENT, TYPE=T3D2, ELSET=BAR\n2, 2, 3"),
    "a set of its own": BAR.replace(", ELSET=bar", "") + "*ELSET, ELSET=bar, GENERATE\n1, 2\n",
    "a set that names what is not there": BAR.replace(", ELSET=bar", "") + "*ELSET, ELSET=bar\n1, 2, 7\n",
    "nodes listed twice, the same": BAR + "*NODE\n2, 1., 0., 0.\n",
    "a part without an instance": "*PART, NAME=p\n" + BAR + "*END PART\n",
    "a part with an instance": (
        "*PART, NAME=p\n"
        + BAR
        + "*END PART\n*ASSEMBLY, NAME=a\n*INSTANCE, NAME=i, PART=P\n*END INSTANCE\n*END ASSEMBLY\n"
    ),
    "content inside the instance": (
        "*PART, NAME=p\n*END PART\n*ASSEMBLY, NAME=a\n*INSTANCE, NAME=i, PART=p\n"
        + BAR
        + "*END INSTANCE\n*END ASSEMBLY\n"
    ),
}


@pytest.mark.parametrize("text", SPELLINGS.values(), ids=SPELLINGS)
def test_every_spelling_is_the_same_mesh(text, tmp_path):
    path = tmp_path / "deck.inp"
    path.write_bytes(text.encode())
    mesh = mp.read_mesh(path)
    assert mesh.points.tolist() == [[0, 0, 0], [1, 0, 0], [2, 0, 0]]
    assert mesh.cells["line"].tolist() == [[0, 1], [1, 2]]
    assert mesh.labels.tolist() == [1, 2, 3]
    assert mesh.groups["bar"]["line"].tolist() == [0, 1]


# ---------------------------------------------------------------- included files


def test_included_files(tmp_path):
    """One beside the deck, one that it includes from its own folder, and data of a keyword."""
    (tmp_path / "more").mkdir()
    (tmp_path / "more" / "elements.inp").write_text(
        "*INCLUDE, INPUT=sets.inp\n*ELEMENT, TYPE=T3D2, ELSET=bar\n1, 1, 2\n"
    )
    (tmp_path / "more" / "sets.inp").write_text("*NSET, NSET=ends\n1, 3\n")
    (tmp_path / "nodes.txt").write_text("2, 1, 0, 0\n3, 2, 0, 0\n")
    deck = tmp_path / "deck.inp"
    deck.write_text("*NODE\n1, 0, 0, 0\n*INCLUDE, INPUT=nodes.txt\n*Include, input=more/elements.inp\n2, 2, 3\n")
    mesh = mp.read_mesh(deck)
    assert mesh.points[:, 0].tolist() == [0, 1, 2]
    assert mesh.cells["line"].tolist() == [[0, 1], [1, 2]]
    assert mesh.nodes("ends").tolist() == [0, 2]
    before = mesh.sha256
    (tmp_path / "more" / "sets.inp").write_text("*NSET, NSET=ends\n1, 2\n")
    assert mp.read_mesh(deck).sha256 != before  # a body made of the deck is out of date


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("*INCLUDE, INPUT=deck.inp\n", "line 8: *INCLUDE includes deck.inp, which includes itself"),
        ("*INCLUDE, INPUT=none.inp\n", "line 8: *INCLUDE names the file none.inp, which is not there"),
        ("*INCLUDE, INPUT=other.inp\n", "other.inp, line 2: node 9 is 'x', which is no number"),
        ("*ELSET, ELSET=e, INPUT=other.inp\n", "which is no number and no set of the file"),
    ],
)
def test_included_files_that_cannot_be_read(text, words, tmp_path):
    (tmp_path / "other.inp").write_text("*NODE\n9, x\n".replace("9, x", "9, x, 0") if "other" in words else "a, b\n")
    (tmp_path / "deck.inp").write_text(BAR + text)
    with pytest.raises(mp.InputError) as caught:
        mp.read_mesh(tmp_path / "deck.inp")
    assert words.replace("node 9", "coordinate 1 of node 9") in str(caught.value)


# ---------------------------------------------------------------- nodes

R2 = 0.5**0.5
NODES = {
    "cylindrical": ("*NODE, SYSTEM=C\n1, 2, 90, 5\n2, 1, 180, 0\n", [[0, 2, 5], [-1, 0, 0]]),
    "spherical": ("*NODE, SYSTEM=S\n1, 2, 90, 0\n2, 2, 0, 90\n", [[0, 2, 0], [0, 0, 2]]),
    "axes of their own": (
        "*SYSTEM\n1, 0, 0, 1, 1, 0\n0, 0, 0\n*NODE\n1, 0, 0, 0\n2, 2, 3, 4\n", [[1, 0, 0], [-2, 2, 4]]
    ),
    "axes by a direction in the plane": (
        "*SYSTEM\n1, 0, 0, 1, 1, 0\n*NODE\n1, 0, 0, 0\n2, 2, 3, 4\n", [[1, 0, 0], [-2, 2, 4]]
    ),
    "axes that end": (
        "*SYSTEM\n1, 0, 0, 1, 1, 0\n*NODE\n1, 0, 0, 0\n*SYSTEM\n*NODE\n2, 2, 3, 4\n", [[1, 0, 0], [2, 3, 4]]
    ),
    "a line": ("*NODE\n1, 0, 0, 0\n9, 4, 8, 0\n*NGEN\n1, 9, 4\n", [[0, 0, 0], [2, 4, 0], [4, 8, 0]]),
    "an arc": (
        "*NODE\n1, 1, 0, 0\n3, 0, 1, 0\n*NGEN, LINE=C\n1, 3, 1, , 0, 0, 0\n", [[1, 0, 0], [R2, R2, 0], [0, 1, 0]]
    ),
    "an arc about a node": (
        "*NODE\n1, 1, 0, 0\n3, 0, 1, 0\n7, 0, 0, 0\n*NGEN, LINE=C\n1, 3, 1, 7\n",
        [[1, 0, 0], [R2, R2, 0], [0, 1, 0], [0, 0, 0]],
    ),
    "half a circle": (
        "*NODE\n1, 1, 0, 0\n3, -1, 0, 0\n*NGEN, LINE=C\n1, 3, 1, , 0, 0, 0, 0, 0, -1\n",
        [[1, 0, 0], [0, -1, 0], [-1, 0, 0]],
    ),
    "a parabola": (
        "*NODE\n1, 1, 0, 0\n9, 3, 0, 0\n*NGEN, LINE=P\n1, 9, 2, , 2, 1, 0\n",  # y = (x - 1) (3 - x)
        [[1, 0, 0], [1.5, 0.75, 0], [2, 1, 0], [2.5, 0.75, 0], [3, 0, 0]],
    ),
    "rows between two": (
        "*NODE, NSET=a\n1, 0, 0, 0\n2, 1, 0, 0\n*NODE, NSET=b\n21, 0, 2, 0\n22, 1, 2, 0\n*NFILL\na, b, 2, 10\n",
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 2, 0], [1, 2, 0]],
    ),
    "no row between two": (
        "*NODE, NSET=a\n1, 0, 0, 0\n*NODE, NSET=b\n21, 0, 2, 0\n*NFILL\na, b, 1, 10\n", [[0, 0, 0], [0, 2, 0]]
    ),
    "copies": (
        "*NODE, NSET=a\n1, 1, 0, 0\n*NCOPY, OLD SET=a, CHANGE NUMBER=1, SHIFT\n0, 1, 0\n0, 0, 0, 0, 0, 1, 90\n",
        [[1, 0, 0], [-1, 1, 0]],
    ),
    "a row in steps of one": ("*NODE\n1, 0, 0, 0\n3, 4, 8, 0\n*NGEN\n1, 3\n", [[0, 0, 0], [2, 4, 0], [4, 8, 0]]),
    "an arc about a point": (
        "*NODE\n1, 3, 1, 0\n3, 1, 3, 0\n*NGEN, LINE=C\n1, 3, 1, , 1, 1, 0\n",
        [[3, 1, 0], [1 + 2 * R2, 1 + 2 * R2, 0], [1, 3, 0]],
    ),
    "copies about a line beside": (
        "*NODE, NSET=a\n1, 3, 0, 0\n*NCOPY, OLD SET=a, CHANGE NUMBER=1, SHIFT\n0, 0, 0\n1, 0, 0, 1, 0, 2, 90\n",
        [[3, 0, 0], [1, 2, 0]],
    ),
    "copies without a turn": (
        "*NODE, NSET=a\n1, 1, 0, 0\n*NCOPY, OLD SET=a, CHANGE NUMBER=1, SHIFT\n0, 1, 0\n", [[1, 0, 0], [1, 1, 0]]
    ),
}  # fmt: skip


@pytest.mark.parametrize(("text", "points"), NODES.values(), ids=NODES)
def test_nodes(read, text, points):
    mesh = read(text + "*NODE\n98, 0, 0, 0\n99, 1, 0, 0\n*ELEMENT, TYPE=T3D2\n1, 98, 99\n")
    np.testing.assert_allclose(mesh.points[:-2], points, atol=1e-15)


def test_nodes_of_a_generated_row_are_a_set(read):
    assert read(BAR + "*NGEN, NSET=row\n1, 3, 1\n").nodes("row").tolist() == [0, 1, 2]


# ---------------------------------------------------------------- elements that are made


def test_rows_columns_and_layers(read):
    """Two by three by two bricks of unit size, as numbers and as volumes."""
    lines = [f"{1 + i + 10 * j + 100 * k}, {i}, {j}, {k}\n" for k in range(3) for j in range(4) for i in range(3)]
    deck = "*NODE\n" + "".join(lines) + "*ELEMENT, TYPE=C3D8\n1, 1, 2, 12, 11, 101, 102, 112, 111\n"
    mesh = read(deck + "*ELGEN, ELSET=all\n1, 2, 1, 1, 3, 10, 2, 2, 100, 6\n")
    centres = mesh.points[mesh.cells["hexahedron"]].mean(axis=1)
    assert sorted(map(tuple, centres)) == sorted(
        (i + 0.5, j + 0.5, k + 0.5) for i in range(2) for j in range(3) for k in range(2)
    )
    assert len(mesh.groups["all"]["hexahedron"]) == 12


def test_copies_of_elements(read):
    deck = BAR + "*NSET, NSET=n\n1, 2, 3\n*NCOPY, OLD SET=n, CHANGE NUMBER=10, SHIFT\n0, 1, 0\n"
    mesh = read(deck + "*ELCOPY, OLD SET=bar, ELEMENT SHIFT=10, SHIFT NODES=10, NEW SET=other\n")
    assert mesh.points[mesh.cells["line"][mesh.groups["other"]["line"]]].mean(axis=1).tolist() == [
        [0.5, 1, 0],
        [1.5, 1, 0],
    ]


def test_collapsed_bricks_and_quads(read):
    """A brick with an edge of no length is a wedge, with an upper face of none a pyramid, such a quad a triangle."""
    nodes = "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n5, 0, 0, 1\n6, 1, 0, 1\n7, 0, 1, 1\n"
    mesh = read(nodes + "*ELEMENT, TYPE=C3D8\n1, 1, 2, 3, 3, 5, 6, 7, 7\n*ELEMENT, TYPE=S4\n2, 1, 2, 3, 3\n"
                "*ELEMENT, TYPE=C3D8\n3, 1, 2, 6, 5, 3, 3, 3, 3\n")  # fmt: skip
    assert mesh.cells["pyramid"].tolist() == [[0, 1, 4, 3, 2]]
    assert mesh.cells["wedge"].tolist() == [[0, 1, 2, 3, 4, 5]]
    assert mesh.cells["triangle"].tolist() == [[0, 1, 2]]


def test_second_order_lines_are_two_straight_ones(read):
    mesh = read("*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 2, 0, 0\n*ELEMENT, TYPE=B32, ELSET=b\n1, 1, 2, 3\n")
    assert mesh.cells["line"].tolist() == [[0, 1], [1, 2]]
    assert mesh.groups["b"]["line"].tolist() == [0, 1]


# ---------------------------------------------------------------- parts

PART = "*PART, NAME=p\n" + BAR + "*NSET, NSET=end\n3\n*END PART\n*ASSEMBLY, NAME=a\n"
TWO = PART + (
    "*INSTANCE, NAME=left, PART=p\n*END INSTANCE\n"
    "*INSTANCE, NAME=right, PART=p\n0, 5, 0\n0, 5, 0, 0, 5, 1, 90\n*END INSTANCE\n"
)


def test_instances_are_shifted_then_turned(read):
    mesh = read(TWO)
    np.testing.assert_allclose(mesh.points[mesh.nodes("right.end")], [[0, 7, 0]], atol=1e-15)
    np.testing.assert_allclose(mesh.points[mesh.nodes("left.end")], [[2, 0, 0]])
    assert set(mesh.groups) == {"left.bar", "right.bar", "left.end", "right.end"}


def test_a_turn_about_an_axis_beside(read):
    """From Abaqus' own rule: the shift first, then the turn about the line between two points of the assembly."""
    mesh = read(PART + "*INSTANCE, NAME=i, PART=p\n1, 0, 0\n0, 0, 0, 0, 0, 1, 90\n*END INSTANCE\n")
    np.testing.assert_allclose(mesh.points, [[0, 1, 0], [0, 2, 0], [0, 3, 0]], atol=1e-15)


def test_instances_that_share_numbers_are_numbered_apart(read):
    mesh = read(TWO)
    assert mesh.labels.tolist() == [11, 12, 13, 21, 22, 23]
    assert mesh.notes == ("instances share numbers of nodes: to those of each is added left 10, right 20",)


def test_sets_of_the_assembly(read):
    more = "*NODE\n1, 9, 9, 9\n*NSET, NSET=ends, INSTANCE=left\n1\n*NSET, NSET=ends, INSTANCE=right\n1\n"
    more += "*NSET, NSET=tips\nleft.end, right.3, 1\n"
    more += "*ELSET, ELSET=bars, INSTANCE=right\nbar\n*ELSET, ELSET=bars\nleft.bar\n"
    mesh = read(TWO + more + "*END ASSEMBLY\n")
    assert mesh.points[mesh.nodes("ends")].round(9).tolist() == [[0, 0, 0], [0, 5, 0]]
    assert mesh.points[mesh.nodes("tips")].round(9).tolist() == [[9, 9, 9], [2, 0, 0], [0, 7, 0]]
    assert sorted(mesh.groups["bars"]["line"].tolist()) == [0, 1, 2, 3]


def test_a_set_of_the_assembly_with_the_name_of_one_of_the_part(read):
    one = PART + "*INSTANCE, NAME=i, PART=p\n*END INSTANCE\n*NSET, NSET=end, INSTANCE=i\n1\n"
    mesh = read(one)
    assert (mesh.nodes("end").tolist(), mesh.nodes("i.end").tolist()) == ([0], [2])


def test_nodes_of_elements_are_a_set(read):
    assert read(BAR + "*ELSET, ELSET=second\n2\n*NSET, NSET=n, ELSET=second\n").nodes("n").tolist() == [1, 2]


def test_internal_sets_are_no_groups(read):
    assert "_s" not in read(BAR + "*NSET, NSET=_s, INTERNAL\n1\n").groups


# ---------------------------------------------------------------- what is refused

REFUSED = {
    "no system": ("*NODE, SYSTEM=X\n9, 1, 2, 3\n", "*NODE has SYSTEM=X; known are R, C and S"),
    "a row that does not end": ("*NGEN\n1, 3, 4\n", "the numbers from 1 to 3 are not reached in steps of 4"),
    "an arc without a plane": ("*NGEN, LINE=C\n1, 3, 1, , 1, 0, 0\n", "the arc is a half circle or has no radius"),
    "rows of unlike sets": (
        "*NSET, NSET=a\n1, 2\n*NSET, NSET=b\n3\n*NFILL\na, b, 2, 10\n", "line 13: fills between 2 and 1 nodes"
    ),
    "uneven rows": ("*NFILL, BIAS=2\n1, 3, 2, 10\n", "*NFILL fills unevenly"),
    "mirrored nodes": ("*NCOPY, OLD SET=bar, CHANGE NUMBER=1, REFLECT=LINE\n", "only SHIFT is read"),
    "elements without nodes": ("*ELGEN\n1, 3, 1, 1\n", "element 3 needs node 4, which is not there"),
    "too many elements": ("*ELGEN\n1, 100000, 1, 1, 100000, 1, 1\n", "elements cannot be made"),
    "a first element that is not there": ("*ELGEN\n8, 3, 1, 1\n", "element 8 is not there; list it before"),
    "an element on one node": ("*ELEMENT, TYPE=T3D2\n9, 1, 1\n", "element 9 names a node twice"),
    "an unknown type": ("*ELEMENT, TYPE=U2\n9, 1, 2\n", "element type 'U2' has no counterpart here"),
    "plane beams": ("*ELEMENT, TYPE=B21\n9, 1, 2\n", "element type 'B21' has no counterpart here"),
    "no type": ("*ELEMENT\n9, 1, 2\n", "*ELEMENT has no TYPE; add TYPE="),
    "an unknown instance": ("*NSET, NSET=n, INSTANCE=i\n1\n", "names the instance i, which is not in the deck"),
    "a part twice": ("*PART, NAME=p\n*END PART\n*PART, NAME=p\n*END PART\n", "has the name p of another part"),
    "an imported instance": ("*INSTANCE, LIBRARY=old, NAME=i, PART=p\n", "imports the result of another analysis"),
    "axes on one line": ("*SYSTEM\n0, 0, 0, 1, 0, 0\n2, 0, 0\n", "points on one line, which give no axes"),
    "a number that is none": ("*NODE\nnine, 0, 0, 0\n", "node 'nine, 0, 0, 0' begins with no number"),
}  # fmt: skip


@pytest.mark.parametrize(("more", "words"), REFUSED.values(), ids=REFUSED)
def test_refused(read, more, words):
    with pytest.raises(mp.InputError) as caught:
        read(BAR + more)
    assert words in str(caught.value)
    assert "deck.inp, line " in str(caught.value)


def test_an_instance_of_the_same_name(read):
    with pytest.raises(mp.InputError, match="has the name left of another instance"):
        read(TWO + "*INSTANCE, NAME=LEFT, PART=p\n*END INSTANCE\n".replace("LEFT", "left"))


def test_a_name_of_an_instance_in_capitals_is_the_same(read):
    with pytest.raises(mp.InputError, match="has the name LEFT of another instance"):
        read(TWO + "*INSTANCE, NAME=LEFT, PART=p\n*END INSTANCE\n")


def test_trusses_of_three_nodes_are_two_bars(read):
    mesh = read(BAR.replace("T3D2", "T3D3").replace("1, 1, 2\n2, 2, 3\n", "1, 1, 2, 3\n"))
    assert sorted(map(sorted, mesh.cells["line"].tolist())) == [[0, 1], [1, 2]]


def test_instances_with_numbers_of_two_digits(read):
    text = TWO.replace("1, 0, 0, 0\n", "11, 0, 0, 0\n").replace("1, 1, 2\n", "1, 11, 2\n")
    assert read(text).labels.tolist() == [102, 103, 111, 202, 203, 211]


@pytest.mark.parametrize(
    ("nodes", "corners"),
    [("1, 2, 3, 3", [0, 1, 2]), ("1, 2, 3, 1", [0, 1, 2]), ("1, 1, 3, 4", [0, 2, 3]), ("1, 2, 2, 4", [0, 1, 3])],
)
def test_quads_with_a_node_twice_are_triangles(read, nodes, corners):
    text = f"*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 1, 1, 0\n4, 0, 1, 0\n*ELEMENT, TYPE=S4, ELSET=s\n1, {nodes}\n"
    assert read(text).cells["triangle"].tolist() == [corners]


def test_names_may_hold_a_dot(read):
    """Where no instance is named before it."""
    mesh = read(BAR.replace("ELSET=bar", "ELSET=v1.0") + "*ELSET, ELSET=all\nv1.0\n")
    assert set(mesh.groups) == {"v1.0", "all"}
