"""Matrices in decks with elements, against the elements whose matrices they are, and against CalculiX."""

import contextlib
import random

import numpy as np
import pytest
from calculix import deck, frequencies, needs_ccx
from fe.abaqus_decks import BEAM, SECTION
from fe.abaqus_decks import STEEL as ABAQUS_STEEL
from fe.ansys_decks import deck as ansys_deck
from fe.ansys_decks import eblock, nblock
from fe.decks import STEEL, free
from structured import box, random_rotation

import modalprep as mp
from modalprep.fe.readers.digest import mesh_digest

EXACT = 1e-12  # round-off of numbers that are written in full
ENTRY = "{:.16e}".format
L, E, G, A, I1, I2, J = 1.5, 2e11, 2e11 / 2.6, 0.01, 3e-6, 2e-6, 4e-6
GRIDS = "GRID,1\nGRID,2,,2.\nGRID,3,,3.5\n"
BAR = f"CBAR,9,5,1,2,0.,1.,0.\nPBAR,5,7,.01,3.-6,2.-6,4.-6\n{STEEL}"
SECOND = "CBAR,10,5,2,3,0.,1.,0.\n"
CASE = "SOL 103\nCEND\nK2GG = {}\nM2GG = {}\nBEGIN BULK\n"


@pytest.fixture
def model(tmp_path):
    def read(text, name="deck.bdf", root=1, **given):
        path = tmp_path / name
        path.write_text(text)
        return mp.assemble(mp.read_mesh(path, **given), {}, {"root": mp.Interface(node=root, kind="node")})

    return read


def same(model, other, tolerance=EXACT):
    """Whether both have the same matrices, mass, centre and inertia."""
    for name in ("K", "M"):
        ours, theirs = (getattr(one, name).toarray() for one in (model, other))
        np.testing.assert_allclose(ours, theirs, atol=tolerance * np.abs(theirs).max())
    for name in ("m", "s0", "E0"):
        ours, theirs = (np.array(getattr(one.rigid, name)) for one in (model, other))
        np.testing.assert_allclose(ours, theirs, atol=10 * tolerance * np.abs(theirs).max())


def matrices_of(model, nodes):
    """Stiffness and mass over the six DOFs of nodes, by their rows."""
    dof = model.dof[nodes].ravel()
    return model.K.toarray()[np.ix_(dof, dof)], model.M.toarray()[np.ix_(dof, dof)]


# ---- Nastran: GENEL


def flexibility():
    """The motion of the end of a cantilever along x under unit forces and moments (Euler-Bernoulli)."""
    Z = np.diag([L / (E * A), L**3 / (3 * E * I1), L**3 / (3 * E * I2), L / (G * J), L / (E * I2), L / (E * I1)])
    Z[1, 5] = Z[5, 1] = L**2 / (2 * E * I1)
    Z[2, 4] = Z[4, 2] = -(L**2) / (2 * E * I2)
    return Z


def carried():
    """The motion of the end by those of the root, a rigid arm of length L along x."""
    S = np.eye(6)
    S[1, 5], S[2, 4] = L, -L
    return S


def genel(kind, matrix, more=()):
    """UI are the DOFs of grid 3, UD those of grid 2."""
    rows = [["", 3, 1, 3, 2, 3, 3], [3, 4, 3, 5, 3, 6, "", ""], ["UD", "", 2, 1, 2, 2, 2, 3], [2, 4, 2, 5, 2, 6]]
    fields = ["GENEL", 20, *rows[0], *rows[1], *rows[2], *rows[3], *[""] * 2]
    for name, values in ((kind, matrix), *more):
        fields += [name, *map(ENTRY, values)]
        fields += [""] * (-(len(fields) - 1) % 8)
    return free([str(f) for f in fields])


LOWER = [(i, j) for j in range(6) for i in range(j, 6)]  # by columns


