"""Curved shells of six, eight and nine nodes: rigid motions, patches, plates, buckling, stress, refusals, files."""

import numpy as np
import pytest
from analytic import (
    PLATE_CLAMPED,
    mindlin_simply_supported,
    thin_plate_simply_supported,
)
from structured import (
    buckling_factors,
    free_dofs,
    frequencies,
    local_axes,
    macneal_harder,
    random_rotation,
    rigid_residual,
    shell_model,
    submatrix,
    surface,
    zero_modes,
)

import modalprep as mp
from modalprep.fe.elements.shells.curved import CurvedShellBlock
from modalprep.linalg.factor import factorise
from modalprep.linalg.modes import lowest_modes

STEEL = mp.Material(E=2.0e11, nu=0.3, rho=8000.0)
each_kind = pytest.mark.parametrize("kind", ["triangle6", "quad8", "quad9"])


def on(values, target):
    return np.isclose(values, target, atol=1e-7 * max(np.ptp(values), 1e-300))


def bowl(s, t):
    return s, t, 0.3 * np.sin(2 * s) * np.cos(1.5 * t) + 0.1 * s * t


# --- rigid motions and mass ---------------------------------------------------------------------------------------


@each_kind
@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("offset", [0.0, 0.03])
def test_rigid_motions_and_mass(kind, seed, offset):
    points, cells = surface(3, 3, kind, bowl, distort=0.2, seed=seed)
    points = points @ random_rotation(seed).T + 1.0
    model = shell_model(points, cells, mp.Shell(material=STEEL, thickness=0.02, offset=offset), corner=5)
    assert np.abs(zero_modes(model, free_dofs(model))[:6]).max() < 1e-9
    assert rigid_residual(model, free_dofs(model)) < 1e-14
    assert np.linalg.eigvalsh(model.M.toarray())[0] > -1e-15 * abs(model.M).max()
    assert [check.name for check in mp.body.check_model(model) if not check.passed] == []


@each_kind
def test_mass_of_a_sphere_converges_with_order_four(kind):
    """Closed form: the cap of 0.8 rad of a sphere has the area ``2 pi (1 - cos 0.8)`` and is 1/4 meshed here."""

    def cap(s, t):
        a, b = 0.8 * s, np.pi / 2 * t
        return np.sin(a) * np.cos(b), np.sin(a) * np.sin(b), np.cos(a)

    exact, errors = np.pi / 2 * (1 - np.cos(0.8)) - np.pi / 2 * (1 - np.cos(0.08)), []
    for n in (2, 4):
        points, cells = surface(n, n, kind, lambda s, t: cap(0.1 + 0.9 * s, t))
        model = shell_model(points, cells, mp.Shell(material=STEEL, thickness=0.01))
        errors.append(abs(model.rigid.m / (exact * 0.01 * STEEL.rho) - 1))
    assert errors[1] < 1e-4
    assert np.log2(errors[0] / errors[1]) > 3.5


# --- patch tests --------------------------------------------------------------------------------------------------


def patch(kind, thickness):
    """MacNeal and Harder's patch of five quads or ten triangles in any plane; nodes inside, and axes of its own."""
    points, cells = macneal_harder(kind)
    R = random_rotation(4)
    model = shell_model(points @ R.T + 1.0, cells, mp.Shell(material=mp.Material(E=1e6, nu=0.25, rho=1.0),
                                                            thickness=thickness))  # fmt: skip
    x, y = points[:, :2].T
    outer = on(x, 0.0) | on(x, 0.24) | on(y, 0.0) | on(y, 0.12)
    return points, model, local_axes(model, R), outer


def solve_patch(model, Q, outer, exact):
    """Hold the outer nodes at `exact (n, 6)`; return the largest error inside, relative, and the energy."""
    d = np.zeros(model.n_dof)
    d[model.dof] = exact
    K, inner, held = (Q.T @ model.K @ Q).toarray(), model.dof[~outer].ravel(), model.dof[outer].ravel()
    found = np.linalg.solve(K[np.ix_(inner, inner)], -K[np.ix_(inner, held)] @ d[held])
    scale = np.repeat([np.abs(exact[:, :3]).max(), np.abs(exact[:, 3:]).max()], 3)
    error = np.abs((found - d[inner]).reshape(-1, 6) / scale).max()
    d[inner] = found
    return error, d @ K @ d / 2


