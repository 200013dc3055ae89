"""Patch tests and an order of convergence by the weak forms, as by the compiled elements."""

import numpy as np
import pytest
from structured import box, macneal_harder, random_rotation, shell_model, solid_model

import modalprep as mp
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


def test_order_of_convergence():
    """A clamped plane strip of hexahedra in bending: the energy converges with order two."""
    energies = []
    for n in (2, 4, 8):
        points, cells = box("hexahedron", (2 * n, 1, n), size=(2.0, 0.5, 1.0))
        model = solid_model(points, cells, "hexahedron", mp.Solid(material=STEEL), np.flatnonzero(points[:, 0] < 1e-9))
        K = stiffness(model).toarray()
        free = model.dof[: len(points)][points[:, 0] > 1e-9, :3].ravel()
        end = points[:, 0] > 2 - 1e-9
        z = points[end, 2]
        share = np.where((z < 1e-9) | (z > 1 - 1e-9), 0.5, 1.0) / n / 2
        load = np.zeros(model.n_dof)
        load[model.dof[: len(points)][end, 0]] = 1e6 * share * (z - 0.5)
        energies.append(load[free] @ np.linalg.solve(K[np.ix_(free, free)], load[free]))
    order = np.log2((energies[1] - energies[0]) / (energies[2] - energies[1]))
    assert 1.5 < order < 2.6