@pytest.mark.parametrize("kind", ["Z", "K"])
@pytest.mark.parametrize("given", [True, False])
def test_general_element_is_the_beam_whose_flexibility_it_has(model, kind, given):
    Z = flexibility()
    values = [(Z if kind == "Z" else np.linalg.inv(Z))[place] for place in LOWER]
    more = [("S", carried().ravel())] if given else []
    ours = model(GRIDS + BAR + genel(kind, values, more))
    beam = model(GRIDS + BAR + SECOND)
    np.testing.assert_allclose(ours.K.toarray(), beam.K.toarray(), atol=1e-10 * abs(beam.K).max())  # inverse of Z
    [note] = [note for note in ours.notes if "GENEL 20" in note]
    assert "no geometric stiffness and no stress" in note


def test_general_element_of_turned_grids_is_that_of_their_axes(model):
    """UI and UD in the displacement systems of their grids, which here have x along y of the basic system."""
    turned = GRIDS.replace("GRID,2,,2.\nGRID,3,,3.5\n", "GRID,2,,2.,,,4\nGRID,3,,3.5,,,4\n")
    turned += "CORD2R,4,,0.,0.,0.,0.,0.,1.\n,0.,1.,0.\n"
    T = np.kron(np.eye(2), np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1.0]]))
    Z = T @ flexibility() @ T.T
    ours = model(turned + BAR + genel("Z", [Z[place] for place in LOWER]))
    beam = model(GRIDS + BAR + SECOND)
    np.testing.assert_allclose(ours.K.toarray(), beam.K.toarray(), atol=1e-10 * abs(beam.K).max())


def test_general_element_of_few_digits_is_freed_of_strain_by_rigid_motions(model):
    """Six digits of S strain a rigid motion by 1e-6; what is left is that of the beam by as much."""
    S = np.round(carried() * (1 + 2e-6), 5)
    S[5, 5] = 1.00001
    ours = model(GRIDS + BAR + genel("Z", [flexibility()[place] for place in LOWER], [("S", S.ravel())]))
    assert abs(ours.K @ ours.rigid_body()).max() < 1e-9 * abs(ours.K).max()
    beam = model(GRIDS + BAR + SECOND)
    np.testing.assert_allclose(ours.K.toarray(), beam.K.toarray(), atol=2e-5 * abs(beam.K).max())
    assert any("GENEL 20" in note and "that is taken out" in note for note in ours.notes)


@pytest.mark.parametrize(
    ("card", "said"),
    [
        ("GENEL,20,,3,1\n,K,1.+6\n", "GENEL 20.*resists a rigid translation along x"),
        ("GENEL,20,,3,1\n,UD,,2,1\n,Z,-1.\n", "its flexibility Z is not positive definite"),
        ("GENEL,20,,3,1\n,UD,,2,1\n,Z,1.\n", "its UD are not six DOFs that hold a rigid body"),
        ("GENEL,20,,3,1\n,UD,,2,1\n,Z,1.,2.\n,S,1.\n", "Z has more than the 1 numbers"),
        ("GENEL,20,,3,1\n,UD,,3,1\n,Z,1.\n,S,1.\n", "names a DOF twice"),
        ("GENEL,20,,3,0\n,K,1.\n", "scalar points have no place"),
        ("GENEL,20,,3,1\n", "needs the DOFs UI and either K or Z"),
        ("GENEL,20,,8,1\n,K,1.\n", "grid 8 is not in the deck"),
    ],
)
def test_a_general_element_that_is_none_is_refused(model, card, said):
    with pytest.raises(mp.InputError, match=said):
        model(GRIDS + BAR + SECOND + card)


# ---- Nastran: K2GG, M2GG


def dmig(name, A, grids=(2, 3), factor=1.0):
    """A symmetric matrix, one triangle, in large fields."""
    place = [(grid, c) for grid in grids for c in range(1, 7)]
    text = f"DMIG,{name},0,6,2,0\n"
    for j, column in enumerate(place):
        for i in range(j, len(place)):
            if A[i, j]:
                text += f"DMIG*,{name},{column[0]},{column[1]},,*\n"
                text += f"*,{place[i][0]},{place[i][1]},{ENTRY(factor * A[i, j])}\n"
    return text


