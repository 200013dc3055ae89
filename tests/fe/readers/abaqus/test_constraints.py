"""Couplings, ties, equations and supports of small decks, against closed forms."""

import numpy as np
import pytest
from fe.abaqus_decks import BEAM, CUBE, NU, SECTION, STEEL, E, displacements
from structured import box

import modalprep as mp
from modalprep.errors import InputError
from modalprep.fe.mesh.nearest_face import nearest


@pytest.fixture
def static(read):
    return lambda text, loads: displacements(read(text), loads)


# ---------------------------------------------------------------- constraints


@pytest.mark.parametrize(
    ("text", "components"),
    [("*KINEMATIC\n", "123456"), ("*KINEMATIC\n1, 3\n", "123"), ("*KINEMATIC\n2\n4, 5\n", "245")],
)
def test_kinematic_couplings(read, text, components):
    more = "*NODE\n9, 2, 2, 2\n*SURFACE, NAME=top\nc, S2\n*COUPLING, CONSTRAINT NAME=k, REF NODE=9, SURFACE=top\n"
    (link,) = read(CUBE + STEEL + more + text).links
    assert (link.kind, link.node, sorted(link.nodes.tolist())) == ("rbe2", 8, [4, 5, 6, 7])
    assert "".join(str(c + 1) for c in np.flatnonzero(link.components)) == components


def test_distributing_couplings(static):
    """The reference node has the mean motion of the face: tension through it is a quarter at each corner."""
    more = "*NODE\n9, .5, .5, 1\n*SURFACE, NAME=top, TYPE=NODE\nn\n*NSET, NSET=n\n5, 6, 7, 8\n"
    more += "*COUPLING, CONSTRAINT NAME=k, REF NODE=9, SURFACE=top\n*DISTRIBUTING\n"
    u = static(CUBE + STEEL + more + "*BOUNDARY\n1, 1, 3\n2, 3\n4, 3\n3, 3\n2, 2\n", {(9, 2): 1000.0})
    np.testing.assert_allclose(u[[4, 5, 6, 7, 8], 2], 1000 / E, rtol=1e-9)


@pytest.mark.parametrize("nodes", [True, False])
def test_distributing_couplings_of_faces_weigh_their_area(static, nodes):
    """The face of a 20-node brick moves as under uniform traction, in CalculiX 2.20 too; a set of nodes does not."""
    points, cells = box("hexahedron20", (1, 1, 1))
    text = "*NODE\n" + "".join(f"{k}, {x}, {y}, {z}\n" for k, (x, y, z) in enumerate(points, 1)) + "21, .5, .5, 1\n"
    numbers = [str(k + 1) for k in cells[0][[*range(12), *range(12, 20)]]]
    text += "*ELEMENT, TYPE=C3D20, ELSET=c\n1, " + ", ".join(numbers[:15]) + ",\n" + ", ".join(numbers[15:]) + "\n"
    top = [str(k + 1) for k in np.flatnonzero(points[:, 2] == 1)]
    text += "*NSET, NSET=n\n" + ", ".join(top) + "\n*SURFACE, NAME=top" + (", TYPE=NODE\nn\n" if nodes else "\nc, S2\n")
    text += STEEL.replace(f"{NU}", "0") + "*SOLID SECTION, ELSET=c, MATERIAL=steel\n"
    text += "*COUPLING, CONSTRAINT NAME=k, REF NODE=21, SURFACE=top\n*DISTRIBUTING\n"
    held = "".join(f"{k + 1}, 1, 3\n" for k in np.flatnonzero(points[:, 2] == 0))
    u = static(text + "*BOUNDARY\n" + held, {(21, 2): 1000.0})
    even = np.ptp(u[[int(k) - 1 for k in top], 2]) < 1e-9 * abs(u[20, 2])
    assert even != nodes
    assert (u[20, 2] == pytest.approx(1000 / E, rel=1e-9)) != nodes


FACES = {
    "S1": {1, 2, 3, 4}, "S2": {5, 6, 7, 8}, "S3": {1, 2, 5, 6}, "S4": {2, 3, 6, 7}, "S5": {3, 4, 7, 8},
    "S6": {1, 4, 5, 8},
}  # fmt: skip


