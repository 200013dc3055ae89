"""A frame reduced by MSC Nastran itself: its 32 x 32 ``kxx`` and ``mxx``, block by block.

Deck and matrices are inboard.dat and inboard.op4 of the tests of pyYeti (twmacro/pyyeti, tests/nas2cam_extseout).

The deck asks for modes up to 50 Hz, of which there are three, and has eight modal coordinates. Nastran fills the
other five with residual vectors: the static responses to the deck's loads and to the six inertia loads of the rigid
body, freed of the modes, the softest five of them. Their 70 to 209 Hz are no natural frequencies: single bars bend
from 88 Hz on. `truncation_vectors` of the same nine loads are the same vectors.

The mass of a CBAR with ``PARAM,COUPMASS,1`` differs from a consistent one in three terms: the axial mass is the mean of
consistent and lumped, ``rho A L [5 1; 1 5] / 12``; there is no inertia about the bar's axis; and bending has no
rotary inertia of the section. With these on the same stiffness, and card numbers rounded to single precision as
Nastran holds them, every block agrees to the precision in which the file holds it. The consistent mass of
`modalprep.Beam` keeps what Nastran leaves out, which costs at most 2e-4 of a frequency below 50 Hz here.
"""

from dataclasses import replace

import numpy as np
import pytest
import shared_data
from scipy.sparse import coo_array

import modalprep as mp
from modalprep.linalg.bordered import Bordered
from modalprep.linalg.modes import lowest_modes
from modalprep.reduction.clamped import clamp
from modalprep.reduction.truncation import truncation_vectors

DATA = shared_data.DATA / "nastran_cb"
pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason=f"the deck is not in {DATA} (set MODALPREP_DATA)")
BOUNDARY = (3, 11, 19, 27)
GRIDS = [*range(3, 9), *range(11, 17), *range(19, 25), *range(27, 35)]
GRID_11 = np.kron(np.eye(2), [[0, 1, 0], [0, 0, 1], [1, 0, 0]])  # moves in CORD2R 10: z along basic x, x along basic y
F, G = (1.5, -1.5, 2.0), (-1.5, 10.0, -2.0)
FORCES = ({13: F, 21: G}, {12: F, 20: G}, {20: G, 13: F})  # the FORCE cards; every TLOAD1 has one of these sums
AXIAL = {"lumped": np.eye(2) / 2, "consistent": np.array([[2, 1], [1, 2]]) / 6, "mean": np.array([[5, 1], [1, 5]]) / 12}
NASTRAN = dict(axial="mean", torsion=False, rotary=False)
CONSISTENT = dict(axial="consistent", torsion=True, rotary=True)


def read_op4(path):
    """Real double-precision matrices of a binary OUTPUT4 file (BIGMAT strings): {name: array}."""
    data, at, found = path.read_bytes(), 0, {}

    def record():
        nonlocal at
        size = int(np.frombuffer(data, "<i4", 1, at)[0])
        at += size + 8
        return data[at - size - 4 : at - 4]

    while at < len(data):
        header = record()
        columns, rows = np.frombuffer(header, "<i4", 2)
        matrix = np.zeros((abs(rows), columns))
        while True:
            column = record()
            c, first_row, words = np.frombuffer(column, "<i4", 3)
            if c > columns:
                break
            assert first_row == 0  # strings: length, row, numbers
            start = 12
            while start < 12 + 4 * words:
                length, row = np.frombuffer(column, "<i4", 2, start)
                count = (length - 1) // 2
                matrix[row - 1 : row - 1 + count, c - 1] = np.frombuffer(column, "<f8", count, start + 8)
                start += 4 * (length + 1)
        found[header[16:24].decode().strip().lower()] = matrix
    return found


@pytest.fixture(scope="module")
def nastran():
    return read_op4(DATA / "inboard.op4")


@pytest.fixture(scope="module")
def mesh():
    read = mp.read_mesh(DATA / "inboard.dat", "m", "kg")  # in the deck's own numbers: mm, kg, s
    assert read.labels.tolist() == GRIDS
    return read