def test_matrices_that_the_case_control_selects_are_added(model):
    """K2GG with a factor and CK2 are the element; M2GG does not know WTMASS; another matrix does nothing."""
    bar = model(GRIDS + BAR + SECOND)
    K, M = matrices_of(model(GRIDS.replace("GRID,1\n", "") + SECOND + BAR.split("\n", 1)[1], root=2), [0, 1])
    more = dmig("KA", K, factor=0.25) + dmig("KB", K, factor=0.5) + dmig("MA", M) + dmig("KX", 2 * K)
    ours = model(CASE.format("2.*KA, KB", "MA") + GRIDS + BAR + more + "PARAM,CK2,1.\n")
    same(ours, bar)
    assert any("1 DMIG KX" in note and "neither K2GG nor M2GG" in note for note in ours.notes)
    half = model(CASE.format("KA", "MA") + GRIDS + BAR + more + "PARAM,CK2,4.\n")
    same(half, bar)
    weighed = model(CASE.format("KA", "MA") + GRIDS + BAR + more + "PARAM,CK2,4.\nPARAM,WTMASS,.5\n")
    assert weighed.rigid.m == pytest.approx(0.5 * A * 2 * 8000 + A * L * 8000)


def test_matrices_are_in_the_units_and_axes_of_the_deck(model):
    """In mm, t and N, at grids that are turned: the matrices of the same bar in m."""
    K, M = matrices_of(model(GRIDS.replace("GRID,1\n", "") + SECOND + BAR.split("\n", 1)[1], root=2), [0, 1])
    R = random_rotation(3)
    T = np.kron(np.eye(4), R)
    unit = np.tile([1.0, 1, 1, 1e3, 1e3, 1e3], 2)
    K, M = (unit[:, None] * (T @ X @ T.T) * unit * 1e-3 for X in (K, M))
    z, x = R[2], R[0]
    cord = f"CORD2R*,4,,0.,0.,*\n*,0.,{ENTRY(z[0])},{ENTRY(z[1])},{ENTRY(z[2])},*\n"
    cord += f"*,{ENTRY(x[0])},{ENTRY(x[1])},{ENTRY(x[2])}\n"
    grids = "GRID,1\nGRID,2,,2000.,,,4\nGRID,3,,3500.,,,4\n" + cord
    bar = BAR.replace(".01,3.-6,2.-6,4.-6", "1.+4,3.+6,2.+6,4.+6").replace("2.+11,,.3,8000.", "2.+5,,.3,8.-9")
    text = CASE.format("KA", "MA") + grids + bar + dmig("KA", K) + dmig("MA", M)
    same(model(text, length_unit="mm", mass_unit="t"), model(GRIDS + BAR + SECOND), 1e-9)  # the axes' digits


@pytest.mark.parametrize(
    ("case", "more", "said"),
    [
        ("", "", "no case control, so that nothing says which matrices"),
        (CASE.format("KZ", "KZ"), "", "K2GG selects the matrix KZ, which the deck does not have"),
        (CASE.format("3", "KA"), "", "K2GG = '3' names no matrix"),
        (CASE.format("KA", "KA").replace("BEGIN", "SUBCASE 1\nK2GG=KB\nSUBCASE 2\nBEGIN"), "", "select different K2GG"),
        (CASE.format("KC", ""), "DMIG,KC,0,6,2,0\nDMIG,KC,3,1,,3,1,5.\n", "DMIG KC.*resists a rigid translation"),
        (CASE.format("KD", ""), "DMIG,KD,0,6,2,0\nDMIG,KD,3,0,,3,0,5.\n", "scalar points have no place"),
        (CASE.format("KE", ""), "DMIG,KE,0,1,2,0\nDMIG,KE,3,1,,2,1,5.\n", "stiffness matrix is not symmetric"),
        (
            CASE.format("", "ME").replace("K2GG = \n", ""),
            "DMIG,ME,0,6,2,0\nDMIG,ME,3,1,,3,1,5.\n",
            "every direction alike",
        ),
    ],
)
def test_matrices_that_cannot_be_added_are_refused(model, case, more, said):
    with pytest.raises(mp.InputError, match=said):
        model(case + GRIDS + BAR + SECOND + dmig("KA", np.eye(12)) + more)