@pytest.mark.parametrize("face", FACES)
def test_faces_of_bricks(read, face):
    """Numbers of the nodes of each face: Abaqus Analysis User's Guide, three-dimensional solid element library."""
    more = f"*NODE\n9, 2, 2, 2\n*SURFACE, NAME=s\n1, {face}\n*COUPLING, REF NODE=9, SURFACE=s\n*KINEMATIC\n"
    mesh = read(CUBE + STEEL + more)
    assert set(mesh.labels[mesh.links[0].nodes].tolist()) == FACES[face]


@pytest.mark.parametrize(
    ("face", "nodes"),
    [("S1", {1, 2, 3, 5, 6, 7}), ("S2", {1, 2, 4, 5, 8, 9}), ("S3", {2, 3, 4, 6, 9, 10}), ("S4", {1, 3, 4, 7, 8, 10})],
)
def test_faces_of_tetrahedra_with_their_middle_nodes(read, face, nodes):
    at = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    at += [tuple(np.mean([at[i], at[j]], axis=0)) for i, j in ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))]
    text = "*NODE\n" + "".join(f"{k}, {x}, {y}, {z}\n" for k, (x, y, z) in enumerate([*at, (5, 5, 5)], 1))
    text += "*ELEMENT, TYPE=C3D10, ELSET=c\n1, " + ", ".join(map(str, range(1, 11))) + "\n"
    mesh = read(text + f"*SURFACE, NAME=s\nc, {face}\n*COUPLING, REF NODE=11, SURFACE=s\n*KINEMATIC\n")
    assert set(mesh.labels[mesh.links[0].nodes].tolist()) == nodes


def test_a_surface_without_faces_is_the_outer_one(read):
    second = "*NODE\n9, 0, 0, 2\n10, 1, 0, 2\n11, 1, 1, 2\n12, 0, 1, 2\n13, 9, 9, 9\n"
    second += "*ELEMENT, TYPE=C3D8, ELSET=c\n2, 5, 6, 7, 8, 9, 10, 11, 12\n"
    mesh = read(CUBE + second + STEEL + "*SURFACE, NAME=s\n2\n*COUPLING, REF NODE=13, SURFACE=s\n*KINEMATIC\n")
    assert set(mesh.labels[mesh.links[0].nodes].tolist()) == set(range(5, 13))


def test_rigid_bodies(read):
    text = CUBE + STEEL + "*NODE\n9, 2, 2, 2\n*NSET, NSET=p\n1, 2\n*NSET, NSET=t\n3\n"
    whole, pinned = read(text + "*RIGID BODY, REF NODE=9, TIE NSET=t, PIN NSET=p\n").links
    assert (whole.nodes.tolist(), whole.components.all()) == ([2], True)
    assert (pinned.nodes.tolist(), pinned.components.tolist()) == ([0, 1], [True] * 3 + [False] * 3)
    (link,) = read(text + "*RIGID BODY, REF NODE=9, ELSET=c\n").links
    assert sorted(link.nodes.tolist()) == list(range(8))


SPAN = BEAM + SECTION + STEEL + "*NODE\n4, 2, 0, 1\n6, 3, 0, 1\n*ELEMENT, TYPE=B31, ELSET=b\n3, 4, 6\n"


def test_a_rigid_beam_carries_rotations(static):
    """The second beam starts an arm of 1 m above the end of the first: its tip follows the end as a rigid body."""
    u = static(SPAN + "*MPC\nBEAM, 4, 3\n*BOUNDARY\n1, ENCASTRE\n", {(3, 4): 100.0})
    slope = 100 * 2 / (E * 0.02 * 0.05**3 / 12)
    assert u[2, 4] == pytest.approx(slope, rel=1e-9)
    np.testing.assert_allclose(u[3, [0, 2]] - u[2, [0, 2]], [slope, 0], atol=1e-9 * slope)