@each_kind
def test_membrane_patch(kind):
    points, model, Q, outer = patch(kind, 1e-3)
    G = 1e-3 * np.array([[1.0, 0.8], [-0.3, 0.6]])
    exact = np.zeros((len(points), 6))
    exact[:, :2], exact[:, 5] = points[:, :2] @ G.T, (G[1, 0] - G[0, 1]) / 2
    error, energy = solve_patch(model, Q, outer, exact)
    ex, ey, gxy = G[0, 0], G[1, 1], G[0, 1] + G[1, 0]
    density = 1e6 / (1 - 0.25**2) * (ex**2 + ey**2 + 2 * 0.25 * ex * ey) + 1e6 / 2.5 * gxy**2
    assert error < 1e-8  # conditioning of bending against membrane
    assert energy == pytest.approx(density / 2 * 1e-3 * 0.24 * 0.12, rel=1e-9)


@each_kind
@pytest.mark.parametrize("t", [1e-3, 5e-2])
def test_bending_patch(kind, t):
    points, model, Q, outer = patch(kind, t)
    x, y = points[:, :2].T
    kx, ky, kxy = 1e-3 * np.array([1.0, -0.4, 0.7])
    exact = np.zeros((len(points), 6))
    exact[:, 2] = (kx * x**2 + ky * y**2 + 2 * kxy * x * y) / 2
    exact[:, 3], exact[:, 4] = ky * y + kxy * x, -(kx * x + kxy * y)
    error, energy = solve_patch(model, Q, outer, exact)
    D = 1e6 * t**3 / (12 * (1 - 0.25**2))
    assert error < 1e-9
    assert energy == pytest.approx(
        D / 2 * ((kx + ky) ** 2 - 2 * (1 - 0.25) * (kx * ky - kxy**2)) * 0.24 * 0.12, rel=1e-9
    )


# --- plates -------------------------------------------------------------------------------------------------------


def plate(kind, n, t=1e-3, **options):
    points, cells = surface(n, n, kind, **{"diagonal": "alternating", **options})
    return points, shell_model(points, cells, mp.Shell(material=STEEL, thickness=t))


def supported_plate(kind, n, code, t=1e-3, **options):
    """Unit square with hard simple supports (S) or clamped (C) on all sides, and its free DOFs."""
    points, model = plate(kind, n, t, **options)
    x_sides, y_sides = (on(c, 0.0) | on(c, 1.0) for c in points[:, :2].T)
    held = [model.dof[x_sides, 2], model.dof[y_sides, 2], model.dof[x_sides, 3], model.dof[y_sides, 4]]
    held += [model.dof[x_sides, 4], model.dof[y_sides, 3]] if code == "C" else []
    return model, free_dofs(model, *held, components=(2, 3, 4))


def plate_frequencies(kind, n, code, count, t=1e-3, **options):
    """rad/s of `supported_plate`."""
    return frequencies(*supported_plate(kind, n, code, t, **options), count)


def unit_frequency(t):
    return np.sqrt(STEEL.E * t**2 / (12 * (1 - STEEL.nu**2) * STEEL.rho))


@each_kind
@pytest.mark.parametrize("code", ["S", "C"])
def test_thin_plates_converge_with_order_four(kind, code):
    """Sources: Navier; Leissa's clamped plate (five digits). Quadratic curvatures: the energy's error falls as h^4."""
    exact = {"S": thin_plate_simply_supported([(1, 1), (1, 2)], D=1.0, rho_h=1.0, a=1.0, b=1.0), "C": PLATE_CLAMPED[:2]}
    errors = [np.abs(plate_frequencies(kind, n, code, 2) / unit_frequency(1e-3) / exact[code] - 1) for n in (8, 16)]
    assert np.all(errors[0] < {"S": (4e-4, 2e-3), "C": (3e-3, 6e-3)}[code])
    assert np.all(np.log2(errors[0] / errors[1]) > 3.6)  # triangles 3.7 to 4.1, quads 3.8 to 4.5