def test_a_deck_of_matrices_alone_is_one_for_matrices(tmp_path):
    path = tmp_path / "deck.bdf"
    path.write_text(GRIDS + dmig("K", np.eye(12)))
    with pytest.raises(mp.InputError, match=r"no elements. Matrices of a deck are read by \[matrices\]"):
        mp.read_mesh(path)


# ---- Abaqus and CalculiX


def packed(A):
    """The lower triangle row by row, four numbers in a line."""
    rows = [[ENTRY(x) for x in A[i, : i + 1]] for i in range(len(A))]
    return "".join(", ".join(row[k : k + 4]) + "\n" for row in rows for k in range(0, len(row), 4))


def user_element(K, M, head="TYPE=U7, LINEAR, NODES=2"):
    return (
        f"*USER ELEMENT, {head}\n1, 2, 3, 4, 5, 6\n*MATRIX, TYPE=STIFFNESS\n{packed(K)}*MATRIX, TYPE=MASS\n{packed(M)}"
    )


def sparse(A, nodes=(2, 3)):
    place = [(node, c) for node in nodes for c in range(1, 7)]
    return "".join(
        f"{place[i][0]}, {place[i][1]}, {place[j][0]}, {place[j][1]}, {ENTRY(A[i, j])}\n"
        for i, j in np.argwhere(np.tril(A))
    )


FIRST = BEAM.replace("2, 2, 3\n", "") + SECTION + ABAQUS_STEEL


@pytest.fixture
def halves(model):
    """The whole beam of two elements, and stiffness and mass of one."""
    return model(BEAM + SECTION + ABAQUS_STEEL, "whole.inp"), *matrices_of(model(FIRST, "first.inp"), [0, 1])


def test_linear_user_elements_are_the_beams_whose_matrices_they_have(model, halves):
    whole, K, M = halves
    own = "*ELEMENT, TYPE=U7, ELSET=own\n2, 2, 3\n*UEL PROPERTY, ELSET=own, BETA=.01\n"
    ours = model(user_element(K, M) + FIRST + own, "deck.inp")
    same(ours, whole)
    assert any("parameter BETA of *UEL PROPERTY" in note for note in ours.notes)


def test_dofs_of_user_elements_change_from_node_to_node(model, halves):
    """DOFs in another order, and at the second node fewer: a spring of 5 N/m in the axes of both."""
    whole, _, _ = halves
    spring = np.array([[5.0, -5], [-5, 5]])
    text = f"*USER ELEMENT, TYPE=U8, LINEAR, NODES=2\n1\n2, 1\n*MATRIX, TYPE=STIFFNESS\n{packed(spring)}"
    ours = model(text + BEAM + SECTION + ABAQUS_STEEL + "*ELEMENT, TYPE=U8\n9, 1, 3\n", "deck.inp")
    added = (ours.K - whole.K).toarray()
    ends = ours.dof[[0, 2], 0]
    assert added[np.ix_(ends, ends)] == pytest.approx(spring, rel=1e-6)  # beside 2e8 of the beam
    assert abs(added).sum() == pytest.approx(20, rel=1e-6)


