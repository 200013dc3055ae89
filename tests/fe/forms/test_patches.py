"""Patch tests and orders of convergence by the weak forms, as by the compiled elements."""

import numpy as np
import pytest
from scipy.sparse.linalg import eigsh
from structured import box, macneal_harder, random_rotation, shell_model, solid_model, surface

import modalprep as mp
from modalprep.examples import beam_mesh
from modalprep.fe.assembly.bases import structure_of
from modalprep.fe.assembly.forms import FORMS
from modalprep.fe.families import FAMILIES

STEEL = mp.Material(E=2e11, nu=0.25, rho=7800.0)
R = random_rotation(2)
GRADIENT = np.array([[1e-3, 4e-4, -2e-4], [3e-4, -5e-4, 1e-4], [2e-4, 6e-4, 7e-4]])


def stiffness(model):
    """Return K of the elements of a model by their weak forms, without what holds it."""
    return FORMS["plain"].stiffness.assemble(structure_of(model))


@pytest.mark.parametrize("kind", ["tetra", "pyramid", "wedge", "hexahedron", "tetra10"])
def test_solids_under_constant_strain(kind):
    points, cells = box(kind, (2, 2, 2), distort=0.25)
    model = solid_model(points @ R.T, cells, kind, mp.Solid(material=STEEL))
    inner = np.all((points > 1e-6) & (points < 1 - 1e-6), axis=1)
    d = np.zeros(model.n_dof)
    d[model.dof[: len(points), :3]] = points @ R.T @ GRADIENT.T
    force = stiffness(model) @ d
    assert np.abs(force[model.dof[: len(points)][inner, :3]]).max() < 1e-12 * np.abs(force).max()


@pytest.mark.parametrize("kind", [kind for kind in FAMILIES[mp.Shell]])
def test_shells_under_constant_curvature(kind):
    """MacNeal and Harder's patch, bent to ``w = (x^2 + x y + y^2) / 2000`` with the rotations of thin plates."""
    points, cells = macneal_harder(kind)
    model = shell_model(points @ R.T, cells, mp.Shell(material=STEEL, thickness=0.001))
    x, y, _ = points.T
    w = 5e-4 * (x * x + x * y + y * y)
    turn = 5e-4 * np.stack([x + 2 * y, -(2 * x + y), 0 * x], axis=1)  # w,y and -w,x
    d = np.zeros(model.n_dof)
    own = model.dof[: len(points)]
    d[own[:, :3]], d[own[:, 3:]] = np.outer(w, R[:, 2]), turn @ R.T
    K = stiffness(model)
    force = K @ d
    on_edge = (np.abs(x * (x - 0.24)) < 1e-9) | (np.abs(y * (y - 0.12)) < 1e-9)
    rounding = 1e-15 * abs(K).max() * np.abs(d).max()  # of the membrane, which does not stretch
    assert rounding < 1e-5 * np.abs(force).max()
    assert np.abs(force[own[~on_edge]]).max() < rounding


def lowest(model):
    """The lowest elastic eigenvalue of a model that nothing holds, by weak forms."""
    structure = structure_of(model)
    K, M = (form.assemble(structure) for form in (FORMS["plain"].stiffness, FORMS["plain"].mass))
    used = np.flatnonzero(abs(K).sum(axis=1) > 0)
    K, M = (A.tocsr()[used][:, used].tocsc() for A in (K, M))
    found = eigsh(K, k=8, M=M, sigma=-1e4, return_eigenvectors=False)  # which may miss one of six equal ones
    return found[found > 1e-2 * found.max()].min()  # those of rigid motions are round-off


def order(values):
    """The order of convergence of values on three meshes, each of half the size of the last."""
    return np.log2((values[0] - values[1]) / (values[1] - values[2]))


# Eigenvalues converge with 2, of second order with 4; wedges and tetrahedra reach it on finer meshes.
@pytest.mark.parametrize(
    ("kind", "sizes", "least"),
    [
        ("tetra", (2, 4, 8), 1.7),
        ("pyramid", (2, 4, 8), 1.9),
        ("wedge", (2, 4, 8), 1.5),
        ("hexahedron", (2, 4, 8), 1.9),
        ("tetra10", (1, 2, 4), 1.7),
        ("wedge15", (1, 2, 4), 3.0),
        ("hexahedron20", (1, 2, 4), 3.9),
    ],
)
def test_order_of_convergence_of_solids(kind, sizes, least):
    """A block in free vibration."""
    meshes = [box(kind, (n, n, n), size=(1.0, 1.2, 1.5)) for n in sizes]
    found = order([lowest(solid_model(*mesh, kind, mp.Solid(material=STEEL))) for mesh in meshes])
    assert least < found < 4.5


@pytest.mark.parametrize(("kind", "least"), [("quad", 1.5), ("triangle6", 2.0), ("quad8", 3.5)])
def test_order_of_convergence_of_shells(kind, least):
    """A thin square plate in free vibration; thick ones have layers along their edges, too thin for these meshes."""
    thin = mp.Shell(material=STEEL, thickness=0.001)
    found = order([lowest(shell_model(*surface(n, n, kind), thin)) for n in (4, 8, 16)])
    assert least < found < 4.5


def test_order_of_convergence_of_beams():
    section = mp.Beam(material=STEEL, A=2e-4, Iy=2e-9, Iz=4e-9, J=3e-9)
    root = {"root": mp.Interface(group="root", kind="node")}
    found = order([lowest(mp.assemble(beam_mesh(n, 2.0), {"beam": section}, root)) for n in (4, 8, 16)])
    assert 3.5 < found < 4.5
