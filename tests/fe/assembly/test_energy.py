"""Strain energy of the cells: its sum is the modal stiffness, its place is where the model strains."""

import numpy as np
import pytest
from structured import box, random_surface, shell_model, solid_model

import modalprep as mp
from modalprep.examples import beam_mesh, cantilever_model, spinup_section
from modalprep.fe.assembly import strain_energy as module
from modalprep.fe.families import FAMILIES

STEEL = mp.Material(E=2e11, nu=0.3, rho=7800.0)
BOX = tuple(FAMILIES[mp.Solid])


def of_kind(kind):
    if kind == "line":
        return cantilever_model(7, "fixed")
    if kind in ("triangle", "quad"):
        return shell_model(*random_surface(kind), mp.Shell(material=STEEL, thickness=0.02))
    points, cells = box(kind, (3, 2, 2), (1.0, 0.5, 0.4), distort=0.2)
    return solid_model(points, cells, kind, mp.Solid(material=STEEL), np.flatnonzero(points[:, 0] == 0))


def mixed():
    """Beams and a truss of two groups each, a bushing, a grounded spring and a point mass, in one model."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0.2, 0], [2, 0.2, 1], [2.3, 0.2, 1], [1, 1, 0.5]])
    line = np.array([[3, 4], [0, 1], [1, 2], [2, 3], [0, 5], [5, 2], [5, 3]])
    rows = {"bushing": [0], "soft": [1, 3], "stiff": [2], "rods": [4, 5, 6]}
    vertex = {"root": [0], "tip": [3], "lump": [4], "foot": [2]}
    mesh = mp.fe.Mesh(
        points=points,
        cells={"line": line, "vertex": np.array([[0], [3], [4], [2]])},
        groups={name: {"line": np.array(k)} for name, k in rows.items()}
        | {name: {"vertex": np.array([k])} for k, name in enumerate(vertex)},
    )
    beam = dict(A=1e-4, Iy=2e-9, Iz=1e-9, J=3e-9, up=(1, 2, 3))
    properties = {
        "soft": mp.Beam(material=STEEL, **beam),
        "rods": mp.Truss(material=STEEL, A=1e-5),
        "stiff": mp.Beam(material=STEEL, **(beam | {"A": 5e-4, "Iy": 9e-9})),
        "bushing": mp.Spring(translation=(1e5, 2e5, 1e5), rotation=(50.0, 40.0, 60.0)),
        "lump": mp.PointMass(mass=0.4),
        "foot": mp.Spring(translation=(0, 0, 3e3), rotation=(0, 0, 0)),
    }
    return mp.assemble(mesh, properties, {name: mp.Interface(group=name, kind="node") for name in ("root", "tip")})


def total(energy):
    return sum(values.sum(axis=0, dtype=float) for values in energy.values())


@pytest.mark.parametrize("kind", ["line", "triangle", "quad", *BOX])
def test_sum_over_the_cells_is_half_the_modal_stiffness(kind):
    model = of_kind(kind)
    body = mp.flexible_body(model, mp.craig_bampton(model, modes=6, truncation=()), name=kind)
    assert {k: v.shape for k, v in body.energy.items()} == {k: (len(c), body.n) for k, c in model.cells.items()}
    # single precision of each cell; the round-off of K is 1e-16 of the stiffest element
    np.testing.assert_allclose(total(body.energy), (2 * np.pi * body.frequency) ** 2 / 2, rtol=1e-6)


def test_sum_over_springs_rods_beams_and_masses():
    model = mixed()
    body = mp.flexible_body(model, mp.craig_bampton(model, modes=8, truncation=()), name="mixed")
    np.testing.assert_allclose(total(body.energy), body.K / 2, rtol=1e-6)
    assert not body.energy["vertex"][np.ravel(body.cells["vertex"]) == 4].any()  # the point mass


def test_every_cell_has_its_own_energy():
    """Rods ``EA s^2 / (2 L)`` of the stretch s, springs ``k . s^2 / 2``: in the rows of the cells they belong to."""
    model, d = mixed(), np.random.default_rng(3).standard_normal((6, 6))
    Phi = np.zeros((model.n_dof, 1))
    Phi[model.dof[model.dof >= 0], 0] = d[model.dof >= 0]
    found, cells = model.strain_energy(Phi), model.cells
    rods = np.flatnonzero((cells["line"] == 5).any(axis=1))
    assert len(rods) == 3
    first, second = cells["line"][rods].T
    along = model.points[second] - model.points[first]
    length = np.linalg.norm(along, axis=1)
    stretch = np.sum(along * (d[second, :3] - d[first, :3]), axis=1) / length
    np.testing.assert_allclose(found["line"][rods, 0], 2e11 * 1e-5 * stretch**2 / (2 * length), rtol=1e-6)
    foot = np.flatnonzero(cells["vertex"][:, 0] == 2)
    np.testing.assert_allclose(found["vertex"][foot, 0], 3e3 * d[2, 2] ** 2 / 2, rtol=1e-6)


def test_bending_of_a_cantilever_under_a_tip_force():
    """``dU = F^2 (L - x)^2 / (2 EI) dx``, and shear adds ``F^2 / (2 k G A)`` per length."""
    section, n, L, F = spinup_section(theory="euler-bernoulli"), 5, 10.0, 3.0
    model = mp.assemble(beam_mesh(n), {"beam": section}, {"root": mp.Interface(group="root", kind="node")})
    load = np.zeros(model.n_dof)
    load[model.dof[-1, 1]] = F
    d = np.zeros((model.n_dof, 1))
    d[6:, 0] = np.linalg.solve(model.K.toarray()[6:, 6:], load[6:])
    x = np.linspace(0, L, n + 1)
    exact = F**2 / (2 * 1.4e4) * -np.diff((L - x) ** 3) / 3
    np.testing.assert_allclose(model.strain_energy(d)["line"][:, 0], exact, rtol=1e-6)


@pytest.mark.parametrize("kind", ["line", "triangle", "quad", *BOX])
def test_volume_is_mass_over_density(kind):
    model = of_kind(kind)
    rho = 3000.0 if kind == "line" else STEEL.rho
    volume = model.strain_energy.volume()[kind]
    assert np.all(volume > 0)
    assert volume.sum() == pytest.approx(model.rigid.m / rho, rel=1e-12)


def test_volume_of_a_laminate_counts_every_ply():
    points, cells = random_surface("quad")
    sheet, plies = mp.Shell(material=STEEL, thickness=0.03), tuple(
        mp.fe.Ply(material=STEEL, thickness=t) for t in (0.01, 0.02)
    )  # fmt: skip
    one, two = (shell_model(points, cells, s).strain_energy.volume() for s in (sheet, mp.Shell(plies=plies)))
    np.testing.assert_allclose(one["quad"], two["quad"], rtol=1e-12)


def test_points_and_springs_have_no_volume():
    volume = mixed().strain_energy.volume()
    assert not volume["vertex"].any()
    assert np.count_nonzero(volume["line"] == 0) == 1  # the bushing


def test_piece_by_piece_is_the_same(monkeypatch):
    model = of_kind("hexahedron")
    Phi = np.random.default_rng(0).standard_normal((model.n_dof, 3))
    whole = model.strain_energy(Phi)
    monkeypatch.setattr(module, "AT_ONCE", 200)  # two elements
    piece = model.strain_energy(Phi)
    np.testing.assert_allclose(piece["hexahedron"], whole["hexahedron"], rtol=1e-6)


def test_rigid_motion_has_no_energy():
    model = of_kind("quad")
    R = model.rigid_body()
    bent = np.random.default_rng(0).standard_normal(R.shape)
    assert total(model.strain_energy(R)).max() < 1e-12 * total(model.strain_energy(bent)).min()


def test_mechanism_has_no_energy():
    """A bar on a universal joint: the modes without stiffness keep no round-off of the stiff ones."""
    points = np.array([[0.0, 0, 0], [0.5, 0, 0], [1, 0, 0]])
    mesh = mp.fe.Mesh(
        points=points,
        cells={"line": np.array([[0, 1], [1, 2]]), "vertex": np.array([[0], [2]])},
        groups={"hinge": {"line": np.array([0])}, "arm": {"line": np.array([1])}}
        | {name: {"vertex": np.array([k])} for k, name in enumerate(("root", "tip"))},
    )
    hinge = mp.Spring(translation=(1e8, 1e8, 1e8), rotation=(1e6, 0, 0), location=0.0)
    arm = mp.Beam(material=STEEL, A=1e-4, Iy=1e-9, Iz=1e-9, J=2e-9)
    ends = {name: mp.Interface(group=name, kind="node") for name in ("root", "tip")}
    model = mp.assemble(mesh, {"hinge": hinge, "arm": arm}, ends)
    body = mp.flexible_body(model, mp.craig_bampton(model, modes=2, truncation=()), name="arm")
    assert np.count_nonzero(body.frequency == 0) == 2
    assert not any(values[:, body.frequency == 0].any() for values in body.energy.values())
    np.testing.assert_allclose(total(body.energy)[2:], body.K[2:] / 2, rtol=1e-6)


def test_energy_belongs_to_the_modes():
    """Damping and conventional theory keep it; other modes do not have it."""
    model = cantilever_model(4)
    body = mp.flexible_body(model, mp.craig_bampton(model, modes=3), name="beam")
    for same in (body.with_(D=0 * body.D), body.conventional()):
        assert np.array_equal(same.energy["line"], body.energy["line"])
    assert body.with_(K=2 * body.K).energy == {}
    assert body.with_(K=body.K, energy=body.energy).energy.keys() == {"line"}


@pytest.mark.parametrize("factor", [1.0, 1e38])
def test_energies_beyond_single_precision(factor):
    """They became infinite, and the modal file with them; those of E times 1e38 are 1e38 times as large."""
    model = cantilever_model(elements=2)
    pull = np.zeros((model.n_dof, 1))
    pull[model.dof[:, 0], 0] = np.sqrt(factor) * np.array([0.0, 1e-3, 2e-3])  # strain 2e-4 on EA = 2.8e7 N at factor 1
    np.testing.assert_allclose(model.strain_energy(pull)["line"].ravel(), 2.8 * factor, rtol=1e-6)  # of float32