@pytest.mark.parametrize("way", ["names", "set", "files"])
def test_assembled_matrices_are_the_beams_whose_matrices_they_are(model, halves, tmp_path, way):
    whole, K, M = halves
    numbers = (52, 53) if way == "set" else (2, 3)
    k, m = sparse(K / 2, numbers), sparse(M, numbers)
    given = (
        f"*MATRIX INPUT, NAME=k, SCALE FACTOR=2.\n{k}*MATRIX INPUT, NAME=m\n{m}*MATRIX ASSEMBLE, STIFFNESS=k, MASS=m"
    )
    given += ", NSET=both\n*NSET, NSET=both\n2, 3\n" if way == "set" else "\n"
    if way == "files":
        (tmp_path / "k.txt").write_text(sparse(K))
        (tmp_path / "m.txt").write_text(m)
        given = "*MATRIX ASSEMBLE, NAME=half, STIFFNESS FILE=k.txt, MASS FILE=m.txt\n"
    same(model(FIRST + given, "deck.inp"), whole)


def test_files_of_matrices_count_as_the_deck(tmp_path, halves):
    """A body is built again when one of them changes."""
    (tmp_path / "deck.inp").write_text(FIRST + "*MATRIX ASSEMBLE, NAME=half, STIFFNESS FILE=k.txt\n")
    found = set()
    for factor in (1.0, 2.0):
        (tmp_path / "k.txt").write_text(sparse(factor * halves[1]))
        found |= {mesh_digest(tmp_path / "deck.inp"), mp.read_mesh(tmp_path / "deck.inp").sha256}
    assert len(found) == 2


def test_a_matrix_that_nothing_assembles_is_noted(model, halves):
    ours = model(BEAM + SECTION + ABAQUS_STEEL + f"*MATRIX INPUT, NAME=k\n{sparse(halves[1])}", "deck.inp")
    same(ours, halves[0])
    assert "*MATRIX INPUT K: no *MATRIX ASSEMBLE adds it to the model" in ours.notes


ONE = "*USER ELEMENT, TYPE=U7, LINEAR, NODES=1\n1\n*MATRIX, TYPE=STIFFNESS\n1.\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("*USER ELEMENT, TYPE=U7, NODES=2\n1\n", "is a subroutine, not matrices"),
        (
            "*USER ELEMENT, TYPE=U7, FILE=old, OLD ELEMENT=3\n",
            "reads a file of results of Abaqus .old., which is binary",
        ),
        ("*USER ELEMENT, LINEAR, NODES=2\n1\n", "has no TYPE such as U7"),
        ("*USER ELEMENT, TYPE=U7, LINEAR, NODES=2\n", "has no DOFs of its first node"),
        ("*USER ELEMENT, TYPE=U7, LINEAR, NODES=2\n1, 7\n", "has DOFs 1 to 6 of nodes 1 to 2"),
        (ONE.replace("1.\n", "1., 2.\n"), "a matrix of 1 dofs has 2 of 1 values"),
        ("*MATRIX, TYPE=STIFFNESS\n1.\n", "does not follow a linear .USER ELEMENT"),
        (ONE + "*MATRIX, TYPE=DAMPING\n1.\n", "is not one of STIFFNESS, MASS"),
        (ONE + "*ELEMENT, TYPE=U7\n9, 3, 2\n", "element 9 of type U7 has 2 nodes, not 1"),
        (ONE + "*ELEMENT, TYPE=U7\n9, 3\n", r"user element 9 \(U7\) .*resists a rigid translation along x"),
        (ONE.split("*MATRIX")[0] + "*ELEMENT, TYPE=U7\n9, 3\n", "element 9 of type U7 has no .MATRIX"),
        (ONE + "*ELEMENT, TYPE=U7\n9, 3\n*TRANSFORM, NSET=t\n0, 1, 0, -1, 0, 0\n*NSET, NSET=t\n3\n", "axes of its own"),
        (ONE + "*ELEMENT, TYPE=U7\n9, 3\n*ELGEN\n9, 2, 1, 1\n", "is one of matrices, which are not repeated"),
        ("*MATRIX INPUT, NAME=k, TYPE=UNSYMMETRIC\n1, 1, 1, 1, 2.\n", "is not symmetric"),
        ("*MATRIX INPUT, NAME=k, MATRIX=MASS\n1, 1, 1, 1, 2.\n", "reads a .sim file"),
        ("*MATRIX INPUT, NAME=k\n1, 0, 1, 1, 2.\n", "is not a positive whole number"),
        ("*MATRIX ASSEMBLE, STIFFNESS=k\n", "names the matrix k, which no .MATRIX INPUT gives"),
        ("*MATRIX ASSEMBLE, NAME=S\n", "names neither STIFFNESS nor MASS"),
        ("*MATRIX ASSEMBLE, NAME=S, STIFFNESS FILE=no.txt\n", "names the file no.txt, which is not there"),
        (
            "*MATRIX INPUT, NAME=k\n8, 1, 8, 1, 2.\n*MATRIX ASSEMBLE, STIFFNESS=k\n",
            "has node 8, which is not in the deck",
        ),
    ],
)
def test_matrices_of_a_deck_that_cannot_be_read_are_refused(model, text, said):
    with pytest.raises(mp.InputError, match=said):
        model(BEAM + SECTION + ABAQUS_STEEL + text, "deck.inp")