@pytest.mark.parametrize(
    ("kind", "rotates", "held"), [("PIN", False, [0, 1, 2]), ("TIE", True, [0, 1, 2]), ("LINK", False, [2])]
)
def test_pins_ties_and_links(read, kind, rotates, held):
    """PIN: equal translations, TIE: rotations too, also over a distance; LINK: no change of length, here along z."""
    mesh = read(SPAN + f"*MPC\n{kind}, 4, 3\n")
    terms = [(e.nodes.tolist(), e.coefficients) for e in mesh.equations]
    assert all(nodes in ([3, 2], [3, 2, 3, 2]) for nodes, _ in terms)
    rows = np.array([c[0] for _, c in terms])
    np.testing.assert_allclose(np.array([c[1] for _, c in terms]), -rows)
    np.testing.assert_allclose(rows[: len(held)], np.eye(6)[held])
    assert len(terms) == len(held) + 3 * rotates


def test_an_equation_over_lines_and_sets(read):
    text = (
        BEAM
        + SECTION
        + STEEL
        + "*NSET, NSET=a\n2, 3\n*EQUATION\n2\na, 3, 1., 1, 3,\n-2.5\n3\n1, 1, 1., 2, 1, 1.,\n3, 6, 2.\n"
    )
    first, second, third = read(text, "mm", "t").equations
    assert (first.nodes.tolist(), second.nodes.tolist()) == ([1, 0], [2, 0])
    np.testing.assert_allclose(first.coefficients[:, 2], (1, -2.5))
    np.testing.assert_allclose(third.coefficients[2], (0, 0, 0, 0, 0, 2e-3))  # rad, and a displacement in mm


def test_components_in_axes_of_a_node(read):
    """*TRANSFORM: a node on the y axis has e1 = y, e2 = -x about an axis along z."""
    text = CUBE + STEEL + "*NSET, NSET=n\n4\n*TRANSFORM, NSET=n, TYPE=C\n0, 0, 0, 0, 0, 1\n*BOUNDARY\nn, 1\n1, 3\n"
    text += "*EQUATION\n2\n4, 2, 1., 3, 1, 1.\n"
    mesh = read(text)
    held = mesh.supports["boundary"]
    assert mesh.labels[held.nodes].tolist() == [1, 4]
    np.testing.assert_allclose(held.axes, [np.eye(3), [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]], atol=1e-15)
    assert [np.flatnonzero(c).tolist() for c in held.components] == [[2], [0]]
    np.testing.assert_allclose(mesh.equations[0].coefficients[:, :3], [[-1, 0, 0], [1, 0, 0]], atol=1e-15)


WORDS = {
    "1, 6": "6", "1, 2, 4": "234", "1, ENCASTRE": "123456", "1, PINNED": "123", "1, XSYMM": "156", "1, YSYMM": "246",
    "1, ZSYMM": "345", "1, XASYMM": "234", "1, YASYMM": "135", "1, ZASYMM": "126",
    "1, 1, 1\n1, 5": "15", "1, 3, 8": "3456",
}  # fmt: skip


@pytest.mark.parametrize("line", WORDS)
def test_words_and_components_of_supports(read, line):
    held = read(BEAM + SECTION + STEEL + f"*BOUNDARY\n{line}\n").supports["boundary"]
    assert "".join(str(c + 1) for c in np.flatnonzero(held.components[0])) == WORDS[line]


def test_supports_of_the_first_step_count_and_later_ones_do_not(read):
    steps = "*STEP\n*STATIC\n*BOUNDARY{new}\n2, 1\n*END STEP\n*STEP\n*STATIC\n*BOUNDARY\n3, 1\n*END STEP\n"
    text = BEAM + SECTION + STEEL + "*BOUNDARY\n1, 1\n"
    mesh = read(text + steps.format(new=""))
    assert mesh.supports["boundary"].nodes.tolist() == [0, 1]
    assert mesh.nodes("boundary").tolist() == [0, 1]
    assert "supports of steps after the first are left out" in mesh.notes
    assert read(text + steps.format(new=", OP=NEW")).supports["boundary"].nodes.tolist() == [1]
    assert read(text, ignore=["*BOUNDARY"]).supports == {}


# ---------------------------------------------------------------- ties


