"""Shell elements in space: rigid motions and mass of distorted, warped patches; the obstacle course of shells."""

import numpy as np
import pytest
from analytic import (
    HEMISPHERE,
    HEMISPHERE_PRINTED,
    PINCHED_CYLINDER,
    SCORDELIS_LO,
    SCORDELIS_LO_DEEP,
    THIN_TWISTED_BEAM,
    TWISTED_BEAM,
)
from structured import (
    free_dofs,
    free_spectrum,
    random_rotation,
    random_surface,
    rigid_residual,
    shell_model,
    static,
    surface,
    zero_modes,
)

import modalprep as mp
from modalprep.fe.elements.shells.shell import ShellBlock
from modalprep.fe.properties.properties import Shell

KINDS = ("triangle", "quad")
FAMILIES = [("triangle", "opt"), ("triangle", "cst"), ("quad", "opt")]
ALUMINIUM = mp.Material(E=7e10, nu=0.33, rho=2700.0)


# --- rigid motions and mass ---------------------------------------------------------------------------------------


def element_areas(points, cells):
    """Triangles, or quads projected on the plane of their diagonals: ``|d1 x d2| / 2``."""
    p = points[cells]
    sides = (p[:, 2] - p[:, 0], p[:, 3] - p[:, 1]) if cells.shape[1] == 4 else (p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    return np.linalg.norm(np.cross(*sides), axis=1) / 2


@pytest.mark.parametrize(("kind", "membrane"), FAMILIES)
@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("offset", [0.0, 0.03])
def test_rigid_motions_and_mass(kind, membrane, seed, offset):
    points, cells = random_surface(kind, seed)
    section = Shell(material=ALUMINIUM, thickness=0.02, membrane=membrane, offset=offset)
    model = shell_model(points, cells, section, corner=5)
    assert np.abs(zero_modes(model, free_dofs(model))[:6]).max() < 1e-10
    lowest = np.linalg.eigvalsh(model.M.toarray())[0]
    assert lowest > -1e-15 * abs(model.M).max()
    assert rigid_residual(model, free_dofs(model)) < 1e-15  # round-off: 1e-16 measured
    assert model.rigid.m == pytest.approx(element_areas(points, cells).sum() * 0.02 * 2700.0, rel=1e-14)
    assert [check.name for check in mp.body.check_model(model) if not check.passed] == []


@pytest.mark.parametrize("kind", KINDS)
def test_only_drilling_is_massless(kind):
    points, cells = surface(3, 3, kind, distort=0.2)
    model = shell_model(points, cells, Shell(material=ALUMINIUM, thickness=0.02))
    M = model.M.toarray()
    drilling = model.dof[:, 5]
    others = np.setdiff1d(np.arange(model.n_dof), drilling)
    assert np.abs(M[drilling]).max() == 0
    scale = 1 / np.sqrt(M.diagonal()[others])
    assert np.linalg.eigvalsh(M[np.ix_(others, others)] * scale * scale[:, None])[0] > 1e-3  # 1/9 of a bilinear mass


@pytest.mark.parametrize("kind", KINDS)
def test_inertia_of_a_flat_plate(kind):
    points, cells = surface(4, 3, kind, distort=0.25)
    points = points * (0.6, 0.4, 1.0)
    model = shell_model(points, cells, Shell(material=ALUMINIUM, thickness=0.02))
    m = 0.6 * 0.4 * 0.02 * 2700.0
    assert model.rigid.m == pytest.approx(m, rel=1e-13)
    np.testing.assert_allclose(model.rigid.s0, m * np.array([0.3, 0.2, 0.0]), atol=1e-13 * m)
    second = m * np.array([[0.6**2 / 3, 0.3 * 0.2], [0.3 * 0.2, 0.4**2 / 3]])
    np.testing.assert_allclose(model.rigid.E0[:2, :2], second, rtol=1e-12)
    assert model.rigid.E0[2, 2] == pytest.approx(m * 0.02**2 / 12, rel=1e-12)  # through the thickness


@pytest.mark.parametrize("kind", KINDS)
def test_offset_only_moves_the_nodes(kind):
    points, cells = surface(5, 4, kind, distort=0.2)
    points = points @ random_rotation(2).T
    w2 = []
    for offset in (0.0, 0.07):
        model = shell_model(points, cells, Shell(material=ALUMINIUM, thickness=0.02, offset=offset))
        w2.append(free_spectrum(model, free_dofs(model), 18)[6:])
        normal = random_rotation(2)[:, 2]
        assert (model.rigid.s0 / model.rigid.m) @ normal == pytest.approx(offset, abs=1e-12)
    np.testing.assert_allclose(w2[1], w2[0], rtol=1e-8)  # a flat plate cannot feel where its nodes are


# --- statics ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("kind", "membrane"), FAMILIES)
def test_stiffness_is_the_energy_of_the_strains(kind, membrane):
    """``K = sum dx B^T C B``: of an unsymmetric laminate beside warped elements, whose fibres turn from cell to cell.

    The two are summed in different axes, with the internal displacements condensed before and after.
    """
    ply = mp.fe.Orthotropic(E1=135e9, E2=9e9, nu12=0.31, G12=4.7e9, G13=4.4e9, G23=3.1e9, rho=1580.0)
    plies = (mp.fe.Ply(material=ply, thickness=2e-3, angle=0.3), mp.fe.Ply(material=ALUMINIUM, thickness=4e-3))
    points, cells = random_surface(kind, 5)
    data = {"angle": np.linspace(0.0, 1.0, len(cells))}
    section = Shell(plies=plies, offset=0.02, membrane=membrane)
    block = ShellBlock.build(kind, points, cells, section, data, np.zeros(3))
    B, C, dx = block.strain
    wanted = np.einsum("eqsi,est,eqtj,eq->eij", B, C, B, dx, optimize=True)
    K = block.stiffness()
    np.testing.assert_allclose(K, wanted, rtol=0, atol=1e-13 * np.abs(K).max())
    np.testing.assert_array_equal(K, K.transpose(0, 2, 1))


def on(values, target):
    return np.isclose(values, target, atol=1e-7 * max(np.ptp(values), 1e-300))


def scordelis_lo(kind, n, membrane, lumped=True):
    """The weight lumped to the corners, as others do; the consistent one comes from the linked deflection."""
    R, L, angle = 25.0, 50.0, np.radians(40)
    points, cells = surface(
        n, n, kind, lambda s, y: (R * np.sin(angle * s), L / 2 * y, R * np.cos(angle * s)), diagonal="alternating"
    )
    t = 0.25  # weight 90 per area
    mat = mp.Material(E=4.32e8, nu=0.0, rho=90.0 / t)
    model = shell_model(points, cells, Shell(material=mat, thickness=t, membrane=membrane))
    x, y = points[:, 0], points[:, 1]
    crown, diaphragm, middle = on(x, 0.0), on(y, 0.0), on(y, L / 2)
    load = -model.g[:, 2]
    if lumped:
        share = 90.0 * element_areas(points, cells) / cells.shape[1]
        load = np.zeros(model.n_dof)
        np.add.at(load, model.dof[cells, 2], -share[:, None])
    held = [model.dof[crown][:, [0, 4, 5]], model.dof[middle][:, [1, 3, 5]], model.dof[diaphragm][:, [0, 2]]]
    d = static(model, free_dofs(model, *held), load)
    corner = np.flatnonzero(on(x, x.max()) & middle)[0]
    return -d[model.dof[corner, 2]] / SCORDELIS_LO


def pinched_cylinder(kind, n, membrane):
    R, L = 300.0, 600.0
    points, cells = surface(
        n,
        n,
        kind,
        lambda s, y: (R * np.sin(s * np.pi / 2), L / 2 * y, R * np.cos(s * np.pi / 2)),
        diagonal="alternating",
    )
    mat = mp.Material(E=3e6, nu=0.3, rho=1.0)
    model = shell_model(points, cells, Shell(material=mat, thickness=3.0, membrane=membrane))
    x, y, z = points.T
    held = [
        model.dof[on(x, 0.0)][:, [0, 4, 5]],
        model.dof[on(y, 0.0)][:, [1, 3, 5]],
        model.dof[on(z, 0.0)][:, [2, 3, 4]],
        model.dof[on(y, L / 2)][:, [0, 2, 4]],
    ]
    load = np.zeros(model.n_dof)
    top = np.flatnonzero(on(x, 0.0) & on(y, 0.0))[0]
    load[model.dof[top, 2]] = -0.25
    d = static(model, free_dofs(model, *held), load)
    return -d[model.dof[top, 2]] / PINCHED_CYLINDER


def hemisphere(kind, n, membrane):
    """Quarter of the hemisphere with a hole of 18 degrees, radial unit forces at the equator."""

    def shape(s, v):
        rise, turn = np.radians(72 * v), s * np.pi / 2
        return 10 * np.cos(rise) * np.cos(turn), 10 * np.cos(rise) * np.sin(turn), 10 * np.sin(rise)

    points, cells = surface(n, n, kind, shape, diagonal="alternating")
    mat = mp.Material(E=6.825e7, nu=0.3, rho=1.0)
    model = shell_model(points, cells, Shell(material=mat, thickness=0.04, membrane=membrane))
    x, y, z = points.T
    a, b = (np.flatnonzero(on(z, 0.0) & on(c, 10.0))[0] for c in (x, y))
    held = [model.dof[on(y, 0.0)][:, [1, 3, 5]], model.dof[on(x, 0.0)][:, [0, 4, 5]], model.dof[a, 2]]
    load = np.zeros(model.n_dof)
    load[model.dof[a, 0]], load[model.dof[b, 1]] = 1.0, -1.0
    d = static(model, free_dofs(model, *held), load)
    return d[model.dof[a, 0]] / HEMISPHERE


def twisted_beam(kind, n, membrane, thin=False, along=6):
    """Ratios for tip loads along the tip's width (z) and across it (y); n elements wide, `along` times n long."""
    length, width = 12.0, 1.1
    points, cells = surface(
        along * n,
        n,
        kind,
        lambda s, v: (
            length * s,
            width * (v - 0.5) * np.cos(s * np.pi / 2),
            width * (v - 0.5) * np.sin(s * np.pi / 2),
        ),
        diagonal="alternating",
    )
    mat = mp.Material(E=29e6, nu=0.22, rho=1.0)
    model = shell_model(points, cells, Shell(material=mat, thickness=0.0032 if thin else 0.32, membrane=membrane))
    tip, middle = np.arange(len(points) - n - 1, len(points)), len(points) - 1 - n // 2
    share = np.full(n + 1, 1 / n)
    share[[0, -1]] /= 2
    force, exact = (1e-6, THIN_TWISTED_BEAM) if thin else (1.0, TWISTED_BEAM)
    load = np.zeros((model.n_dof, 2))
    load[model.dof[tip, 2], 0] = load[model.dof[tip, 1], 1] = force * share
    d = static(model, free_dofs(model, model.dof[: n + 1]), load)
    return np.array([d[model.dof[middle, 2], 0] / exact["z"], d[model.dof[middle, 1], 1] / exact["y"]])


def in_plane_cantilever(kind, membrane):
    """Tip deflection of 20 x 2 elements, L/h = 10, over Timoshenko's."""
    L, h, t, mat = 10.0, 1.0, 0.1, mp.Material(E=1e7, nu=0.3, rho=1.0)
    points, cells = surface(20, 2, kind, diagonal="alternating")
    points = points * (L, h, 1.0)
    model = shell_model(points, cells, Shell(material=mat, thickness=t, membrane=membrane))
    tip = np.flatnonzero(on(points[:, 0], L))
    load = np.zeros(model.n_dof)
    load[model.dof[tip, 1]] = [0.25, 0.5, 0.25]
    d = static(model, free_dofs(model, model.dof[on(points[:, 0], 0.0)]), load)
    return d[model.dof[tip[1], 1]] / (L**3 / (3 * mat.E * t * h**3 / 12) + L / (5 / 6 * mat.G * t * h))


OPT, CST, QUAD = FAMILIES
# Value over the reference, n = 8 and 16. The limits are regression values to three decimals of a prototype of these
# elements, written before the package; none is published, and the elements may not be worse.
ROUNDED = 6e-4
OBSTACLES = [
    (scordelis_lo, OPT, (1.003, 0.996)),
    (scordelis_lo, CST, (0.876, 0.959)),
    (scordelis_lo, QUAD, (1.004, 0.997)),
    (pinched_cylinder, OPT, (0.913, 0.998)),
    (
        pinched_cylinder,
        CST,
        (0.867, 0.983),
    ),  # of the prototype, with a drilling stiffness of 1; with 1e-2: 0.880, 0.988
    (pinched_cylinder, QUAD, (0.962, 1.023)),
    (hemisphere, OPT, (0.508, 0.945)),
    (hemisphere, CST, (0.997, 1.002)),
    (hemisphere, QUAD, (1.003, 1.011)),
]


@pytest.mark.parametrize(
    ("case", "family", "limit"), OBSTACLES, ids=[f"{case.__name__}-{'-'.join(family)}" for case, family, _ in OBSTACLES]
)
def test_obstacle_course(case, family, limit):
    found = np.array([case(family[0], n, family[1]) for n in (8, 16)])
    assert np.all(np.abs(found - 1) < np.abs(np.array(limit) - 1) + ROUNDED)


@pytest.mark.parametrize(("family", "limit"), [(OPT, 1.007), (CST, 0.62), (QUAD, 0.994)])
def test_in_plane_cantilever(family, limit):
    assert abs(in_plane_cantilever(*family) - 1) < abs(limit - 1) + ROUNDED


# of the prototype: .994-1.006, .985-1.01, 1.005-1.014; constant strain is poor in its plane (as the cantilever above):
# 0.848, 0.950 for the load across the tip
@pytest.mark.parametrize(("family", "along_tip", "across_tip"), [
    (OPT, (0.006, 0.006), (0.006, 0.006)),
    (CST, (0.015, 0.011), (0.153, 0.051)),
    (QUAD, (0.005, 0.005), (0.014, 0.014)),
])  # fmt: skip
def test_twisted_beam(family, along_tip, across_tip):
    found = np.array([twisted_beam(family[0], n, family[1]) for n in (2, 4)])
    assert np.all(np.abs(found[:, 0] - 1) < np.array(along_tip) + ROUNDED)
    assert np.all(np.abs(found[:, 1] - 1) < np.array(across_tip) + ROUNDED)


@pytest.mark.parametrize(
    ("family", "limits"), [(OPT, (0.108, 0.205, 0.726)), (CST, (0.543, 0.938, 0.991)), (QUAD, (1.005, 1.003, 1.000))]
)  # of the prototype for the load along the tip, .11 .21 .73, .54 .94 .99, 1.005 1.003 1.000; digits measured here
def test_thin_twisted_strip(family, limits):
    for n, value in zip((2, 4, 8), limits, strict=True):
        along_tip, across_tip = np.abs(twisted_beam(family[0], n, family[1], thin=True) - 1)
        assert along_tip < abs(value - 1) + ROUNDED
        assert across_tip < abs(value - 1) + 2 * ROUNDED


@pytest.mark.parametrize("family", [OPT, QUAD])
def test_scordelis_lo_with_consistent_weight(family):
    found = [scordelis_lo(family[0], n, family[1], lumped=False) for n in (8, 16)]
    assert np.all(np.abs(np.array(found) * SCORDELIS_LO / SCORDELIS_LO_DEEP - 1) < [3e-3, 1e-3])


def test_hemisphere_lies_between_the_printed_values():
    low, high = HEMISPHERE_PRINTED
    assert low < hemisphere("quad", 16, "opt") * HEMISPHERE < high
