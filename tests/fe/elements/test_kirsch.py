"""Stress at the edge of a hole in a sheet under tension, Kirsch (1898): three times that far away, and minus once."""

import numpy as np
import pytest
from structured import box, free_dofs, shell_model, solid_model, static, surface

import modalprep as mp

STEEL = mp.Material(E=2e11, nu=0.3, rho=7800.0)
HOLE, OUTER, FAR, THICK = 1.0, 6.0, 1e6, 0.1  # m, m, Pa, m


def displacement(x, y):
    """Plane stress around a hole under tension along x; Timoshenko and Goodier, section 35, integrated."""
    r, a = np.hypot(x, y) / HOLE, np.arctan2(y, x)
    G, k = STEEL.G, (3 - STEEL.nu) / (1 + STEEL.nu)
    u = r * (k + 1) * np.cos(a) + 2 / r * ((1 + k) * np.cos(a) + np.cos(3 * a)) - 2 / r**3 * np.cos(3 * a)
    v = r * (k - 3) * np.sin(a) + 2 / r * ((1 - k) * np.sin(a) + np.sin(3 * a)) - 2 / r**3 * np.sin(3 * a)
    return FAR * HOLE / (8 * G) * np.stack([u, v], axis=1)


def quarter(s, t):
    """A quarter ring from the unit square, finer towards the hole."""
    r, a = HOLE * (OUTER / HOLE) ** s, np.pi / 2 * t
    return r * np.cos(a), r * np.sin(a)


def sheet(kind, n):
    points, cells = surface(n, n, kind, lambda s, t: (*quarter(s, t), 0 * s))
    model = shell_model(points, cells, mp.Shell(material=STEEL, thickness=THICK))
    return points, cells, model, (0, 1, 5), np.zeros(0, dtype=int)


def slab(kind, n):
    """One element through the thickness, free to become thinner."""
    points, cells = box(kind, (n, n, 1))
    points = np.stack([*quarter(points[:, 0], points[:, 1]), THICK * points[:, 2]], axis=1)
    model = solid_model(points, cells, kind, mp.Solid(material=STEEL))
    return points, cells, model, (0, 1, 2), model.dof[np.flatnonzero(points[:, 2] < 1e-9), 2]


@pytest.mark.parametrize(
    ("build", "kind", "n", "highest", "others"),
    [
        (sheet, "quad", 16, 1e-2, 0.15),
        (sheet, "triangle", 32, 1.5e-2, 0.15),
        (slab, "hexahedron", 16, 1e-2, 0.15),
        (slab, "hexahedron20", 8, 6e-3, 0.04),
        (slab, "tetra10", 16, 4e-3, 0.02),
    ],
)
def test_edge_of_a_hole(build, kind, n, highest, others):
    """The exact displacement on the outer edge, symmetry on the others: 3 FAR to `highest`, the rest over FAR.

    Radial stress is zero at the edge and rises fast from it; linear elements have that of half an element inside.
    """
    points, cells, model, components, flat = build(kind, n)
    outer, on_x, on_y = (np.flatnonzero(abs(c) < 1e-9 * OUTER) for c in (
        np.hypot(points[:, 0], points[:, 1]) - OUTER, points[:, 1], points[:, 0]))  # fmt: skip
    symmetric = [model.dof[on_x, 1], model.dof[on_y, 0]]
    if 5 in components:
        symmetric += [model.dof[on_x, 5], model.dof[on_y, 5]]
    d = np.zeros(model.n_dof)
    d[model.dof[outer, :2]] = displacement(*points[outer, :2].T)
    keep = free_dofs(model, model.dof[outer, :2], *symmetric, flat, components=components)
    d[keep] = static(model, keep, -(model.K @ d))[keep]
    mesh = mp.fe.Mesh(points=points, cells={kind: cells}, groups={})
    edge = {"top": mp.fe.StressPoint(near=(0, HOLE, 0)), "side": mp.fe.StressPoint(near=(HOLE, 0, 0))}
    found = mp.fe.stress_recovery(model, mesh, edge)(d[:, None])
    for name, exact in (("top", (3, 0, 0)), ("side", (0, -1, 0))):
        at = found.get(name) or found[f"{name}.bottom"]
        got = [at.modes[at.components.index(c), 0] / FAR for c in ("xx", "yy", "xy")]
        limits = [3 * highest, others, others] if name == "top" else [others] * 3
        assert np.all(np.abs(np.subtract(got, exact)) < limits), (name, got)