@each_kind
def test_distorted_plate(kind):
    """Navier; inner corners moved by a fifth of a cell: three times the error of the regular mesh."""
    exact = thin_plate_simply_supported([(1, 1)], D=1.0, rho_h=1.0, a=1.0, b=1.0)
    assert plate_frequencies(kind, 8, "S", 1, distort=0.2)[0] / unit_frequency(1e-3) == pytest.approx(
        exact[0], rel=2e-3
    )


def test_what_a_mode_leaves_of_its_equation_is_round_off():
    """Identity: ``K phi = w^2 M phi`` to some 10 eps of |K| |phi|; the factor of such a thin plate is worth 1100."""
    model, keep = supported_plate("quad8", 8, "S", distort=0.2)
    K, M = (submatrix(A, keep) for A in (model.K, model.M))
    w2, phi, _ = lowest_modes(K, M, 1, factor=factorise(K, "superlu"))
    scale = 1 / np.sqrt(K.diagonal())[:, None]
    left, size = scale * (K @ phi - w2 * (M @ phi)), scale * (abs(K) @ abs(phi))
    assert np.linalg.norm(left) < 20 * np.finfo(float).eps * np.linalg.norm(size)


@each_kind
def test_no_locking_down_to_a_hundred_thousandth(kind):
    thin, thinnest = (plate_frequencies(kind, 4, "C", 3, t) / unit_frequency(t) for t in (1e-3, 1e-5))
    np.testing.assert_allclose(thinnest, thin, rtol=1e-4)  # shear deformation at t/a = 1e-3: (t/a)^2 times 30


@each_kind
def test_thick_plate_against_mindlin(kind):
    exact = mindlin_simply_supported([(1, 1), (1, 2), (2, 2)], E=STEEL.E, nu=STEEL.nu, rho=STEEL.rho, h=0.1, a=1.0)
    found = plate_frequencies(kind, 8, "S", 4, 0.1)[[0, 1, 3]]
    assert np.all(np.abs(found / exact - 1) < (5e-4, 2e-3, 4e-3))  # measured 2e-4, 1e-3, 2.7e-3


@each_kind
def test_plate_buckling(kind):
    """Closed form (Bryan 1891): a simply supported square buckles at ``k = 4`` under a uniform edge load."""
    t = 1e-3
    reference = np.pi**2 * STEEL.E * t**3 / (12 * (1 - STEEL.nu**2))
    errors = []
    for n in (4, 8):
        points, model = plate(kind, n, t)
        strain, d = reference / (STEEL.E * t), np.zeros(model.n_dof)
        d[model.dof[:, 0]], d[model.dof[:, 1]] = -strain * points[:, 0], STEEL.nu * strain * points[:, 1]
        x_sides, y_sides = (on(c, 0.0) | on(c, 1.0) for c in points[:, :2].T)
        held = [model.dof[x_sides | y_sides, 2], model.dof[x_sides, 3], model.dof[y_sides, 4]]
        keep = free_dofs(model, *held, components=(2, 3, 4))
        errors.append(abs(buckling_factors(model, keep, d, model.K @ d)[0] / 4 - 1))
    assert errors[1] < 2e-3
    assert np.log2(errors[0] / errors[1]) > 3


# --- stress, refusals, files --------------------------------------------------------------------------------------


def one(kind, points, **section):
    section = mp.Shell(**({"material": STEEL, "thickness": 0.01} | section))
    return CurvedShellBlock.build(kind, points, np.arange(len(points))[None], section, {}, np.zeros(3))


FLAT = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0.5, 0, 0], [0.5, 0.5, 0], [0, 0.5, 0]])
TRAPEZOID = np.array([[0.0, 0, 0], [1, 0.1, 0], [1, 0.9, 0], [0, 1, 0], [0.5, 0.05, 0], [1, 0.5, 0], [0.5, 0.95, 0],
                      [0, 0.5, 0], [0.5, 0.5, 0]])  # fmt: skip


