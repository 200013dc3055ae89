"""Matrices of Ansys in .full files: those of a real run, those that the test writes, and damaged ones."""

import contextlib
import random

import numpy as np
import pytest
import shared_data
from fe import matrix_writers as write
from fe.ansys_decks import deck, eblock, nblock
from fe.matrix_cases import LABELS, beam, nodes_csv
from size import seeds

import modalprep as mp
from modalprep.errors import InputError
from modalprep.fe import read_matrices
from modalprep.linalg.modes import lowest_modes

DATA = shared_data.DATA / "ansys"


@pytest.fixture
def written(tmp_path):
    def at(**header):
        K, M, points = beam()
        write.full(tmp_path / "file.full", K, M, LABELS, **header)
        nodes_csv(tmp_path / "nodes.csv", points)
        return {"file": tmp_path / "file.full", "nodes": tmp_path / "nodes.csv"}

    return at


@pytest.mark.skipif(not DATA.is_dir(), reason=f"the files are not in {DATA} (set MODALPREP_DATA)")
def test_matrices_of_a_real_run():
    """The frequencies that the documentation of PyMAPDL's reader prints for this file, in Hz as they stand.

    The beam of HexBeam.cdb has the same mesh, but aluminium in SI units instead of titanium in psi and inches: its
    frequencies are 39.7 times lower, which is near 4 pi^2 = 39.5 by chance.
    """
    matrices = read_matrices(file=DATA / "file.full", nodes=DATA / "HexBeam.cdb", length_unit="in", mass_unit="slinch")
    w2, _, _ = lowest_modes(matrices.K, matrices.M, 4)
    np.testing.assert_allclose(np.sqrt(w2) / (2 * np.pi), [1283.200, 1283.200, 5781.975, 6919.399], rtol=5e-7)
    with pytest.raises(
        InputError, match="leaves out 63 DOFs that supports hold, the first ux of node 1: write it without"
    ):
        matrices.model({"root": mp.Interface(node=1, kind="node")})


@pytest.mark.skipif(not DATA.is_dir(), reason=f"the files are not in {DATA} (set MODALPREP_DATA)")
def test_material_of_the_real_run_from_its_matrices():
    """Exact whatever the elements are: forces of a uniform strain, and the second moment of the mass, z = 0 held.

    The example's material is E = 16.9e6 psi, nu = 0.31, rho = 4.1408e-4 lbf s^2/in^4: titanium.
    """
    matrices = read_matrices(file=DATA / "file.full", nodes=DATA / "HexBeam.cdb")
    node, component = matrices.dof.T
    z = matrices.points[node, 2]
    stretch = np.where(component == 2, z, 0.0)
    E, nu = 16.9e6, 0.31
    modulus = E * (1 - nu) / ((1 + nu) * (1 - 2 * nu))
    assert (matrices.K @ stretch)[np.isclose(z, 5.0) & (component == 2)].sum() == pytest.approx(modulus, rel=1e-9)
    assert stretch @ matrices.M @ stretch == pytest.approx(4.1408e-4 * 5**3 / 3, rel=1e-9)


@pytest.mark.parametrize("order", "<>")
def test_what_is_written_is_read(written, order):
    K, M, _ = beam()
    matrices = read_matrices(**written(order=order))
    np.testing.assert_array_equal(matrices.K.toarray(), K.toarray())
    np.testing.assert_array_equal(matrices.M.toarray(), M.toarray())
    assert matrices.supported == ""


def test_held_equations_are_left_out(written):
    K, _, _ = beam()
    matrices = read_matrices(**written(held=range(6)))
    np.testing.assert_array_equal(matrices.K.toarray(), K.toarray()[6:, 6:])
    with pytest.raises(InputError, match="6 DOFs that supports hold, the first ux of node 11"):
        matrices.model({"tip": mp.Interface(node=71, kind="node")})


HEADER = {
    "h1": (4, "damaged, cut short or no .full"), "h2": (10**8, "damaged"), "h11": (1, "has a lumped mass matrix"),
    "h14": (1, "has unsymmetric matrices"), "h21": (3, "has constraint equations"), "h19": (0, "has no stiffness"),
    "h27": (0, "has no mass"),
}  # fmt: skip


@pytest.mark.parametrize("word", HEADER)
def test_kinds_that_cannot_be_read(written, word):
    value, message = HEADER[word]
    with pytest.raises(InputError, match=message):
        read_matrices(**written(**{word: value}))


def test_turned_nodes_are_refused(written, tmp_path):
    """Rows of a turned node belong to its own axes."""
    points = [(*point, 0, 0, 0) for point in beam()[2]]
    lines = ["ET,1,180", *nblock(points[:-1]), "N,7,1,0,0,30", *eblock((1, 7))]
    with pytest.raises(InputError, match="1 nodes are turned .* the first is node 7"):
        read_matrices(**written() | {"nodes": deck(tmp_path, lines)})


@pytest.mark.parametrize("seed", seeds(40))
def test_damaged_files_are_read_or_refused(written, seed):
    files, rng = written(), random.Random(seed)
    content = bytearray(files["file"].read_bytes())
    if seed % 2:
        del content[rng.randrange(len(content)) :]
    for _ in range(seed % 5):
        if content:
            content[rng.randrange(len(content))] = rng.randrange(256)
    files["file"].write_bytes(content)
    with contextlib.suppress(InputError):
        assert len(read_matrices(**files).points)
