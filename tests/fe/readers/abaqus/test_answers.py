"""Decks of Abaqus and CalculiX that others wrote, with the matrices and frequencies of these programs.

The decks are those of public repositories: jgerstmayr/EXUDYN (pythonDev/TestModels/testData) and
ISCPC/CalculiX-ccx-test (test), whose ``.dat.ref`` files hold CalculiX' own results.
"""

import numpy as np
import pytest
from scipy.linalg import eigh
from shared_data import DATA

import modalprep as mp
from modalprep.fe.readers.abaqus.matrices import read_abaqus_matrix

pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason=f"the decks are not in {DATA} (set MODALPREP_DATA)")


def model_of(file, group, **units):
    mesh = mp.read_mesh(DATA / file, **units)
    return mesh, mp.assemble(mesh, {}, {"root": mp.Interface(group=group)})


@pytest.fixture(scope="module")
def block():
    mesh, model = model_of("abaqus/blockC3D10.inp", "Set-1")
    n = 3 * len(mesh.points)
    return mesh, model.K[:n, :n].toarray(), model.M[:n, :n].toarray()


@pytest.mark.parametrize(("k", "file"), [(1, "blockC3D10_STIF1.mtx"), (2, "blockC3D10_MASS1.mtx")])
def test_matrices_of_second_order_tetrahedra_are_those_of_abaqus(block, k, file):
    """The deck prints coordinates with nine digits, Abaqus has them all: 1e-9 over edges of a tenth, squared."""
    theirs = read_abaqus_matrix(DATA / "abaqus" / file)[""].matrix.toarray()
    assert abs(block[k] - theirs).max() < 3e-8 * abs(theirs).max()


def test_the_block_is_whole_and_needs_no_property(block):
    mesh, K, M = block
    assert len(mesh.cells["tetra10"]) == 122
    assert mesh.notes == ()
    total = np.tile([1.0, 0.0, 0.0], len(mesh.points))
    assert total @ M @ total == pytest.approx(4 * 1 * 1 * 2900.0, rel=1e-9)  # the block, 4 x 1 x 1 m
    frequency = np.sqrt(np.maximum(eigh(K, M, eigvals_only=True, subset_by_index=[6, 8]), 0)) / (2 * np.pi)
    theirs = [
        read_abaqus_matrix(DATA / "abaqus" / f"blockC3D10_{m}1.mtx")[""].matrix.toarray() for m in ("STIF", "MASS")
    ]
    expected = np.sqrt(eigh(*theirs, eigvals_only=True, subset_by_index=[6, 8])) / (2 * np.pi)
    np.testing.assert_allclose(frequency, expected, rtol=1e-8)  # first order in the coordinates' last digit


def test_first_order_bricks_are_not_those_of_abaqus():
    """C3D8 of Abaqus is integrated selectively and its mass lumped; ours has incompatible modes and all of its mass."""
    mesh, model = model_of("abaqus/rotorDiscTest.inp", "Set-1")
    assert len(mesh.cells["hexahedron"]) == 48
    assert {"BCleft", "BCright", "BCrot", "NodeMiddle"} < set(mesh.groups)
    assert not any(name.startswith("_Surface") for name in mesh.groups)  # internal sets
    theirs = read_abaqus_matrix(DATA / "abaqus" / "rotorDiscTestMASS1.mtx")[""].matrix
    assert abs(theirs - theirs.multiply(np.eye(theirs.shape[0]))).max() == 0  # lumped
    total = np.tile([1.0, 0.0, 0.0], len(mesh.points))
    n = len(total)
    assert total @ model.M[:n, :n] @ total == pytest.approx(total @ theirs @ total, rel=1e-8)


def reference(name):
    """Return frequencies, participation factors and total effective mass that CalculiX prints."""
    lines = (DATA / "calculix" / f"{name}.dat.ref").read_text().splitlines()

    def table(title, offset):
        start = next(i for i, line in enumerate(lines) if "".join(line.split()).startswith(title)) + offset
        return np.array([[float(x) for x in line.split()[1:]] for line in lines[start : start + 10]])

    mass = next(i for i, line in enumerate(lines) if "".join(line.split()).startswith("TOTALEFFECTIVEMASS"))
    total = [float(x) for x in lines[mass + 4].split()]
    return table("EIGENVALUEOUTPUT", 6)[:, 2], table("PARTICIPATIONFACTORS", 4), np.array(total)


def held_modes(name, group):
    """Modes of the deck with the translations of a group held, in the deck's own units (mm, t, s)."""
    mesh, model = model_of(f"calculix/{name}.inp", group)  # metres and kg: the numbers as they stand
    dof = model.dof[: len(mesh.points), :3]
    fixed, every = dof[mesh.nodes(group)].ravel(), dof[dof >= 0]
    free = np.setdiff1d(every, fixed)
    K, M = (A.toarray()[np.ix_(free, free)] for A in (model.K, model.M))
    flexibility, V = eigh(M, K, subset_by_index=[len(free) - 10, len(free) - 1])  # of K the lowest would lose digits
    w2, V = 1 / flexibility[::-1], (V / np.sqrt(flexibility))[:, ::-1]
    R = np.zeros((model.K.shape[0], 6))
    for i, point in zip(dof, mesh.points, strict=True):
        R[i] = np.hstack([np.eye(3), np.cross(np.eye(3), point).T])
    R = R[free]
    return np.sqrt(w2) / (2 * np.pi), V.T @ M @ R, np.diag(R.T @ M @ R)


