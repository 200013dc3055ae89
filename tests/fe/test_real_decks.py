"""Decks of real projects, with Nastran's own answers where they have them."""

import os
from pathlib import Path

import numpy as np
import pytest

import modalprep as mp
from modalprep.linalg.modes import lowest_modes
from modalprep.reduction.clamped import clamp

DATA = Path(os.environ.get("MODALPREP_DATA", Path(__file__).parents[3] / "shared" / "data"))
pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason=f"the decks are not in {DATA} (set MODALPREP_DATA)")
SLINCH = 0.45359237 * 9.80665 / 0.0254


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
def inboard():
    """The frame with its four boundary grids held, and MSC Nastran's reduction of it (deck units: mm, kg, s)."""
    mesh = mp.read_mesh(DATA / "nastran_cb" / "inboard.dat", "mm", "kg")
    ends = {f"grid_{n}": mp.Interface(node=n, kind="node") for n in (3, 11, 19, 27)}
    held = clamp(mp.assemble(mesh, {}, ends))
    T = np.zeros((held.K.shape[0], 24))
    T[held.b, np.arange(24)], T[held.i] = 1.0, held.Psi
    unit = np.tile([1e-3, 1e-3, 1e-3, 1, 1, 1], 4)  # mm, rad
    turn = np.eye(24)  # grid 11 moves in CORD2R 10: z along basic x, x along basic y
    turn[6:9, 6:9] = turn[9:12, 9:12] = [[0, 1, 0], [0, 0, 1], [1, 0, 0]]
    reduced = [turn @ (unit[:, None] * (T.T @ A @ T) * unit) @ turn.T / 1e-6 for A in (held.K, held.M)]
    return held, reduced, read_op4(DATA / "nastran_cb" / "inboard.op4")


def test_boundary_stiffness_is_that_of_nastran(inboard):
    _, (K, _), nastran = inboard
    exact = nastran["kxx"][:24, :24]
    np.testing.assert_allclose(K, exact, atol=1e-8 * np.abs(exact).max(), rtol=0)  # seen 2e-10


def test_boundary_mass_is_that_of_nastran(inboard):
    _, (_, M), nastran = inboard
    exact = nastran["mxx"][:24, :24]
    # seen 8e-5: the CBAR's coupled mass leaves out the rotary inertia of the section, which ours has
    np.testing.assert_allclose(M, exact, atol=2e-4 * np.abs(exact).max(), rtol=0)


def test_fixed_interface_modes_are_those_of_nastran(inboard):
    held, _, nastran = inboard
    exact = np.sqrt(np.diag(nastran["kxx"])[24:27]) / (2 * np.pi)
    w2, _ = lowest_modes(held.K_ii, held.M_ii, 3, factor=held.factor)
    # bending of the frame; above, single bars bend between joints and their mass matrices differ
    np.testing.assert_allclose(np.sqrt(w2) / (2 * np.pi), exact, rtol=3e-4)


@pytest.fixture(scope="module")
def isat():
    mesh = mp.read_mesh(DATA / "isat" / "ISat_Launch_Sm_4pt.dat", "in", "slinch")
    return mp.assemble(mesh, {}, {f"mount_{k}": mp.Interface(node=5629 + k, kind="node") for k in range(1, 5)})


def test_isat_floats_with_six_rigid_motions():
    """On its adapter: a single foot is a bipod on two bushings, which turns about their line without strain."""
    mesh = mp.read_mesh(DATA / "isat" / "ISat_Launch_Sm_4pt.dat", "in", "slinch")
    model = mp.assemble(mesh, {}, {"adapter": mp.Interface(group="spc_1")})
    K, M = ((model.C.T @ A @ model.C).tocsr() for A in (model.K, model.M))
    w2, _ = lowest_modes(K, M, 8, shift=-100.0)
    frequency = np.sqrt(np.abs(w2)) / (2 * np.pi)
    assert np.all(frequency[:6] < 1e-3)  # round-off: 1e-16 of stiffnesses of 4e10 N/m on 310 kg
    assert frequency[6] > 5.0
    assert all(check.passed for check in mp.check_model(model))


def test_isat_goes_the_whole_road(isat, tmp_path):
    body = mp.flexible_body(isat, mp.craig_bampton(isat, modes=20, truncation=()), name="isat")
    body = mp.read_body(mp.write_body(body, tmp_path / "isat.h5"))
    assert body.m == pytest.approx(310.780, rel=1e-5)  # test_nastran.py sums the cards
    assert [check.name for check in mp.check_body(body) if not check.passed] == []
    # each mount is a bipod on two bushings without rotational stiffness: it turns freely about their line
    assert np.count_nonzero(body.frequency == 0) == 4
    assert body.interface_name == ("mount_1", "mount_2", "mount_3", "mount_4")


def test_every_family_of_the_small_deck(tmp_path):
    mesh = mp.read_mesh(DATA / "nastran_modes" / "mode_solid_shell_bar.bdf", "m", "kg")
    model = mp.assemble(mesh, {}, {"base": mp.Interface(box=((-1, -1, -3.1), (2, 2, -2.9)))})
    assert set(model.cells) == {"hexahedron", "wedge", "tetra", "quad", "triangle", "line"}
    assert all(check.passed for check in mp.check_model(model))
    held = clamp(model)
    w2, _ = lowest_modes(held.K_ii, held.M_ii, 3, factor=held.factor)
    nastran = [71.26832, 75.95746, 125.7872]
    # a dozen elements: bending within 3 %; torsion of the shells, where formulations differ most, within 15 %
    np.testing.assert_allclose(np.sqrt(w2[:2]) / (2 * np.pi), nastran[:2], rtol=0.03)
    np.testing.assert_allclose(np.sqrt(w2[2]) / (2 * np.pi), nastran[2], rtol=0.15)
    assert any("hidden hinge" in note for note in model.notes)
