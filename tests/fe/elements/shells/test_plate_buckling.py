"""Buckling of plates and of a cylinder through the whole chain: edge load, static solution, prestress, eigenvalue."""

import numpy as np
import pytest
from analytic import PLATE_BUCKLING, PlateRitz, cylinder_buckling
from structured import buckling_factors, free_dofs, random_rotation, shell_model, static, surface

import modalprep as mp
from modalprep.fe.properties.properties import Shell

E, NU, T = 2.1e11, 0.3, 1e-3
STEEL = mp.Material(E=E, nu=NU, rho=7800.0)
N_REF = np.pi**2 * E * T**3 / (12 * (1 - NU**2))  # k = N a^2 / (pi^2 D) for a = 1


def plate_edges(points):
    x, y = points[:, :2].T
    return [np.isclose(a, b, atol=1e-12) for a in (x, y) for b in (0.0, 1.0)]


def edge_load(model, points, mask, along, force):
    """Nodal loads (n_dof,) of a uniform line load `force (fx, fy, fz)` in N/m on the nodes `mask`."""
    on = np.flatnonzero(mask)
    on = on[np.argsort(points[on, along])]
    length = np.diff(points[on, along])
    share = np.zeros(len(on))
    share[:-1] += length / 2
    share[1:] += length / 2
    load = np.zeros(model.n_dof)
    load[model.dof[on, :3]] = share[:, None] * np.asarray(force)
    return load


def critical(kind, n, Nx=0.0, Ny=0.0, Nxy=0.0, clamped=False, distort=0.0):
    """k of a square plate under compressive Nx, Ny and shear Nxy (per N_REF)."""
    points, cells = surface(n, n, kind, distort=distort, seed=1, diagonal="alternating")
    model = shell_model(points, cells, Shell(material=STEEL, thickness=T))
    left, right, bottom, top = plate_edges(points)
    load = (
        edge_load(model, points, right, 1, (-Nx * N_REF, Nxy * N_REF, 0))
        + edge_load(model, points, left, 1, (Nx * N_REF, -Nxy * N_REF, 0))
        + edge_load(model, points, top, 0, (Nxy * N_REF, -Ny * N_REF, 0))
        + edge_load(model, points, bottom, 0, (-Nxy * N_REF, Ny * N_REF, 0))
    )
    flat = model.dof[:, 2:5]  # the prestress lies in the plane
    far = np.flatnonzero(right & bottom)[0]
    d = static(model, free_dofs(model, flat, model.dof[0, :2], model.dof[far, 1]), load)
    x_sides, y_sides = left | right, bottom | top
    held = [model.dof[x_sides | y_sides, 2], model.dof[x_sides, 3], model.dof[y_sides, 4]]
    if clamped:
        held += [model.dof[x_sides | y_sides, 3], model.dof[x_sides | y_sides, 4]]
    keep = free_dofs(model, *held, components=(2, 3, 4))
    return buckling_factors(model, keep, d, load)[0]


CASES = {
    "uniaxial": {"Nx": 1.0},
    "biaxial": {"Nx": 1.0, "Ny": 1.0},
    "shear": {"Nxy": 1.0},
    "clamped": {"Nx": 1.0, "clamped": True},
}
# k at n = 8, 16, 32: regression values of a prototype of these elements, of the package itself for the last three; none
# is published, the exact values are
LIMITS = {
    ("triangle", "uniaxial"): (3.961, 3.990, 3.998),
    ("triangle", "biaxial"): (1.980, 1.995, 1.999),
    ("triangle", "shear"): (9.10, 9.25, 9.31),
    ("triangle", "clamped"): (9.82, 10.00, 10.05),
    ("quad", "uniaxial"): (3.909, 3.977, 3.994),
    ("quad", "biaxial"): (1.9547, 1.9884, 1.9971),
    ("quad", "shear"): (8.747, 9.165, 9.284),
    ("quad", "clamped"): (9.655, 9.956, 10.044),
}
DISTORTED = {"triangle": (3.960, 3.990, 3.997), "quad": (3.905, 3.975, 3.994)}  # inner nodes moved by 25 %


def last_digit(values):
    """Half of the last digit of printed values, and the round-off of the reference."""
    return np.where(np.array(values) > 9, 6e-3, 6e-4)


@pytest.mark.parametrize(("kind", "case"), list(LIMITS))
def test_plate_buckling(kind, case):
    found, limit = np.array([critical(kind, n, **CASES[case]) for n in (8, 16, 32)]), np.array(LIMITS[kind, case])
    exact = PLATE_BUCKLING[case]
    assert np.all(np.abs(found - exact) < np.abs(limit - exact) + last_digit(limit))


@pytest.mark.parametrize("kind", list(DISTORTED))
def test_distorted_plate_buckles_alike(kind):
    found, limit = np.array([critical(kind, n, Nx=1.0, distort=0.25) for n in (8, 16, 32)]), np.array(DISTORTED[kind])
    assert np.all(np.abs(found - 4) < np.abs(limit - 4) + last_digit(limit))