def block(first, n, low, high, sizes=(1.0, 1.0)):
    """Return nodes and elements of a column of n x n bricks between two heights, numbered from `first`."""
    at = [(i / n * sizes[0], j / n * sizes[1], z) for z in (low, high) for j in range(n + 1) for i in range(n + 1)]
    nodes = "".join(f"{first + k}, {x}, {y}, {z}\n" for k, (x, y, z) in enumerate(at))
    m, layer = n + 1, (n + 1) ** 2
    rows = []
    for j in range(n):
        for i in range(n):
            a = first + i + m * j
            rows.append(
                [first + len(rows), a, a + 1, a + m + 1, a + m, *(layer + k for k in (a, a + 1, a + m + 1, a + m))]
            )
    return f"*NODE\n{nodes}*ELEMENT, TYPE=C3D8, ELSET=c{first}\n" + "".join(", ".join(map(str, r)) + "\n" for r in rows)


def tied(low, high, more=""):
    text = block(1, low, 0, 1) + block(1001, high, 1, 2)
    for first in (1, 1001):
        text += f"*SOLID SECTION, ELSET=c{first}, MATERIAL=steel\n"
    return text + f"*SURFACE, NAME=top\nc1, S2\n*SURFACE, NAME=foot\nc1001, S1\n*TIE, NAME=t{more}\nfoot, top\n" + STEEL


def test_tied_columns_are_one_column(static):
    """A fine column on a coarse one, whose faces hold two by two of it: constant stress passes exactly."""
    text = tied(1, 2) + "*NSET, NSET=base, GENERATE\n1, 4, 1\n*BOUNDARY\nbase, 3\n1, 1, 2\n2, 2\n"
    top = range(1001 + 9, 1001 + 18)
    share = [1, 2, 1, 2, 4, 2, 1, 2, 1]
    u = static(text, {(n, 2): 1000 * s / 16 for n, s in zip(top, share, strict=True)})
    np.testing.assert_allclose(u[-9:, 2], 2 * 1000 / E, rtol=1e-9)


def test_the_weights_of_a_tie_are_those_of_the_place_on_the_face(read):
    mesh = read(tied(1, 2))
    found = {
        int(mesh.labels[e.nodes[0]]): (mesh.labels[e.nodes[1:]].tolist(), -e.coefficients[1:, 0])
        for e in mesh.equations[::3]
    }
    assert len(mesh.equations) == 3 * 9
    assert found[1001][0] == [5]  # a corner lies on a corner
    nodes, weights = found[1005]  # the middle
    assert sorted(nodes) == [5, 6, 7, 8]
    np.testing.assert_allclose(weights, 0.25, rtol=1e-12)


def test_unlike_columns_float_with_six_rigid_motions(read):
    model = mp.assemble(read(tied(2, 3)), {}, {"root": mp.Interface(group="c1")})
    R = model.rigid_body()
    assert abs(model.C.T @ (model.K @ R)).max() < 1e-9 * abs(model.K).max()
    from scipy.linalg import eigvalsh

    mesh = read(tied(2, 3))
    free = mp.assemble(mesh, {}, {"root": mp.Interface(group="c1", kind="rbe3")})
    K, M = ((free.C.T @ A @ free.C).toarray() for A in (free.K, free.M))
    w2 = eigvalsh(K, M)
    assert np.sum(w2 < 1e-6 * w2[-1]) == 6


def test_nodes_off_the_master_are_moved_or_left_free(read):
    near = tied(1, 2).replace("1005, 0.5, 0.5, 1\n", "1005, 0.5, 0.5, 1.02\n")
    mesh = read(near)
    np.testing.assert_allclose(mesh.points[mesh.labels == 1005], [[0.5, 0.5, 1.0]])
    assert any("moved onto the master surface by up to 0.02" in note for note in mesh.notes)
    far = tied(1, 2, ", POSITION TOLERANCE=0.01").replace("1005, 0.5, 0.5, 1\n", "1005, 0.5, 0.5, 1.02\n")
    mesh = read(far)
    assert len(mesh.equations) == 3 * 8
    assert any("1 of 9 nodes lie off the master and are free (1005...)" in note for note in mesh.notes)