def in_single_precision(section):
    size = {name: float(np.float32(getattr(section, name))) for name in ("A", "Iy", "Iz", "J")}
    return replace(section, material=replace(section.material, rho=float(np.float32(section.material.rho))), **size)


def clamped(mesh, sections):
    """The frame with its four boundary grids held."""
    return clamp(mp.assemble(mesh, sections, {f"grid_{n}": mp.Interface(node=n, kind="node") for n in BOUNDARY}))


@pytest.fixture(scope="module")
def held(mesh):
    return clamped(mesh, {name: in_single_precision(section) for name, section in mesh.properties.items()})


def bar_mass(section, L, axial, torsion, rotary):
    """Mass matrix (12, 12) of a slender bar along e1 (Przemieniecki, Theory of Matrix Structural Analysis, 1968)."""
    translation = [
        [156, 22 * L, 54, -13 * L],
        [0, 4 * L**2, 13 * L, -3 * L**2],
        [0, 0, 156, -22 * L],
        [0, 0, 0, 4 * L**2],
    ]
    rotation = [[36, 3 * L, -36, 3 * L], [0, 4 * L**2, -3 * L, -(L**2)], [0, 0, 36, -3 * L], [0, 0, 0, 4 * L**2]]
    translation, rotation = (np.triu(m) + np.triu(m, 1).T for m in (translation, rotation))
    rho, M = section.material.rho, np.zeros((12, 12))
    M[np.ix_([0, 6], [0, 6])] = rho * section.A * L * AXIAL[axial]
    M[np.ix_([3, 9], [3, 9])] = torsion * rho * (section.Iy + section.Iz) * L * AXIAL["consistent"]
    for dofs, inertia, sign in (([1, 5, 7, 11], section.Iz, 1), ([2, 4, 8, 10], section.Iy, -1)):
        turn = np.diag([1, sign, 1, sign])  # w' = -theta_y
        bend = rho * section.A * L / 420 * translation + rotary * rho * inertia / (30 * L) * rotation
        M[np.ix_(dofs, dofs)] = turn @ bend @ turn
    return M


def frame_mass(model, **terms):
    """Mass matrix of every bar of the model."""
    rows, columns, values = [], [], []
    for block in model.geometric_stiffness.blocks:
        length = np.linalg.norm(np.diff(model.points[block.nodes], axis=1)[:, 0], axis=1)
        for nodes, L, axes in zip(block.nodes, length, block.frame, strict=True):
            turn, dofs = np.kron(np.eye(4), axes), model.dof[nodes].ravel()
            values.append(turn.T @ bar_mass(block.section, L, **terms) @ turn)
            rows.append(np.repeat(dofs, 12))
            columns.append(np.tile(dofs, 12))
    place = np.concatenate(rows), np.concatenate(columns)
    return coo_array((np.ravel(values), place), shape=model.K.shape).tocsr()


def with_mass(held, M):
    M = (held.model.C.T @ M @ held.model.C).tocsr()
    return replace(held, M=Bordered(M[held.i][:, held.i].tocsr(), M[held.b].tocsr(), held.b, held.i))


def applied_loads(model):
    """The three different loads of the deck among the independent DOFs (n_free, 3)."""
    loads = np.zeros((model.n_dof, len(FORCES)))
    for load, forces in zip(loads.T, FORCES, strict=True):
        for grid, force in forces.items():
            load[model.dof[GRIDS.index(grid), :3]] = force
    return model.C.T @ loads


def craig_bampton_basis(held, loads):
    """Columns (n_free, 32): 24 boundary motions, three modes, five residual vectors of these loads."""
    w2, Phi, _ = lowest_modes(held.K_ii, held.M_ii, 3, factor=held.factor)
    _, X = truncation_vectors(held, loads[held.i], w2, Phi)
    T = np.zeros((held.K.shape[0], 32))
    T[held.b, np.arange(24)] = 1.0
    T[held.i] = np.concatenate([held.Psi, Phi, X[:, :5]], axis=1)
    T[:, 6:12] = T[:, 6:12] @ GRID_11.T
    return T


