"""Flat shells: patch tests, plate frequencies against Navier, Ritz, Mindlin and NAFEMS, thickness locking."""

import numpy as np
import pytest
from analytic import (
    NAFEMS_FV12,
    NAFEMS_FV16,
    PLATE_CANTILEVER,
    PLATE_CLAMPED,
    PLATE_FREE,
    PlateRitz,
    mindlin_simply_supported,
    thin_plate_simply_supported,
)
from structured import (
    SOLVER,
    free_dofs,
    frequencies,
    local_axes,
    macneal_harder,
    random_rotation,
    shell_model,
    submatrix,
    surface,
)

import modalprep as mp
from modalprep.fe.properties.properties import Shell
from modalprep.linalg.factor import factorise
from modalprep.linalg.modes import lowest_modes

STEEL = mp.Material(E=2.0e11, nu=0.3, rho=8000.0)
KINDS = ("triangle", "quad")
BENDING = (2, 3, 4)  # uz, rx, ry of a plate in the plane x-y: the others are not coupled to them


def plate(kind, n, *, t=1e-3, material=STEEL, side=1.0, **options):
    points, cells = surface(n, n, kind, **{"diagonal": "alternating", **options})
    return shell_model(points * side, cells, Shell(material=material, thickness=t))


def edges(model, side=1.0):
    """Node masks x = 0, x = side, y = 0, y = side."""
    x, y = (model.points + model.origin)[:, :2].T
    return [np.isclose(a, b, atol=1e-9 * side) for a in (x, y) for b in (0.0, side)]


def supported(model, code, side=1.0):
    """DOFs that stay free; code has C, S (hard: deflection and the rotation along the edge) or F for each edge."""
    held = []
    for i, (letter, on) in enumerate(zip(code, edges(model, side), strict=True)):
        along = 3 if i < 2 else 4  # the deflection's slope along x = const turns about x
        held.append(model.dof[on][:, {"F": [], "S": [2, along], "C": [2, 3, 4]}[letter]])
    return free_dofs(model, *held, components=BENDING)


def unit_frequency(t, side=1.0):
    """``sqrt(D / rho h) / a^2`` (rad/s)."""
    return np.sqrt(STEEL.E * t**2 / (12 * (1 - STEEL.nu**2) * STEEL.rho)) / side**2


def parameters(kind, n, code, count=6, *, t=1e-3, side=1.0):
    """``omega a^2 sqrt(rho h / D)``, rigid motions left out."""
    model, unit = plate(kind, n, t=t, side=side), unit_frequency(t, side)
    keep = supported(model, code, side)
    if code != "FFFF":
        return frequencies(model, keep, count) / unit
    K, M = (submatrix(A, keep) for A in (model.K, model.M))
    shift = -((10 * unit) ** 2)
    factor = factorise((K - shift * M).tocsr(), SOLVER)
    return np.sqrt(lowest_modes(K, M, 3 + count, factor=factor, shift=shift)[0][3:]) / unit


# --- patch tests --------------------------------------------------------------------------------------------------


def patch(kind, t, seed=4):
    """MacNeal and Harder's patch in an arbitrary plane, E = 1e6, nu = 0.25; DOFs in its own axes by Q."""
    points, cells = macneal_harder(kind)
    R = random_rotation(seed)
    section = Shell(material=mp.Material(E=1e6, nu=0.25, rho=1.0), thickness=t)
    model = shell_model(points @ R.T + 1.0, cells, section)
    return points, model, local_axes(model, R)


def solve_patch(model, Q, exact):
    """Hold the outer nodes at `exact (n, 6)` (own axes); return the inner error, relative, and the energy."""
    d = np.zeros(model.n_dof)
    d[model.dof] = exact
    K = (Q.T @ model.K @ Q).toarray()
    inner, outer = model.dof[4:].ravel(), model.dof[:4].ravel()
    found = np.linalg.solve(K[np.ix_(inner, inner)], -K[np.ix_(inner, outer)] @ d[outer])
    error = (found - d[inner]).reshape(-1, 6)
    scale = np.array([np.abs(exact[:, :3]).max()] * 3 + [np.abs(exact[:, 3:]).max()] * 3)
    d[inner] = found
    return np.abs(error / scale).max(), d @ K @ d / 2