@needs_ccx
def test_half_a_block_as_substructure_has_the_frequencies_of_the_whole_in_calculix(tmp_path):
    """CalculiX prints seven digits; Debian's does not know *MATRIX ASSEMBLE yet."""
    points, cells = box("hexahedron20", (2, 1, 1), (1.0, 0.3, 0.2), distort=0.1, seed=2)
    first = points[cells].mean(axis=1)[:, 0] < 0.5
    held = np.flatnonzero(points[:, 0] == 0)
    path = tmp_path / "part.inp"
    path.write_text(deck(points, held, C3D20=cells[~first]))
    half = mp.assemble(mp.read_mesh(path), {}, {"root": mp.Interface(group="E")})
    node = np.repeat(np.flatnonzero(half.dof[: len(points), 0] >= 0) + 1, 3)
    for name, A in (("k.txt", half.K.tocoo()), ("m.txt", half.M.tocoo())):
        rows = [(i, j, x) for i, j, x in zip(A.row, A.col, A.data, strict=True) if j <= i < len(node)]
        lines = [f"{node[i]},{i % 3 + 1},{node[j]},{j % 3 + 1},{ENTRY(x)}" for i, j, x in rows]
        (tmp_path / name).write_text("\n".join(lines))
    own = "*MATRIX ASSEMBLE, NAME=HALF, STIFFNESS FILE=k.txt, MASS FILE=m.txt\n"
    path.write_text(deck(points, held, C3D20=cells[first]) + own)
    held_there = {"own": mp.Support(set="boundary")}
    model = mp.assemble(mp.read_mesh(path), {}, {"root": mp.Interface(kind="support")}, supports=held_there)
    ours = mp.craig_bampton(model, modes=5, truncation=[]).frequency[:5]
    np.testing.assert_allclose(ours, frequencies(deck(points, held, C3D20=cells), 5, tmp_path), rtol=1e-6)


# ---- Ansys


def matrix27(A, kind):
    """A type and real constants, six to a line."""
    upper = A[np.triu_indices(12)]
    groups = [upper[k : k + 6] for k in range(0, 78, 6)]
    names = ["R,9,", *["RMORE,"] * 12]
    lines = [name + ",".join(map(ENTRY, group)) for name, group in zip(names, groups, strict=True)]
    return [f"ET,{kind},MATRIX27", f"KEYOPT,{kind},3,{kind}", *lines]


BEAM188 = ["ET,1,188", "MP,EX,1,2e11", "MP,PRXY,1,.25", "MP,DENS,1,7800", "SECTYPE,1,BEAM,RECT", "SECDATA,.02,.05"]