@each_kind
def test_stress_of_stretching_and_bending(kind):
    R, flat = random_rotation(3), FLAT if kind == "triangle6" else TRAPEZOID[: int(kind[-1])]
    block = one(kind, flat @ R.T)
    strain, curvature = 1e-4, 2e-3
    d = np.zeros((len(flat), 6))
    d[:, 0], d[:, 2], d[:, 4] = strain * flat[:, 0], -curvature / 2 * flat[:, 0] ** 2, curvature * flat[:, 0]
    d = np.concatenate([d[:, :3] @ R.T, d[:, 3:] @ R.T], axis=1).reshape(1, -1, 1)
    found = block.nodal_stress(d)
    modulus = STEEL.E / (1 - STEEL.nu**2)
    for face, z in (("top", 0.005), ("bottom", -0.005)):
        exact = modulus * (strain + z * curvature) * np.array([1, STEEL.nu, 0])
        np.testing.assert_allclose(
            found[face][1][0, :, :, 0], np.tile(exact, (len(flat), 1)), atol=1e-9 * modulus * strain
        )


@pytest.mark.parametrize(
    "move", [(3, (-0.26, 0, 0)), (4, (-0.5, -0.5, 0)), (2, (0, -1, 0)), (3, (0, 0, 0.9))],
    ids=["quarter point", "folded", "no area", "too steep"],
)  # fmt: skip
def test_refusals(move):
    points = FLAT.copy()
    points[move[0]] += move[1]
    with pytest.raises(mp.InputError, match="curved shell elements have no area, are folded or span more than"):
        one("triangle6", points)


def test_material_axis_normal_to_the_shell():
    with pytest.raises(mp.InputError, match="is normal to 1 shell elements"):
        one("triangle6", FLAT, axis=(0.0, 0.0, 1.0))


def _card(name, k, nodes):
    fields = [name, k, 7, *nodes]
    return "".join(",".join(map(str, line)) + "\n" for line in (fields[:9], ["", *fields[9:]]) if len(line) > 1)


DECK = "SOL 103\nBEGIN BULK\n{}{}PSHELL,7,1,.01,1,,1\nMAT1,1,2.+11,,.3,8000.\nENDDATA\n"


@pytest.mark.parametrize(
    ("kind", "abaqus", "nastran"),
    [("triangle6", ("S6", "STRI65"), "CTRIA6"), ("quad8", ("S8", "S8R"), "CQUAD8"), ("quad9", ("S9R5",), None)],
)
def test_read_from_files(tmp_path, kind, abaqus, nastran):
    """Abaqus, Nastran and .vtu files number the nodes as we do: the same first frequencies."""
    import meshio

    points, cells = surface(2, 2, kind, bowl)
    held = np.flatnonzero(on(points[:, 0], 0.0))

    def first(mesh, section):
        group = next(name for name, kinds in mesh.groups.items() if kind in kinds)
        model = mp.assemble(mesh, {group: section} if section else {}, {"root": mp.Interface(near=tuple(points[0]))})
        return frequencies(model, free_dofs(model, model.dof[held]), 3)

    shell = mp.Shell(material=STEEL, thickness=0.01)
    mesh = mp.fe.Mesh(points=points, cells={kind: cells}, groups={"all": {kind: np.arange(len(cells))}})
    exact = first(mesh, shell)
    nodes = "".join(f"{k}, {x!r}, {y!r}, {z!r}\n" for k, (x, y, z) in enumerate(points.tolist(), 1))
    rows = "".join(", ".join(map(str, [k, *(c + 1)])) + "\n" for k, c in enumerate(cells, 1))
    for name in abaqus:
        (tmp_path / "s.inp").write_text(f"*NODE\n{nodes}*ELEMENT, TYPE={name}, ELSET=all\n{rows}")
        assert first(mp.read_mesh(tmp_path / "s.inp"), shell) == pytest.approx(exact, rel=1e-9)
    meshio.Mesh(points, {kind: cells}, cell_data={"part": [np.ones(len(cells), dtype=int)]}).write(tmp_path / "s.vtu")
    assert first(mp.read_mesh(tmp_path / "s.vtu"), shell) == pytest.approx(exact, rel=1e-9)
    if not nastran:
        return
    grids = "".join(f"GRID*,{k},,{x:.9f},{y:.9f},+\n*,{z:.9f}\n" for k, (x, y, z) in enumerate(points.tolist(), 1))
    cards = "".join(_card(nastran, k, c + 1) for k, c in enumerate(cells, 1))
    (tmp_path / "s.bdf").write_text(DECK.format(grids, cards))
    assert first(mp.read_mesh(tmp_path / "s.bdf"), None) == pytest.approx(exact, rel=1e-6)  # nine decimals
