"""Matrices of a beam and a solid written in each format, read back and reduced: the same body as the direct road."""

import shutil

import numpy as np
import pytest
import scipy.sparse as sp
from fe import matrix_writers as write
from fe.matrix_cases import (
    BEAM,
    SOLID,
    put_archive,
    put_calculix,
    put_dmig,
    put_dmig_and_deck,
    put_full,
    put_market,
    put_matrix_input,
    put_npy_nodes,
    put_output4,
    put_scipy,
    put_substructure,
    solid,
)

import modalprep as mp
from modalprep.cli import main
from modalprep.examples import cantilever_model
from modalprep.fe.external.files import read_matrices

# ten digits of K are 5e-11 of its terms, which are 1e3 times a bending mode's own stiffness
FULL, TEN_DIGITS = 1e-10, 1e-7

FORMATS = {
    "MatrixMarket": (put_market, FULL),
    "scipy": (put_scipy, FULL),
    "npy nodes": (put_npy_nodes, FULL),
    "archive": (put_archive, FULL),
    "OUTPUT4": (put_output4, TEN_DIGITS),
    "DMIG": (put_dmig, TEN_DIGITS),
    "DMIG and deck": (put_dmig_and_deck, TEN_DIGITS),
    "substructure": (put_substructure, FULL),
    "matrix input": (put_matrix_input, FULL),
    "CalculiX": (put_calculix, FULL),
    "Ansys": (put_full, FULL),
}


@pytest.mark.parametrize(("put", "limit"), FORMATS.values(), ids=FORMATS)
def test_each_format_gives_the_direct_body(tmp_path, put, limit):
    (tmp_path / "job.toml").write_text(f"[matrices]\n{put(tmp_path)}\n{BEAM}")
    assert main(["run", str(tmp_path / "job.toml"), "--json", "--no-report"]) == 0
    made = mp.read_body(tmp_path / "output/job/job.h5")
    model = cantilever_model(6)
    reduction = mp.craig_bampton(model, modes=3, truncation=())
    direct = mp.flexible_body(model, reduction, name="direct")
    for name in ("frequency", "m", "s0", "E0", "K"):
        a, b = np.asarray(getattr(made, name)), np.asarray(getattr(direct, name))
        assert np.abs(a - b).max() < limit * np.abs(b).max(), name
    assert np.allclose(made.S, direct.S, atol=limit * np.abs(direct.S).max())
    assert np.allclose(made.phi, direct.phi, atol=limit * np.abs(direct.phi).max())
    assert np.allclose(made.modes.effective_mass, direct.modes.effective_mass, atol=limit * made.m * 100)
    assert np.abs(made.H - direct.H).max() < 2e-5 * np.abs(direct.H).max()  # twice what test_matrices measures
    assert not made.has_geometric_stiffness


# --- solids by Exudyn's FEM file ------------------------------------------------------------------------------------


def same_solid(folder, model):
    made = mp.read_body(folder / "output/job/job.h5")
    direct = mp.flexible_body(model, mp.craig_bampton(model, modes=5, truncation=()), name="direct")
    for name in ("frequency", "m", "s0", "E0", "S", "H", "P", "phi", "psi"):
        a, b = np.asarray(getattr(made, name)), np.asarray(getattr(direct, name))
        assert np.abs(a - b).max() < 1e-8 * np.abs(b).max(), name  # centroids of nodes differ by round-off
    return made


def test_fem_archive(tmp_path):
    K, M, points, cells, sets, model = solid()
    write.fem_archive(tmp_path / "fem.npz", K, M, points, {"Name": "bar", "Hex8": cells}, sets)
    (tmp_path / "job.toml").write_text(SOLID)
    assert main(["run", str(tmp_path / "job.toml"), "--json", "--no-report"]) == 0
    made = same_solid(tmp_path, model)
    assert np.array_equal(made.cells["hexahedron"], cells)


def test_fem_archive_by_exudyn(tmp_path):
    FEM = pytest.importorskip("exudyn.FEM")
    K, M, points, cells, sets, model = solid()
    fem = FEM.FEMinterface()
    fem.nodes = {"Position": points}
    fem.elements = [{"Name": "bar", "Hex8": cells}]
    fem.stiffnessMatrix, fem.massMatrix = sp.csr_matrix(K), sp.csr_matrix(M)
    for name, nodes in sets.items():
        fem.nodeSets.append({"Name": name, "NodeNumbers": nodes, "NodeWeights": np.ones(len(nodes)) / len(nodes)})
    fem.SaveToFile(str(tmp_path / "fem.npz"))
    (tmp_path / "job.toml").write_text(SOLID)
    assert main(["run", str(tmp_path / "job.toml"), "--json", "--no-report"]) == 0
    same_solid(tmp_path, model)


def test_nodes_of_a_mesh_file_bring_groups_and_cells(tmp_path, project, bracket_model):
    """Matrices by scipy, nodes and groups by the .msh: as the direct road."""
    shutil.copy(project / "meshes" / "bracket.msh", tmp_path)
    n = 3 * len(bracket_model.points)
    sp.save_npz(tmp_path / "k.npz", bracket_model.K[:n, :n] * 1e-3)  # t, mm, s
    sp.save_npz(tmp_path / "m.npz", bracket_model.M[:n, :n] * 1e-3)
    files = {name: tmp_path / f for name, f in (("stiffness", "k.npz"), ("mass", "m.npz"), ("nodes", "bracket.msh"))}
    read = read_matrices(**files, length_unit="mm", mass_unit="t")
    model = read.model({name: mp.Interface(group=name) for name in ("bolt_a", "bolt_b")})
    assert np.allclose(model.origin, bracket_model.origin, atol=1e-12)
    assert "tetra10" in model.cells
    got, wanted = (mp.craig_bampton(m, modes=4, truncation=()).frequency for m in (model, bracket_model))
    assert np.allclose(got, wanted, rtol=1e-9)