def all_loads(held):
    return np.concatenate([applied_loads(held.model), held.M @ held.model.rigid_body()[held.model.free]], axis=1)


@pytest.fixture(scope="module")
def basis(held, nastran):
    """Our basis with Nastran's mass, and the signs of Nastran's vectors; that mass too."""
    bars = with_mass(held, frame_mass(held.model, **NASTRAN))
    T = craig_bampton_basis(bars, all_loads(bars))
    return matched(T, bars.M, nastran), bars.M


def matched(T, M, nastran):
    coupling = (T.T @ (M @ T))[:24, 24:] * nastran["mxx"][:24, 24:]
    return T * np.append(np.ones(24), np.sign(coupling.sum(axis=0)))


def error(ours, exact):
    """Largest difference of two matrices, of the largest number of the exact one."""
    return float(np.abs(ours - exact).max() / np.abs(exact).max())


def worst_column(ours, exact):
    """The same of each column by itself: the largest."""
    return float((np.abs(ours - exact).max(axis=0) / np.abs(exact).max(axis=0)).max())


def frequency(K):
    return np.sqrt(np.diag(K)[24:]) / (2 * np.pi)


b, q = slice(0, 24), slice(24, 32)


def test_every_block_is_that_of_nastran_with_its_mass(held, basis, nastran):
    T, M = basis
    K, M = T.T @ (held.K @ T), T.T @ (M @ T)
    assert error(K[b, b], nastran["kxx"][b, b]) < 1e-12  # seen 7e-14
    assert error(M[b, b], nastran["mxx"][b, b]) < 1e-10  # seen 2e-11
    assert worst_column(M[b, q], nastran["mxx"][b, q]) < 2e-8  # seen 6e-9: the modes at 6.13 Hz lie 1e-4 apart
    np.testing.assert_allclose(M[q, q], nastran["mxx"][q, q], atol=1e-12)
    assert not np.any(nastran["kxx"][b, q])
    size = np.sqrt(np.diag(K))
    assert np.abs(K[b, q] / np.outer(size[b], size[q])).max() < 1e-10
    assert np.array_equal(np.diag(nastran["kxx"])[q], np.diag(nastran["kxx"])[q].astype(np.float32))
    np.testing.assert_allclose(frequency(K), frequency(nastran["kxx"]), rtol=1e-7)  # of single precision; seen 5e-8


def test_cards_are_held_in_single_precision(mesh, nastran):
    """With all their digits, the boundary mass is 3.7e-8 off, as is the density 2.74e-6 in single precision."""
    held = clamped(mesh, {})
    T = craig_bampton_basis(held, all_loads(held))[:, b]
    K, M = (T.T @ (A @ T) for A in (held.K, with_mass(held, frame_mass(held.model, **NASTRAN)).M))
    assert error(K, nastran["kxx"][b, b]) < 1e-9  # seen 2e-10: areas
    assert error(M, nastran["mxx"][b, b]) == pytest.approx(1 - float(np.float32(2.74e-6)) / 2.74e-6, rel=0.1)


def test_modes_and_loads_are_those_of_nastran(held, basis, nastran):
    """``mug1`` holds the boundary grids, 4 and 16; ``px`` the loads TLOAD1 1001 to 1030."""
    T, _ = basis
    rows = [held.model.dof[GRIDS.index(grid)] for grid in (3, 4, 11, 16, 19, 27)]
    motion = (held.model.C @ T)[np.concatenate(rows)]
    motion[12:18] = GRID_11 @ motion[12:18]
    assert error(motion, nastran["mug1"]) < 5e-8  # seen 2e-8
    turns = np.arange(1, 31) // 2 % 3  # two in a row are one
    assert error((T.T @ applied_loads(held.model))[:, turns], nastran["px"]) < 5e-8