def test_matrix27_is_the_beam_whose_matrices_it_has(tmp_path):
    nodes = nblock([(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 0, 5)])

    def model(elements, more=()):
        path = ansys_deck(tmp_path, [*BEAM188, *more, *nodes, *elements])
        return mp.assemble(mp.read_mesh(path), {}, {"root": mp.Interface(node=1, kind="node")})

    both = model(eblock((1, 2, 4), (2, 3, 4)))
    K, M = matrices_of(model(eblock((1, 2, 4))), [0, 1])
    stiffness, mass = matrix27(K, 4), [line.replace("R,9,", "R,8,") for line in matrix27(M, 2)]
    own = [*eblock((1, 2, 4)), *eblock((2, 3), kind=4, real=9, first=7), *eblock((2, 3), kind=2, real=8, first=8)]
    same(model(own, [*stiffness, *mass]), both)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["KEYOPT,4,3,3"], "KEYOPT.3. = 3 is not read"),
        (["KEYOPT,4,3,4", "KEYOPT,4,2,1"], "KEYOPT.2. = 1 and KEYOPT.3. = 4 is not read"),
        (["KEYOPT,4,3,4"], "its real constants are missing or zero"),
    ],
)
def test_a_matrix27_that_is_not_read_is_refused(tmp_path, options, said):
    nodes = nblock([(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 0, 5)])
    elements = [*eblock((1, 2, 4)), *eblock((2, 3), kind=4, real=9, first=7)]
    path = ansys_deck(tmp_path, [*BEAM188, "ET,4,27", *options, *nodes, *elements])
    with pytest.raises(mp.InputError, match=said):
        mp.read_mesh(path)


# ---- damaged


def whole_deck(program):
    """A deck with all keywords of matrices; the ending of its file."""
    K = np.kron(np.array([[5.0, -5], [-5, 5]]), np.diag([1.0, 1, 1, 0, 0, 0]))
    if program == "nastran":
        matrices = genel("Z", [flexibility()[place] for place in LOWER], [("S", carried().ravel())]) + dmig("KA", K)
        return CASE.format("2.*KA", "KA") + GRIDS + BAR + SECOND + matrices + "PARAM,CK2,.5\n", "deck.bdf"
    if program == "ansys":
        elements = [*eblock((1, 2, 4)), *eblock((2, 3), kind=4, real=9, first=7)]
        nodes = nblock([(0, 0, 0), (1, 0, 0), (1, 0, 0), (0, 0, 5)])
        return "\n".join(["/PREP7", *BEAM188, *matrix27(K, 4), *nodes, *elements, ""]), "deck.cdb"
    own = (
        user_element(K, K)
        + BEAM
        + SECTION
        + ABAQUS_STEEL
        + "*ELEMENT, TYPE=U7, ELSET=own\n2, 2, 3\n*UEL PROPERTY, ELSET=own\n"
    )
    given = f"*MATRIX INPUT, NAME=k, SCALE FACTOR=2.\n{sparse(K)}*MATRIX ASSEMBLE, STIFFNESS=k, MASS=k, NSET=n\n"
    return own.replace("2, 2, 3\n*UEL", "9, 2, 3\n*UEL") + given + "*NSET, NSET=n\n2, 3\n", "deck.inp"


@pytest.mark.filterwarnings("ignore::modalprep.ModalprepWarning")
@pytest.mark.parametrize("program", ["nastran", "abaqus", "ansys"])
def test_damaged_matrices_are_refused_in_a_sentence(tmp_path, program):
    text, name = whole_deck(program)
    rng = random.Random(program)
    for _ in range(60):
        cut = list(text)
        for _ in range(rng.randint(1, 4)):
            at = rng.randrange(len(cut))
            cut[at : at + rng.choice((0, 1, 1, 9, 60))] = rng.choice(
                ["", "1", "-", ",", "\n", "nan", "1e400", "*", "UD", "7"]
            )
        (tmp_path / name).write_text("".join(cut))
        with contextlib.suppress(mp.InputError):
            mp.assemble(mp.read_mesh(tmp_path / name), {}, {"root": mp.Interface(node=1, kind="node")})