def test_references_of_buckling():
    simple, clamped = PlateRitz("SSSS", NU), PlateRitz("CCCC", NU)
    found = {
        "uniaxial": simple.buckling(1),
        "biaxial": simple.buckling(1, 1),
        "shear": simple.buckling(Nxy=1),
        "clamped": clamped.buckling(1),
    }
    assert found == pytest.approx(PLATE_BUCKLING, rel=1e-3)  # printed to three or four digits


# --- cylinder -----------------------------------------------------------------------------------------------------


def cylinder(kind, around, along):
    """Cylinder R = 1, L = R/2, t = R/100."""
    points, cells = surface(around, along, kind, lambda s, z: (np.cos(2 * np.pi * s), np.sin(2 * np.pi * s), z / 2))
    seam = np.arange(len(points))
    seam[-(along + 1) :] = np.arange(along + 1)
    points, cells = points[: -(along + 1)], seam[cells]
    return points, shell_model(points, cells, Shell(material=STEEL, thickness=0.01))


def cylinder_critical(points, model, d, load):
    """Factor on the prestress of d with the ends held radially and around."""
    ends = np.isclose(points[:, 2], 0) | np.isclose(points[:, 2], 0.5)
    keep = free_dofs(model, model.dof[ends][:, [0, 1]], model.dof[0, 2])
    return buckling_factors(model, keep, d, load)[0]


def uniform_compression(points, model, N):
    """Displacements (n_dof,) of a cylinder free to widen under the axial force N (N/m)."""
    d = np.zeros(model.n_dof)
    d[model.dof[:, :3]] = N / (E * 0.01) * points * (NU, NU, -1.0)
    return d


@pytest.mark.parametrize(("kind", "around", "along", "fe_md"), [("triangle", 72, 12, 0.978), ("quad", 96, 16, 0.972)])
def test_compressed_cylinder(kind, around, along, fe_md):
    points, model = cylinder(kind, around, along)
    exact = cylinder_buckling(E=E, nu=NU, t=0.01, R=1.0, L=0.5)
    d = uniform_compression(points, model, exact)
    found = cylinder_critical(points, model, d, model.K @ d)
    # the OPT triangle's drilling moments do not balance across folds: .9806 here, .9938 at 96x16, .9965 at 120x20
    assert found == pytest.approx(1.0, abs=0.0125 if kind == "quad" else 0.021)
    if kind == "quad":
        classical = E * 0.01**2 / np.sqrt(3 * (1 - NU**2))
        assert found * exact / classical == pytest.approx(fe_md, abs=6e-4)


def test_end_load_compresses_the_cylinder_uniformly():
    """Equal forces on the nodes of both ends; quads carry them without bending."""
    points, model = cylinder("quad", 48, 8)
    N = 1e5
    load = np.zeros(model.n_dof)
    share = N * 2 * np.sin(np.pi / 48)  # per node of the polygon
    load[model.dof[np.isclose(points[:, 2], 0.5), 2]], load[model.dof[np.isclose(points[:, 2], 0), 2]] = -share, share
    near, side, far = 0, 9 * 12, 9 * 24
    held = [model.dof[near, :3], model.dof[side, 2], model.dof[far, 1:3]]
    d = static(model, free_dofs(model, *held), load)
    exact = uniform_compression(points, model, N)
    stretch = (d - exact)[model.dof[:, :3]]
    assert np.abs(stretch - stretch[0]).max() < 1e-9 * np.abs(exact).max()


# --- prestress ----------------------------------------------------------------------------------------------------


def assert_prestress_turns(model, d):
    """Forces ``f = K d`` turn with the body: ``Kg (theta x x) = theta x f``."""
    f = model.K @ d
    Kg, R, dof = model.geometric_stiffness(d, f), model.rigid_body(), model.dof[:, :3]
    for a in range(3):
        exact = np.cross(np.eye(3)[a], f[dof])
        assert np.abs((Kg @ R[:, 3 + a])[dof] - exact).max() < 1e-9 * np.abs(f[dof]).max()
        assert np.abs((Kg @ R[:, a])[dof]).max() < 1e-9 * abs(Kg).max()  # translations meet no force


@pytest.mark.parametrize("kind", ["triangle", "quad"])
def test_plane_prestress_turns_with_the_body(kind):
    points, cells = surface(5, 4, kind, distort=0.25)
    R = random_rotation(5)
    model = shell_model(points @ R.T, cells, Shell(material=STEEL, thickness=0.01))
    strain = 1e-3 * np.array([[1.0, 0.4], [0.4, -0.7]])
    d = np.zeros(model.n_dof)
    d[model.dof[:, :3]] = points[:, :2] @ strain @ R[:, :2].T
    assert_prestress_turns(model, d)


def test_prestress_of_a_cylinder_turns_with_the_body():
    points, model = cylinder("quad", 24, 5)
    assert_prestress_turns(model, uniform_compression(points, model, 1e6))