def test_frequencies_and_effective_masses_of_second_order_bricks_are_those_of_calculix():
    frequency, participation, mass = held_modes("dloadlin20f", "left")
    theirs, factors, total = reference("dloadlin20f")
    # The first two err by 5e-8 of the third eigenvalue in the other program: its matrix has a condition of 1e10. With
    # ours inverse iteration in extended precision (np.longdouble) gives 9.483033 for the first, the other has 9.482967.
    np.testing.assert_allclose(frequency[0], 9.483033, rtol=3e-6)
    np.testing.assert_allclose(frequency[2:], theirs[2:], rtol=1e-6)
    np.testing.assert_allclose(frequency[:2], theirs[:2], rtol=1e-5)
    np.testing.assert_allclose(mass, total, rtol=1e-6)
    np.testing.assert_allclose(participation[:, :3] ** 2, factors[:, :3] ** 2, atol=1e-5 * mass[0])


def test_frequencies_of_bricks_of_reduced_integration_are_those_of_calculix():
    """C3D20R: 2 x 2 x 2 points in stiffness and mass; seven digits are printed."""
    found, _, mass = held_modes("beamf", "CN7")
    theirs, _, total = reference("beamf")
    np.testing.assert_allclose(found, theirs, rtol=5.1e-7)
    np.testing.assert_allclose(mass, total, rtol=1e-6)


@pytest.mark.parametrize(
    ("name", "group", "low", "high"),
    [
        # C3D8I has incompatible modes, which its authors chose otherwise
        ("dloadlinIf", "left", -1e-4, 0.0),
    ],
)
def test_other_elements_are_near_those_of_calculix(name, group, low, high):
    found, theirs = held_modes(name, group)[0][0], reference(name)[0][0]
    assert low <= found / theirs - 1 <= high


def test_thickness_at_every_node_and_supports_of_a_shell():
    """CalculiX makes a locking C3D20 of S8 (tests of the thickness of shells compare both); here it is a shell."""
    mesh = mp.read_mesh(DATA / "calculix" / "shellf.inp")
    held = {"clamp": mp.Support(set="boundary")}
    model = mp.assemble(mesh, {}, {"root": mp.Interface(kind="support")}, supports=held)
    assert sorted(mesh.labels[mesh.supports["boundary"].nodes].tolist()) == [1, 4, 8, 10, 13]
    assert mesh.supports["boundary"].components.all()
    thickness = mesh.data["thickness"]["quad8"]
    x = mesh.points[mesh.cells["quad8"], 0]
    np.testing.assert_allclose(thickness, np.interp(x, [0, 0.5, 1], [0.01, 0.03, 0.02]), rtol=1e-6)  # six digits in x
    R = model.rigid_body()
    area = 0.5 * 0.02 + 0.5 * 0.025  # of the section along x, linear in two pieces, one wide
    assert (R.T @ (model.M @ R))[0, 0] == pytest.approx(7.8e-9 * area, rel=1e-6)


@pytest.mark.parametrize(
    ("name", "cells", "groups"),
    [
        ("coup", {"line": 1, "vertex": 1}, {"b", "m"}),
        ("cyl", {"line": 2}, {"b"}),
        ("elgen", {"line": 2}, {"b"}),
        ("ngen", {"line": 2}, {"b"}),
        ("trail", {"line": 2}, {"b"}),
        ("gmsh_named_faces", {"tetra": 1632, "triangle": 56}, {"hole_base", "hole_wall", "body"}),
    ],
)
def test_small_decks_that_went_wrong(name, cells, groups):
    file = DATA.parent / "repro" / "decks" / f"{name}.inp"
    if not file.is_file():
        pytest.skip("the small decks are not there")
    mesh = mp.read_mesh(file)
    assert {kind: len(rows) for kind, rows in mesh.cells.items()} == cells
    assert groups <= set(mesh.groups)


def test_a_tie_without_its_surfaces():
    file = DATA.parent / "repro" / "decks" / "onepart.inp"
    if not file.is_file():
        pytest.skip("the small decks are not there")
    with pytest.raises(mp.InputError, match=r"line 26: \*TIE names no surfaces"):
        mp.read_mesh(file)
    mesh = mp.read_mesh(file, ignore=["*TIE"])
    assert set(mesh.properties) == {"P-1.S", "P-2.S"}
    assert mesh.points[mesh.nodes("top"), 2].tolist() == [2.0] * 4  # of the instance that is moved up
