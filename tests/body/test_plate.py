"""Rotating cantilever plate from its modal body: axis along the root and normal to the plate, buckling."""

import numpy as np
import pytest
from scipy.linalg import eigh
from structured import surface

import modalprep as mp
from modalprep.multibody.analysis.spin import spin_modes

STEEL, THICK = mp.Material(E=200e9, nu=0.3, rho=8000.0), 1e-3
UNIT = np.sqrt(STEEL.E * THICK**2 / (12 * (1 - STEEL.nu**2) * STEEL.rho))  # rad/s: sqrt(D / rho h) / a^2 of a = 1 m
# square, edge x = 0 clamped, membrane prestress of the centrifugal field along x, omega a^2 sqrt(rho h/D) of modes 1-4:
# Rayleigh-Ritz with 11 beam functions in each direction and a membrane solution of its own, computed for this test
# (regression values, not published)
ROTATING = {1: (3.6394, 8.5697, 21.4250, 27.2281), 2: (4.1011, 8.7537, 21.8331, 27.3172),
            5: (6.4305, 9.9432, 24.3428, 28.0686)}  # fmt: skip
RELATIVE = (
    4e-3  # 20 x 20 quads, order h^2, on frequencies that the Ritz method gives from above (its own 12 x 12: 2e-4)
)


@pytest.fixture(scope="module")
def body():
    points, cells = surface(20, 20, "quad", lambda s, t: (s, t - 0.5, 0 * s))
    root = np.flatnonzero(points[:, 0] == 0)
    mesh = mp.fe.Mesh(
        points=points,
        cells={"quad": cells, "vertex": root[:, None]},
        groups={"plate": {"quad": np.arange(len(cells))}, "root": {"vertex": np.arange(len(root))}},
    )
    model = mp.assemble(
        mesh, {"plate": mp.Shell(material=STEEL, thickness=THICK)}, {"root": mp.Interface(group="root", kind="rbe2")}
    )
    return mp.flexible_body(model, mp.craig_bampton(model, modes=16, truncation=("inertia",)), name="plate")


@pytest.mark.parametrize("gamma", ROTATING)
def test_axis_along_the_root(body, gamma):
    """The field along x stiffens as in the table, the field across the plate softens: lambda^2 - gamma^2."""
    found = spin_modes(body, np.array([0, gamma * UNIT, 0])).frequency[:4] * 2 * np.pi / UNIT
    np.testing.assert_allclose(found, np.sqrt(np.array(ROTATING[gamma]) ** 2 - gamma**2), rtol=2 * RELATIVE)


@pytest.mark.parametrize("gamma", ROTATING)
def test_axis_normal_to_the_plate(body, gamma):
    """The table has the field along x only; that along y, ``N_y = rho h w^2 (a^2/4 - y^2)/2``, adds w^2 to torsion.

    Rayleigh with ``w = f(x) y``: ``int N_y w,y^2 / int rho h w^2 = w^2``; bending along x does not feel it.
    """
    found = spin_modes(body, np.array([0, 0, gamma * UNIT])).frequency[:2] * 2 * np.pi / UNIT
    bending, torsion = ROTATING[gamma][:2]
    assert found[0] == pytest.approx(bending, rel=RELATIVE)
    assert found[1] == pytest.approx(np.hypot(torsion, gamma), rel=2 * RELATIVE)


def test_buckling_under_acceleration_in_the_plane(body):
    """``rho h a^3 acc / D = 7.62794`` by the same Ritz series; 7.837 of a beam, less by the free sides."""
    factor = 1 / eigh(-body.Kg_A[0], np.diag(body.K), eigvals_only=True)[-1]
    assert factor / UNIT**2 == pytest.approx(7.62794, rel=RELATIVE)
