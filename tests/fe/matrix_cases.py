"""A beam and a solid whose matrices are written in each format."""

import numpy as np
import scipy.sparse as sp
from fe import matrix_writers as write
from structured import box

import modalprep as mp
from modalprep.examples import cantilever_model

BEAM = """
[interfaces.root]
node = 11

[interfaces.tip]
node = 71
boundary = "free"

[reduction]
modes = 3
truncation_vectors = []

[output]
pictures = "none"
"""
FACES = {
    "root": mp.Interface(plane=((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))),
    "tip": mp.Interface(plane=((1.0, 0.0, 0.0), (1.0, 0.0, 0.0))),
}
LABELS = np.arange(11, 81, 10)  # node numbers of the file


def beam():
    """K, M, nodes of a beam of six elements."""
    model = cantilever_model(6)
    return model.K, model.M, np.array(model.points)


def nodes_csv(path, points, labels=LABELS):
    rows = "".join(f"{g}, {x:.12g}, {y:.12g}, {z:.12g}\n" for g, (x, y, z) in zip(labels, points, strict=True))
    path.write_text("node, x, y, z\n" + rows)


def put_market(at):
    K, M, points = beam()
    write.market(at / "k.mtx", K)
    write.market(at / "m.mtx", M)
    nodes_csv(at / "nodes.csv", points)
    return 'stiffness = "k.mtx"\nmass = "m.mtx"\nnodes = "nodes.csv"\ndofs_per_node = 6'


def put_scipy(at):
    K, M, points = beam()
    sp.save_npz(at / "k.npz", sp.csc_matrix(K))
    sp.save_npz(at / "m.npz", sp.coo_array(M))
    nodes_csv(at / "nodes.csv", points)
    return 'stiffness = "k.npz"\nmass = "m.npz"\nnodes = "nodes.csv"'


def put_npy_nodes(at):
    K, M, points = beam()
    sp.save_npz(at / "k.npz", K)
    sp.save_npz(at / "m.npz", M)
    np.save(at / "nodes.npy", np.column_stack([LABELS, points]))
    return 'stiffness = "k.npz"\nmass = "m.npz"\nnodes = "nodes.npy"'


def put_archive(at):
    K, M, points = beam()
    np.savez(at / "model.npz", K=np.array(sp.csr_matrix(K), dtype=object), M=M.toarray(), nodes=points)
    nodes_csv(at / "nodes.csv", points)
    return 'file = "model.npz"\nnodes = "nodes.csv"'


def put_output4(at):
    K, M, points = beam()
    write.output4(at / "model.op4", {"KGG": K, "MGG": M})
    nodes_csv(at / "nodes.csv", points)
    return 'file = "model.op4"\nnodes = "nodes.csv"'


def put_dmig(at):
    K, M, points = beam()
    write.dmig(at / "model.bdf", {"KAAX": K, "MAAX": M}, LABELS, points)
    return 'file = "model.bdf"'


def put_dmig_and_deck(at):
    K, M, points = beam()
    write.dmig(at / "k.pch", {"K2GG": K}, LABELS)
    write.dmig(at / "m.pch", {"M2GG": M}, LABELS)
    write.dmig(at / "nodes.bdf", {}, LABELS, points)
    return 'stiffness = "k.pch"\nmass = "m.pch"\nnodes = "nodes.bdf"'


def put_substructure(at):
    K, M, points = beam()
    write.substructure(at / "z1.mtx", K, M, LABELS)
    nodes_csv(at / "nodes.csv", points)
    return 'file = "z1.mtx"\nnodes = "nodes.csv"'


def put_matrix_input(at):
    K, M, points = beam()
    write.matrix_input(at / "job_STIF1.mtx", K, LABELS)
    write.matrix_input(at / "job_MASS1.mtx", M, LABELS)
    nodes_csv(at / "nodes.csv", points)
    return 'stiffness = "job_STIF1.mtx"\nmass = "job_MASS1.mtx"\nnodes = "nodes.csv"'


def put_calculix(at):
    K, M, points = beam()
    order = np.random.default_rng(1).permutation(K.shape[0])
    write.coordinates(at / "job.sti", K[order][:, order])
    write.coordinates(at / "job.mas", M[order][:, order])
    (at / "job.dof").write_text("".join(f"{LABELS[k // 6]}.{k % 6 + 1}\n" for k in order))
    nodes_csv(at / "nodes.csv", points)
    return 'stiffness = "job.sti"\nmass = "job.mas"\nnodes = "nodes.csv"\ndof = "job.dof"'


SOLID = """
[matrices]
file = "fem.npz"

[interfaces.root]
group = "left"

[interfaces.tip]
group = "right"

[reduction]
modes = 5
truncation_vectors = []

[output]
pictures = "none"
"""


def solid():
    """K, M of the nodes of a distorted bar, its points and cells, and its direct model."""
    points, cells = box("hexahedron", (5, 2, 2), (1.0, 0.2, 0.1), distort=0.2)
    mesh = mp.fe.Mesh(points=points, cells={"hexahedron": cells}, groups={"b": {"hexahedron": np.arange(len(cells))}})
    alloy = mp.Solid(material=mp.Material(E=7e10, nu=0.3, rho=2700.0))
    model = mp.assemble(mesh, {"b": alloy}, FACES)
    n = 3 * len(points)
    sets = {"left": np.flatnonzero(points[:, 0] < 1e-9), "right": np.flatnonzero(points[:, 0] > 1 - 1e-9)}
    return model.K[:n, :n], model.M[:n, :n], points, cells, sets, model


def random_symmetric(n=60):
    A = sp.random_array((n, n), density=0.08, rng=np.random.default_rng(0)).toarray()
    A = A + A.T
    A[7] = A[:, 7] = 0.0
    return A


def put_full(at):
    K, M, points = beam()
    write.full(at / "file.full", K, M, LABELS)
    nodes_csv(at / "nodes.csv", points)
    return 'file = "file.full"\nnodes = "nodes.csv"'