@pytest.mark.parametrize("kind", KINDS)
def test_membrane_patch(kind):
    points, model, Q = patch(kind, 1e-3)
    G = 1e-3 * np.array([[1.0, 0.8], [-0.3, 0.6]])  # displacement gradient with rotation
    exact = np.zeros((8, 6))
    exact[:, :2] = points[:, :2] @ G.T
    exact[:, 5] = (G[1, 0] - G[0, 1]) / 2
    error, energy = solve_patch(model, Q, exact)
    ex, ey, gxy = G[0, 0], G[1, 1], G[0, 1] + G[1, 0]
    density = 1e6 / (1 - 0.25**2) * (ex**2 + ey**2 + 2 * 0.25 * ex * ey) + 1e6 / 2.5 * gxy**2
    assert error < 1e-8  # conditioning of bending against membrane, t/a = 4e-3
    assert energy == pytest.approx(density / 2 * 1e-3 * 0.24 * 0.12, rel=1e-9)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("t", [1e-3, 5e-2])
def test_bending_patch(kind, t):
    points, model, Q = patch(kind, t)
    x, y = points[:, :2].T
    kx, ky, kxy = 1e-3 * np.array([1.0, -0.4, 0.7])  # w,xx  w,yy  w,xy
    exact = np.zeros((8, 6))
    exact[:, 2] = (kx * x**2 + ky * y**2 + 2 * kxy * x * y) / 2
    exact[:, 3], exact[:, 4] = ky * y + kxy * x, -(kx * x + kxy * y)
    error, energy = solve_patch(model, Q, exact)
    D = 1e6 * t**3 / (12 * (1 - 0.25**2))
    density = D / 2 * ((kx + ky) ** 2 - 2 * (1 - 0.25) * (kx * ky - kxy**2))
    assert error < 1e-10  # round-off: 1e-11 .. 1e-13 measured
    assert energy == pytest.approx(density * 0.24 * 0.12, rel=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_a_distorted_patch_stretches_without_bending(kind):
    """A plate pulled by the displacements of constant strain carries exactly N times its width."""
    points, cells = surface(5, 4, kind, distort=0.25)
    model = shell_model(points, cells, Shell(material=STEEL, thickness=0.01))
    on = np.any(edges(model), axis=0)
    strain = 1e-4
    d = np.zeros(model.n_dof)
    d[model.dof[:, 0]], d[model.dof[:, 1]] = strain * points[:, 0], -STEEL.nu * strain * points[:, 1]
    force = model.K @ d
    pull = force[model.dof[edges(model)[1], 0]].sum()
    assert pull == pytest.approx(STEEL.E * strain * 0.01, rel=1e-10)
    assert np.abs(force[model.dof[~on]]).max() < 1e-10 * pull


# --- thin plates --------------------------------------------------------------------------------------------------

MODES = [0, 1, 3, 4]
# Errors in % of modes 1, 2, 4, 5 at n = 16 and 32 (square, t/a = 1e-3): regression values of a prototype of these
# elements, which may not be worse; not published
LARGEST = {
    ("triangle", "SSSS", 16): (0.13, 0.27, 0.48, 0.46),
    ("triangle", "SSSS", 32): (0.03, 0.07, 0.13, 0.12),
    ("triangle", "CCCC", 16): (0.36, 0.57, 0.86, 0.81),
    ("triangle", "CCCC", 32): (0.10, 0.16, 0.24, 0.23),
    ("triangle", "CFFF", 16): (0.02, 0.03, 0.04, 0.02),
    ("quad", "SSSS", 16): (0.29, 0.46, 1.15, 0.51),
    ("quad", "SSSS", 32): (0.07, 0.12, 0.29, 0.13),
    ("quad", "CCCC", 16): (0.55, 0.73, 1.68, 0.73),
    ("quad", "CCCC", 32): (0.14, 0.19, 0.44, 0.19),
    ("quad", "CFFF", 16): (0.02, 0.06, 0.12, 0.11),
}
HALF_DIGIT = 0.008  # %: these are rounded to 0.01 (0.005), the references to five digits (0.003)


def plate_reference(code):
    if code == "SSSS":
        pairs = [(1, 1), (1, 2), (2, 1), (2, 2), (1, 3), (3, 1)]
        return thin_plate_simply_supported(pairs, D=1.0, rho_h=1.0, a=1.0, b=1.0)
    return np.array({"CCCC": PLATE_CLAMPED, "CFFF": PLATE_CANTILEVER, "FFFF": PLATE_FREE}[code])


@pytest.mark.parametrize(("kind", "code", "n"), list(LARGEST))
def test_thin_plate_frequencies(kind, code, n):
    error = 100 * (parameters(kind, n, code) / plate_reference(code) - 1)[MODES]
    assert np.all(np.abs(error) < np.array(LARGEST[kind, code, n]) + HALF_DIGIT)


@pytest.mark.parametrize("kind", KINDS)
def test_plates_converge_with_order_two(kind):
    coarse, fine = (abs(parameters(kind, n, "CCCC", 1)[0] / PLATE_CLAMPED[0] - 1) for n in (12, 24))
    assert np.log2(coarse / fine) == pytest.approx(2.0, abs=0.2)


@pytest.mark.parametrize(
    ("code", "printed"), [("CCCC", PLATE_CLAMPED), ("CFFF", PLATE_CANTILEVER), ("FFFF", PLATE_FREE)]
)
def test_references_of_the_plates(code, printed):
    # polynomials of degree 18: converged to 1e-4 at the cantilever's corners, 1e-7 elsewhere
    np.testing.assert_allclose(PlateRitz(code, 0.3, 18).frequencies(6), printed, rtol=1e-4)


@pytest.mark.parametrize("kind", KINDS)
def test_no_locking_down_to_a_hundred_thousandth(kind):
    thin, thinnest = (parameters(kind, 8, "CCCC", 4, t=t) for t in (1e-3, 1e-5))
    np.testing.assert_allclose(thinnest, thin, rtol=1e-4)  # shear deformation at t/a = 1e-3: (t/a)^2 times 30


# --- thick plates -------------------------------------------------------------------------------------------------

MINDLIN = {  # error in % of modes 1, 2, 4 at 16 x 16, of the prototype
    ("triangle", 0.2): (0.01, 0.26, 0.65),
    ("triangle", 0.1): (0.07, 0.03, 0.05),
    ("quad", 0.2): (0.12, 0.04, 0.06),
    ("quad", 0.1): (0.19, 0.19, 0.50),
}


@pytest.mark.parametrize(("kind", "t"), list(MINDLIN))
def test_thick_plates_against_mindlin(kind, t):
    model = plate(kind, 16, t=t)
    exact = mindlin_simply_supported([(1, 1), (1, 2), (2, 2)], E=STEEL.E, nu=STEEL.nu, rho=STEEL.rho, h=t, a=1.0)
    error = 100 * (frequencies(model, supported(model, "SSSS"), 4)[[0, 1, 3]] / exact - 1)
    assert np.all(np.abs(error) < np.array(MINDLIN[kind, t]) + HALF_DIGIT)


# --- NAFEMS -------------------------------------------------------------------------------------------------------

# converged values: the parameters above times sqrt(D / rho h) / (2 pi a^2); the targets are Ritz bounds up to 1 % high
UNIT = np.sqrt(200e9 * 0.05**2 / (12 * (1 - 0.3**2) * 8000.0)) / (2 * np.pi * 10.0**2)
FV12_CONVERGED, FV16_CONVERGED = UNIT * np.array(PLATE_FREE), UNIT * np.array(PLATE_CANTILEVER)


@pytest.mark.parametrize(("kind", "limit"), [("triangle", 1.3e-3), ("quad", 1.3e-3)])
def test_nafems_fv12_free_plate(kind, limit):
    found = parameters(kind, 16, "FFFF", t=0.05, side=10.0) * unit_frequency(0.05, 10.0) / (2 * np.pi)
    assert np.all(np.abs(found / FV12_CONVERGED - 1) < limit)
    assert np.all(np.abs(found / NAFEMS_FV12 - 1) < 1.2e-2)  # upper bounds: 1 % above the converged fourth and sixth


@pytest.mark.parametrize(("kind", "limit"), [("triangle", 6e-4), ("quad", 4.6e-3)])
def test_nafems_fv16_cantilevered_plate(kind, limit):
    found = parameters(kind, 16, "CFFF", t=0.05, side=10.0) * unit_frequency(0.05, 10.0) / (2 * np.pi)
    assert np.all(np.abs(found / FV16_CONVERGED - 1) < limit)
    assert np.all(np.abs(found / NAFEMS_FV16 - 1) < 1.1e-2)  # upper bounds: up to 1 % above the converged values


@pytest.mark.parametrize("kind", KINDS)
def test_all_six_dofs_of_a_tilted_plate_give_the_plate_modes(kind):
    R = random_rotation(7)
    points, cells = surface(8, 8, kind)
    flat, tilted = (shell_model(p, cells, Shell(material=STEEL, thickness=0.02)) for p in (points, points @ R.T))
    clamped = np.isclose(points[:, 0], 0)
    found = [frequencies(m, free_dofs(m, m.dof[clamped]), 6) for m in (flat, tilted)]
    np.testing.assert_allclose(found[1], found[0], rtol=1e-8)  # round-off times membrane over bending stiffness