# ---------------------------------------------------------------- what is refused

REFUSED = {
    "no such material": (
        "*SHELL SECTION, ELSET=x, MATERIAL=wood\n.1\n*ELEMENT, TYPE=S4, ELSET=x\n9, 1, 2, 3, 4\n",
        "names the material 'wood', which is not in the deck",
    ),
    "no such set": ("*SOLID SECTION, ELSET=d, MATERIAL=steel\n", "'d' is no element and no element set of the deck"),
    "two sections": (
        "*ELSET, ELSET=d\n1\n*SOLID SECTION, ELSET=d, MATERIAL=steel\n", "gives element 1 another section than",
    ),
    "another family": ("*ELSET, ELSET=d\n1\n*SHELL SECTION, ELSET=d, MATERIAL=steel\n.1\n", "has the C3D8 element 1"),
    "a material without constants": ("*MATERIAL, NAME=Steel\n", "Steel has no *ELASTIC, which its section needs"),
    "too few constants": ("*MATERIAL, NAME=x\n*ELASTIC, TYPE=LAMINA\n1., 2.\n", "LAMINA needs 6 constants; it has 2"),
    "an unknown kind": ("*MATERIAL, NAME=x\n*ELASTIC, TYPE=TRACTION\n1., 2.\n", "has TYPE=TRACTION; known are"),
    "an unknown mpc": ("*MPC\nSLIDER, 1, 2, 3\n", "*MPC of type SLIDER is not read; known are BEAM, TIE, PIN, LINK"),
    "a link without length": ("*NODE\n9, 0, 0, 0\n*MPC\nLINK, 1, 9\n", "LINK joins nodes at one place"),
    "unlike sets": ("*NSET, NSET=a\n1, 2, 3\n*NSET, NSET=b\n4, 5\n*MPC\nPIN, a, b\n", "*MPC joins 3 and 2 nodes"),
    "a coupling of no kind": (
        "*SURFACE, NAME=s\nc, S1\n*COUPLING, REF NODE=7, SURFACE=s\n", "is neither *KINEMATIC nor *DISTRIBUTING",
    ),
    "a coupling without its surface": (
        "*COUPLING, REF NODE=7, SURFACE=s\n*KINEMATIC\n", "names the surface 's', which is not in the deck",
    ),
    "kinematic alone": ("*KINEMATIC\n1, 3\n", "*KINEMATIC stands behind no *COUPLING"),
    "weights": (
        "*SURFACE, NAME=s\nc, S1\n*COUPLING, REF NODE=7, SURFACE=s\n*DISTRIBUTING, WEIGHTING METHOD=CUBIC\n",
        "only UNIFORM is read",
    ),
    "no such face": (
        "*SURFACE, NAME=s\nc, S7\n*COUPLING, REF NODE=7, SURFACE=s\n*KINEMATIC\n",
        "uses the face S7 of element 1, which has S1 to S6",
    ),
    "a tie of nothing": ("*TIE, NAME=t\n", "*TIE names no surfaces; give the slave and the master"),
    "a tie to nodes": ("*NSET, NSET=n\n1\n*TIE, NAME=t\nn, n\n", "a surface of *TIE has no nodes or no faces"),
    "an equation cut short": ("*EQUATION\n3\n1, 1, 1., 2, 1\n", "an equation of 3 terms has 5 fields"),
    "no component": ("*BOUNDARY\n1\n", "the line has no component; give such as 1, 3 or ENCASTRE"),
    "components of none": ("*BOUNDARY\n1, 4, 2\n", "the components 4 to 2 are not between 1 and 6"),
    "no such node": ("*BOUNDARY\n77, 1\n", "'77' is no node and no node set of the deck"),
    "a mass on a brick": ("*MASS, ELSET=c\n5.\n", "*MASS of set c has the C3D8 element 1"),
    "contact": (
        "*CONTACT PAIR, INTERACTION=i\na, b\n",
        'It carries constraints that have no counterpart here. Write ignore = ["*CONTACT PAIR"] to leave it out',
    ),
    "rubber": (
        "*MATERIAL, NAME=x\n*HYPERELASTIC, NEO HOOKE\n1., 2.\n", "*HYPERELASTIC is not read. It carries stiffness",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("more", "words"), REFUSED.values(), ids=REFUSED)
def test_refused(read, more, words):
    base = CUBE + (STEEL if "no *ELASTIC" not in words else "")
    with pytest.raises(mp.InputError) as caught:
        read(base + more)
    assert words in str(caught.value)
    assert "deck.inp, line " in str(caught.value)


def test_beams_that_cannot_be(read):
    for old, new, words in (
        ("SECTION=RECT", "SECTION=STAR", "has SECTION=STAR; known are RECT, CIRC"),
        ("SECTION=RECT", "SECTION=BOX", "size 3 of BOX is '', which is no number"),
        ("SECTION=RECT\n.02, .05", "SECTION=BOX\n.1, .1, .05, .05, .05, .05", "make no section (walls that overlap?)"),
        (".02, .05", ".02, -.05", "a size of RECT is not positive"),
        ("0, 1, 0\n", "1, 0, 0\n", "gives element 1 a direction n1 along it"),
    ):
        assert old in SECTION
        with pytest.raises(mp.InputError) as caught:
            read(BEAM + SECTION.replace(old, new) + STEEL)
        assert words in str(caught.value)


# ---------------------------------------------------------------- reference nodes that are held

COUPLED = CUBE + STEEL + "*NODE\n9, .5, .5, 0\n10, .5, .5, 1\n*SURFACE, NAME=foot\nc, S1\n*SURFACE, NAME=top\nc, S2\n"
COUPLED += "*COUPLING, REF NODE=9, SURFACE=foot\n*{kind}\n*BOUNDARY\n9, 1, 6\n"


def test_a_face_is_held_by_its_reference_node(static):
    """Both faces rigid: strain along z only, and P L / A = E (1 - nu) / ((1 + nu)(1 - 2 nu)) u."""
    top = "*COUPLING, REF NODE=10, SURFACE=top\n*KINEMATIC\n"
    u = static(COUPLED.format(kind="KINEMATIC") + top, {(10, 2): 1000.0})
    np.testing.assert_allclose(u[4:8, 2], 1000 * (1 + NU) * (1 - 2 * NU) / (E * (1 - NU)), rtol=1e-9)
    assert np.all(u[:4] == 0)


def test_a_face_is_held_in_its_mean_by_its_reference_node(static):
    """Translations and rotations of the mean vanish, and the face is free to contract: u = P / (E A) / 2 about it."""
    u = static(COUPLED.format(kind="DISTRIBUTING"), {(n, 2): 250.0 for n in (5, 6, 7, 8)})
    np.testing.assert_allclose(u[:4].mean(axis=0), 0, atol=1e-20)
    assert u[1, 0] - u[0, 0] == pytest.approx(-NU * 1000 / E, rel=1e-9)
    assert u[4, 2] - u[0, 2] == pytest.approx(1000 / E, rel=1e-9)


def test_a_node_without_elements_is_held(static):
    """The equation of a node that no element has: what a support holds there, the cube feels."""
    text = CUBE + STEEL + "*NODE\n9, 5, 5, 5\n*EQUATION\n2\n5, 3, 1., 9, 3, -1.\n"
    text += "*BOUNDARY\n1, 1, 3\n2, 3\n4, 3\n3, 3\n2, 2\n9, 3\n"
    u = static(text, {(n, 2): 250.0 for n in (5, 6, 7, 8)})
    assert u[4, 2] == 0
    assert u[6, 2] > 0


def test_a_tie_to_a_large_face_beside_a_small_one(read):
    """The centre of the small face is nearer, but the node lies in the large one."""
    quads = "*NODE\n1, 0, 0, 0\n2, 4, 0, 0\n3, 4, 4, 0\n4, 0, 4, 0\n5, 4.5, 0, 0\n6, 4.5, .5, 0\n7, 4, .5, 0\n"
    quads += "*ELEMENT, TYPE=S4, ELSET=s\n1, 1, 2, 3, 4\n2, 2, 5, 6, 7\n*SHELL SECTION, ELSET=s, MATERIAL=steel\n.01\n"
    bar = "*NODE, NSET=foot\n8, 3.9, .1, 0\n9, 3.9, .1, 1\n*ELEMENT, TYPE=T3D2, ELSET=t\n3, 8, 9\n"
    bar += "*SOLID SECTION, ELSET=t, MATERIAL=steel\n1e-4\n*SURFACE, NAME=m\ns, SPOS\n"
    tie = "*NSET, NSET=one\n8\n*SURFACE, NAME=n, TYPE=NODE\none\n*TIE, NAME=tie\nn, m\n"
    mesh = read(quads + bar + tie + STEEL)
    assert mesh.points[mesh.labels == 8].tolist() == [[3.9, 0.1, 0.0]]
    used = {int(mesh.labels[node]) for equation in mesh.equations for node in equation.nodes}
    assert {1, 2, 3, 4, 8} <= used


@pytest.mark.parametrize(
    ("at", "point"),
    [
        ((-0.5, 0.5, 0), (0, 0.5, 0)),
        ((0.5, 1.5, 2), (0.5, 1, 0)),
        ((3, -1, 0), (1, 0, 0)),
        ((0.2, 0.3, 1), (0.2, 0.3, 0)),
    ],
)
def test_the_nearest_point_of_a_face_lies_in_it(at, point):
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    place = nearest("quad", square, np.array(at))
    np.testing.assert_allclose(place.point, point, atol=1e-12)
    assert place.distance == pytest.approx(np.linalg.norm(np.subtract(at, point)))


def test_a_mean_rotation_that_is_measured_changes_nothing(read):
    """The last node of MEANROT is no node of the body, and held it would be a support of no node."""
    rotated = "*NODE\n90, 0, 0, 1\n*MPC\nMEANROT, 1, 1, 1, 2, 2, 2, 3, 3, 3\n4, 4, 4, 90\n"
    plain, mesh = read(CUBE + STEEL), read(CUBE + STEEL + rotated)
    stiffness = [mp.assemble(one, {}, {"root": mp.Interface(group="c")}).K.toarray() for one in (plain, mesh)]
    np.testing.assert_array_equal(*stiffness)
    assert "measures a rotation" in mesh.notes[0]
    with pytest.raises(InputError, match="MEANROT holds a mean rotation.* give an interface of kind rbe3"):
        read(CUBE + STEEL + rotated + "*BOUNDARY\n90, 1, 1\n")


@pytest.mark.parametrize("scope", ["SURFACE=cut, NODE=90", "ELEMENT=1, NODE=90"])
def test_a_pretension_section_is_closed(read, scope):
    section = f"*NODE\n90, 0, 0, 1\n*SURFACE, NAME=cut\n1, S1\n*PRE-TENSION SECTION, {scope}\n0, 0, 1\n"
    held = "*BOUNDARY\n90, 1, 1\n5, 1, 3\n"
    mesh = read(CUBE + STEEL + section + held)
    stiffness = [
        mp.assemble(one, {}, {"root": mp.Interface(group="c")}).K.toarray() for one in (read(CUBE + STEEL), mesh)
    ]
    np.testing.assert_array_equal(*stiffness)
    assert any("the section is closed" in note for note in mesh.notes)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("*USER ELEMENT, NODES=2, TYPE=U7\n1, 2, 3\n", "by .matrices. or as .body. file"),
        ("*ELEMENT, TYPE=Z1, ELSET=z\n9, 1, 2\n", "read its .mtx file as a body"),
        ("*ELEMENT, TYPE=U7, ELSET=z\n9, 1, 2\n", "read the matrices of the whole body by .matrices."),
        ("*ELEMENT, TYPE=GAPUNI, ELSET=z\n9, 1, 2\n", "a gap is open or closed"),
        ("*SUBSTRUCTURE PROPERTY, ELSET=z\n", "A substructure is read as .body. file"),
    ],
)
def test_matrices_of_a_deck_say_where_they_are_read(read, text, said):
    with pytest.raises(InputError, match=said):
        read(CUBE + STEEL + text)