@pytest.mark.parametrize(
    ("term", "apart"),
    [
        (dict(axial="consistent"), 5.3e-7),
        (dict(axial="lumped"), 5.3e-7),
        (dict(torsion=True), 5.7e-5),
        (dict(rotary=True), 2.5e-5),
    ],
)
def test_no_other_mass_is_that_of_nastran(held, basis, nastran, term, apart):
    """Each term alone moves the boundary mass by a thousand times the difference that is left (2e-11), or more."""
    other = with_mass(held, frame_mass(held.model, **(NASTRAN | term))).M
    T, exact = basis[0][:, b], nastran["mxx"][b, b]
    assert error(T.T @ (other @ T), exact) == pytest.approx(apart, rel=0.1)


def test_mass_of_the_library_is_the_consistent_one(held):
    consistent = frame_mass(held.model, **CONSISTENT)
    assert abs(consistent - held.model.M).max() < 1e-14 * abs(held.model.M).max()


def test_mass_of_the_library_as_nastran_distributes_it(mesh, held):
    sections = {name: in_single_precision(section) for name, section in mesh.properties.items()}
    ends = {f"grid_{n}": mp.Interface(node=n, kind="node") for n in BOUNDARY}
    M = mp.assemble(mesh, sections, ends, mass="nastran").M
    assert abs(frame_mass(held.model, **NASTRAN) - M).max() < 1e-14 * abs(M).max()


def test_blocks_with_the_mass_of_the_library(held, nastran):
    """What rotary inertia and inertia about the axis change; the stiffness and the boundary motions stay."""
    T = matched(craig_bampton_basis(held, all_loads(held)), held.M, nastran)
    K, M = T.T @ (held.K @ T), T.T @ (held.M @ T)
    assert error(M[b, b], nastran["mxx"][b, b]) < 1e-4  # seen 8e-5
    assert worst_column(M[b, 24:30], nastran["mxx"][b, 24:30]) < 3e-4  # seen 2e-4
    assert worst_column(M[b, 30:], nastran["mxx"][b, 30:]) < 6e-3  # seen 5e-3: vectors above 188 Hz
    np.testing.assert_allclose(M[q, q], np.eye(8), atol=1e-12)
    apart = frequency(K) / frequency(nastran["kxx"]) - 1
    assert np.all(np.abs(apart[:7]) < 2e-4)  # seen 1e-5, 1e-5, 1.7e-4; 4e-5, 4e-5, 2e-5, 1.7e-4
    assert abs(apart[7]) < 2e-3  # 209 Hz, a vector between the modes of single bars; seen 1.3e-3
    assert np.all(apart[:3] < 0)  # more inertia


def test_vectors_above_50_hz_are_no_modes(held, nastran):
    """Nor do single bars, which bend from 88 Hz on, appear among them."""
    bars = with_mass(held, frame_mass(held.model, **NASTRAN))
    exact = frequency(nastran["kxx"])
    w2, _, _ = lowest_modes(bars.K_ii, bars.M_ii, 12, factor=bars.factor)
    natural = np.sqrt(w2) / (2 * np.pi)
    np.testing.assert_allclose(natural[:3], exact[:3], rtol=1e-7)
    assert np.all(natural[3:5] < exact[3:5] * (1 - 1e-3))
    assert np.all(natural[5:] < exact[5])


@pytest.mark.parametrize("kept", [slice(0, 3), slice(3, 9)], ids=["applied only", "inertia only"])
def test_residual_vectors_answer_both_kinds_of_loads(held, nastran, kept):
    bars = with_mass(held, frame_mass(held.model, **NASTRAN))
    w2, Phi, _ = lowest_modes(bars.K_ii, bars.M_ii, 3, factor=bars.factor)
    w2, _ = truncation_vectors(bars, all_loads(bars)[bars.i, kept], w2, Phi)
    found = (np.sqrt(w2) / (2 * np.pi))[:5]
    assert np.abs(found / frequency(nastran["kxx"])[3 : 3 + len(found)] - 1).max() > 0.05
