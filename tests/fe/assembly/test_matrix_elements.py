"""Matrices of a mesh in the model: a beam of which half is numbers, against the whole beam."""

import numpy as np
import pytest
from scipy.sparse import csr_array

import modalprep as mp
from modalprep.body.verify import check_projection
from modalprep.examples import beam_mesh, disc_sector, spinup_section

BEAM = {"beam": spinup_section()}
ROOT = {"root": mp.Interface(group="root", kind="node")}


def part(mesh, cells):
    """The mesh with some of its lines."""
    own = {"beam": {"line": np.arange(len(cells))}, "root": mesh.groups["root"]}
    return mesh.with_(cells={"line": mesh.cells["line"][cells], "vertex": mesh.cells["vertex"]}, groups=own)


@pytest.fixture(scope="module")
def mesh():
    """Two elements, and the matrices of two more."""
    mesh = beam_mesh(4)
    tail = mp.assemble(part(mesh, [2, 3]), BEAM, {"root": mp.Interface(node=3, kind="node")})
    rows = np.argwhere(tail.dof >= 0)  # numbered node by node
    return part(mesh, [0, 1]).with_(matrices=(mp.fe.MatrixElement(rows=rows, K=tail.K, M=tail.M, name="tail"),))


@pytest.fixture(scope="module")
def whole():
    return mp.assemble(beam_mesh(4), BEAM, ROOT)


def test_the_body_is_that_of_the_whole_beam(mesh, whole):
    """An interface at a node of matrices alone; all but the symmetric part of H and the geometric stiffness."""
    both = ROOT | {"tip": mp.Interface(node=5, kind="node")}
    model = mp.assemble(mesh, BEAM, both)
    ours, theirs = (
        mp.craig_bampton(one, modes=4, truncation=()) for one in (model, mp.assemble(beam_mesh(4), BEAM, both))
    )
    np.testing.assert_allclose(ours.frequency, theirs.frequency, rtol=1e-9)
    np.testing.assert_allclose(model.g, whole.g, atol=1e-12)
    h, H = model.h, whole.h
    np.testing.assert_allclose(h - h.transpose(0, 2, 1), H - H.transpose(0, 2, 1), atol=1e-12 * np.abs(H).max())
    body = mp.flexible_body(model, ours, name="beam")
    checks = [*check_projection(model, ours, body), *mp.check_body(body), *mp.body.check_model(model)]
    assert [check.name for check in checks if check.required and not check.passed] == []
    assert any("carry no geometric stiffness" in note for note in model.notes)


def test_nodes_of_matrices_alone_must_hang_together_with_the_model(mesh):
    [tail] = mesh.matrices
    with pytest.raises(mp.InputError, match="2 disconnected parts"):
        mp.assemble(
            mesh.with_(
                matrices=(tail.renumbered(np.array([0, 1, 5, 3, 4])),), points=np.vstack([mesh.points, [9, 0, 0]])
            ),
            BEAM,
            ROOT,
        )


def test_a_ring_cannot_copy_matrices():
    sector, _, cyclic = disc_sector()
    k = csr_array((1, 1))
    spring = mp.fe.MatrixElement(rows=np.array([[0, 0]]), K=k, M=k, name="line 8")
    with pytest.raises(mp.InputError, match=r"has matrices \(line 8\), which cannot be copied"):
        mp.fe.make_ring(sector.with_(matrices=(spring,)), cyclic)
