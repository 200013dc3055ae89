"""Lumped mass and Nastran's: point masses as a second implementation, closed forms, and other programs' frequencies."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.spatial.transform import Rotation
from shared_data import DATA

import modalprep as mp
from modalprep.errors import InputError
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.properties.points import PointMass
from modalprep.fe.properties.properties import Beam, Shell, Solid, Truss
from modalprep.linalg.modes import lowest_modes
from modalprep.pipeline.building.model import assemble_pipeline, read_pipeline_mesh
from modalprep.pipeline.schema.load import load
from modalprep.reduction.clamped import clamp

needs_data = pytest.mark.skipif(not (DATA / "isat").is_dir(), reason="the folder of foreign decks is not there")
STEEL = mp.Material(E=210e9, nu=0.3, rho=7800.0)
LIGHT = replace(STEEL, rho=1e-12 * STEEL.rho)
TURN = Rotation.from_rotvec([0.4, -0.7, 1.1]).as_matrix()  # no axis of the mesh along one of the model
ROOT = {"root": mp.Interface(node=1, kind="node")}
TRIANGLE = {"root": mp.Interface(group="all")}
SECTION = Beam(material=STEEL, A=6e-4, Iy=4.5e-7, Iz=2e-7, J=4.7e-7, nsm=1.3, up=tuple(TURN[2]), offset=(0.02, 0.05))


def lines(n=3):
    points = np.linspace([0.3, 0.1, -0.2], [1.5, 0.1, -0.2], n + 1) @ TURN.T
    row = np.arange(n)
    return Mesh(points=points, cells={"line": np.stack([row, row + 1], 1)}, groups={"all": {"line": row}})


def triangle():
    """Three bars, because a line of them holds no frame."""
    points = np.array([[0.3, 0.1, -0.2], [1.5, 0.1, -0.2], [0.7, 1.0, -0.2]]) @ TURN.T
    return Mesh(
        points=points, cells={"line": np.array([[0, 1], [1, 2], [2, 0]])}, groups={"all": {"line": np.arange(3)}}
    )


def sheet():
    x, y = np.meshgrid([0.0, 0.4, 1.1], [0.0, 0.5, 0.8])
    points = np.stack([x.ravel(), y.ravel(), 0.1 + 0 * x.ravel()], 1) @ TURN.T
    quads = np.array([[i, i + 1, i + 4, i + 3] for i in (0, 1, 3, 4)])
    return Mesh(points=points, cells={"quad": quads}, groups={"all": {"quad": np.arange(4)}})


def with_points(mesh, light, masses):
    """The same elements almost without mass, and a point mass with offset and inertia for each node of each element."""
    cells, groups, properties = dict(mesh.cells), dict(mesh.groups), {"all": light}
    cells["vertex"] = np.array([[node] for node, _ in masses])
    for k, (_, mass) in enumerate(masses):
        groups[f"m{k}"], properties[f"m{k}"] = {"vertex": np.array([k])}, mass
    return mp.assemble(mesh.with_(cells=cells, groups=groups), properties, ROOT)


def assert_equal_inertia(found, expected):
    """Every object that motion takes from the mass; the elements almost without mass leave 1e-12 of it."""
    rng = np.random.default_rng(1)
    Phi = rng.normal(size=(found.n_dof, 4))
    pairs = [
        (found.M.toarray(), expected.M.toarray()),
        (found.g, expected.g),
        (found.h, expected.h),
        (found.M_ab.project(Phi), expected.M_ab.project(Phi)),
        (found.rigid.s0, expected.rigid.s0),
        (found.rigid.E0, expected.rigid.E0),
        (found.rotating_mass.project(Phi), expected.rotating_mass.project(Phi)),
        (found.rotating_mass.project_modes(Phi, slice(None)), expected.rotating_mass.project_modes(Phi, slice(None))),
    ]
    for a, b in pairs:
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-10 * np.abs(b).max() + 1e-300)
    assert found.rigid.m == pytest.approx(expected.rigid.m)


@pytest.mark.parametrize("bar", [True, False])
@pytest.mark.parametrize("how", ["lumped", "nastran"])
def test_lumped_beam_is_point_masses_on_its_axis(bar, how):
    """CBEAM alone, and only as Nastran has it, has rho (I1 + I2) L / 2 about its axis at each end."""
    mesh = lines()
    e1, offset = TURN[:, 0], None
    e2 = np.cross(SECTION.up, e1)
    e2 /= np.linalg.norm(e2)
    offset = SECTION.offset[0] * e2 + SECTION.offset[1] * np.cross(e1, e2)
    half = 0.4 / 2
    J = (how == "nastran" and not bar) * STEEL.rho * (SECTION.Iy + SECTION.Iz) * half * np.outer(e1, e1)
    inertia = tuple(J[i] for i in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))
    mass = PointMass(mass=(STEEL.rho * SECTION.A + SECTION.nsm) * half, offset=tuple(offset), inertia=inertia)
    ends = [(node, mass) for cell in mesh.cells["line"] for node in cell]
    expected = with_points(mesh, replace(SECTION, material=LIGHT, nsm=0.0), ends)
    assert_equal_inertia(mp.assemble(mesh, {"all": replace(SECTION, bar=bar)}, ROOT, mass=how), expected)


def test_lumped_shell_is_point_masses_over_its_nodes():
    """A rectangle has a quarter of its mass at each corner, here 0.03 m above the node."""
    mesh = sheet()
    section = Shell(material=STEEL, thickness=0.01, offset=0.03)
    normal = TURN[:, 2]
    masses = []
    for cell in mesh.cells["quad"]:
        a, b = mesh.points[cell[1]] - mesh.points[cell[0]], mesh.points[cell[3]] - mesh.points[cell[0]]
        quarter = STEEL.rho * 0.01 * np.linalg.norm(a) * np.linalg.norm(b) / 4
        masses += [(node, PointMass(mass=quarter, offset=tuple(0.03 * normal))) for node in cell]
    expected = with_points(mesh, replace(section, material=LIGHT), masses)
    assert_equal_inertia(mp.assemble(mesh, {"all": section}, ROOT, mass="lumped"), expected)


def test_lumped_mass_of_bricks_is_an_eighth_at_each_corner():
    x = np.array([[i, j, k] for k in (0, 1) for j in (0, 1) for i in (0, 1)]) * [0.3, 0.2, 0.5]
    hexahedron = Mesh(points=x, cells={"hexahedron": np.array([[0, 1, 3, 2, 4, 5, 7, 6]])},
                      groups={"all": {"hexahedron": np.array([0])}})  # fmt: skip
    model = mp.assemble(hexahedron, {"all": Solid(material=STEEL)}, {"root": mp.Interface(group="all")}, mass="lumped")
    np.testing.assert_allclose(model.M.toarray()[:24, :24], STEEL.rho * 0.03 / 8 * np.eye(24), atol=1e-12)


def test_lumped_mass_of_second_order_cells_is_positive():
    """Row sums of a ten-node tetrahedron are -1/20 at its corners; the scaled diagonal has 1/36 there (HRZ)."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    middles = [(corners[a] + corners[b]) / 2 for a, b in ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))]
    mesh = Mesh(points=np.array([*corners, *middles]), cells={"tetra10": np.arange(10)[None]},
                groups={"all": {"tetra10": np.array([0])}})  # fmt: skip
    model = mp.assemble(mesh, {"all": Solid(material=STEEL)}, {"root": mp.Interface(group="all")}, mass="lumped")
    share = model.M.diagonal()[:30:3] / (STEEL.rho / 6)
    # int N^2 of the corners 1/420, of the middles 8/630 of the volume times six: 6/420 and 32/420
    np.testing.assert_allclose(share, np.r_[np.full(4, 6), np.full(6, 32)] / 216, rtol=1e-12)


@pytest.mark.parametrize("bar", [True, False])
@pytest.mark.parametrize("how", ["lumped", "nastran"])
@pytest.mark.parametrize("coupled", [True, False])
@pytest.mark.parametrize("section", [SECTION, Truss(material=STEEL, A=1e-4, J=1e-8), Truss(material=STEEL, A=1e-4)])
def test_rigid_motion_has_the_inertia_of_the_mass(section, coupled, how, bar):
    """Theory 1.5 of beams with arms and of bars, in a model that is turned and off its origin."""
    section, interface = (replace(section, bar=bar), ROOT) if isinstance(section, Beam) else (section, TRIANGLE)
    mesh = (lines() if isinstance(section, Beam) else triangle()).with_(coupled_mass=coupled)
    model = mp.assemble(mesh, {"all": section}, interface, mass=how)
    assert [check.name for check in mp.body.check_model(model) if not check.passed] == []


def bar_terms(L, bar):
    """Nastran's coupled mass of a bar along x (MSC Nastran Dynamics guide): axial, transverse, about the axis."""
    rho_AL = (STEEL.rho * SECTION.A + SECTION.nsm) * L
    bend = [[156, 22 * L, 54, -13 * L], [22 * L, 4 * L**2, 13 * L, -3 * L**2],
            [54, 13 * L, 156, -22 * L], [-13 * L, -3 * L**2, -22 * L, 4 * L**2]]  # fmt: skip
    turn = 0.0 if bar else STEEL.rho * (SECTION.Iy + SECTION.Iz) * L / 6
    return rho_AL / 12 * np.array([[5, 1], [1, 5]]), rho_AL / 420 * np.array(bend), turn * np.array([[2, 1], [1, 2]])


@pytest.mark.parametrize("bar", [True, False])
def test_coupled_mass_of_nastran_is_the_printed_one(bar):
    mesh = Mesh(points=np.array([[0, 0, 0], [0.7, 0, 0]]), cells={"line": np.array([[0, 1]])},
                groups={"all": {"line": np.array([0])}}, coupled_mass=True)  # fmt: skip
    section = replace(SECTION, offset=(0, 0), up=(0, 0, 1), theory="euler-bernoulli", bar=bar)
    M = mp.assemble(mesh, {"all": section}, ROOT, mass="nastran").M.toarray()
    axial, bend, turn = bar_terms(0.7, bar)
    expected, flip = np.zeros((12, 12)), np.diag([1, -1, 1, -1])
    for dofs, value in (([0, 6], axial), ([3, 9], turn), ([1, 5, 7, 11], bend), ([2, 4, 8, 10], flip @ bend @ flip)):
        expected[np.ix_(dofs, dofs)] = value
    np.testing.assert_allclose(M, expected, atol=1e-14 * expected.max())


def test_coupled_rod_of_nastran_is_lumped_across():
    mesh = Mesh(points=np.array([[0, 0, 0], [0, 0.7, 0]]), cells={"line": np.array([[0, 1]])},
                groups={"all": {"line": np.array([0])}}, coupled_mass=True)  # fmt: skip
    model = mp.assemble(mesh, {"all": Truss(material=STEEL, A=1e-4, J=1e-9)}, ROOT, mass="nastran")
    M = model.M.toarray().reshape(2, 6, 2, 6)[:, :3, :, :3] / (STEEL.rho * 1e-4 * 0.7)
    for a, expected in ((0, np.eye(2) / 2), (1, np.array([[5, 1], [1, 5]]) / 12), (2, np.eye(2) / 2)):
        np.testing.assert_allclose(M[:, a, :, a], expected, atol=1e-14)
    assert not np.any(model.M.toarray()[np.ix_([3, 4, 5], [3, 4, 5])])


def test_the_body_of_a_lumped_model_has_its_integrals():
    """S, H, P and the modal mass of a reduced body agree with the point masses at the nodes (theory 3.2)."""
    mesh = lines(8)
    section = replace(SECTION, offset=(0, 0))
    model = mp.assemble(mesh, {"all": section}, ROOT, mass="lumped")
    body = mp.flexible_body(model, mp.craig_bampton(model, modes=5, truncation=()), name="beam")
    assert [check.name for check in mp.check_body(body) if not check.passed] == []
    np.testing.assert_allclose(np.trace(body.P, axis1=0, axis2=1), np.eye(body.n), atol=1e-9)


def test_improved_reduction_of_lumped_masses():
    """The tip turns about the line without mass: one mode less, and the bending of the whole mesh to 1e-2."""
    ends = ROOT | {"tip": mp.Interface(node=9, kind="node")}
    section = replace(SECTION, offset=(0, 0))
    model, held = (mp.assemble(lines(8), {"all": section}, e, mass="lumped") for e in (ends, ROOT))
    body = mp.flexible_body(model, mp.reduction.improved_guyan(model), name="beam")
    np.testing.assert_allclose(body.frequency[:2], frequencies(held, 2), rtol=1e-2)


def test_a_free_line_without_inertia_about_itself_is_refused():
    """On the axis, and beside the origin of the model in a turned mesh: the inertia is singular both ways."""
    for offset in ((0.0, 0.0), SECTION.offset):
        model = mp.assemble(lines(4), {"all": replace(SECTION, offset=offset)}, ROOT, mass="lumped")
        with pytest.raises(InputError, match="the free body has no inertia about a line, such as a straight beam"):
            mp.reduction.free_interface(model, modes=2)


def test_an_unknown_distribution_is_refused():
    for wrong in ("consistent", 3):
        with pytest.raises(InputError, match=f"assemble: mass '{wrong}'"):
            mp.assemble(lines(), {"all": SECTION}, ROOT, mass=wrong)


def test_a_pipeline_file_distributes_the_mass(tmp_path):
    deck = "GRID,1\nGRID,2,,2.\nCBAR,9,5,1,2,0.,1.,0.\nPBAR,5,7,.01,3.-6,2.-6,4.-6\nMAT1,7,2.+11,,.3,8000.\nENDDATA\n"
    (tmp_path / "bar.bdf").write_text(deck)
    for how, share in (("coupled", 1 / 3), ("lumped", 1 / 2), ("nastran", 1 / 2)):
        text = f'[mesh]\nfile = "bar.bdf"\nmass = "{how}"\n[interfaces.root]\nnode = 1\n'
        (tmp_path / "job.toml").write_text(text)
        source = load(tmp_path / "job.toml")
        model = assemble_pipeline(source.pipeline, read_pipeline_mesh(source))
        assert model.M.diagonal()[6] == pytest.approx(share * 160)


# ------------------------------------------------------------------ other programs


def frequencies(model, n, held=slice(None)):
    clamped = clamp(model)
    keep = np.flatnonzero(np.isin(model.free[clamped.i], model.dof[:, held]))
    K, M = (A[keep][:, keep].tocsr() for A in (clamped.K_ii, clamped.M_ii))
    return np.sqrt(lowest_modes(K, M, n).w2) / (2 * np.pi)


@needs_data
def test_rod_of_bars_and_a_beam_has_the_frequencies_of_nastran():
    """NX Nastran, models/beam_modes of pyNastran; shear factor 0.9 of the rod, torsion by the CBEAM's inertia alone."""
    mesh = mp.read_mesh(DATA / "nastran_modes" / "beam_modes.dat", "in", "slinch")
    model = mp.assemble(mesh, {}, ROOT, mass="nastran")
    nastran = [456.6603, 456.6603, 2674.5875, 2674.5875, 3554.923, 4507.487, 6626.104]
    np.testing.assert_allclose(frequencies(model, 7), nastran, rtol=1e-6)


@needs_data
def test_cantilever_in_a_plane_has_the_frequencies_of_nastran():
    """MSC Nastran, testing/superelements of NASTRAN_CoFE: GRDSET leaves T2 and R3 of the grids."""
    mesh = mp.read_mesh(DATA / "superelements" / "noReduction.dat", "in", "slinch")
    model = mp.assemble(mesh, {}, ROOT, mass="nastran")
    nastran = [349.7288, 2167.324, 6007.803, 11650.23]
    np.testing.assert_allclose(frequencies(model, 4, [1, 5]), nastran, rtol=1e-7)  # of seven digits


@needs_data
def test_static_reduction_of_the_cantilever_is_that_of_nastran():
    """Guyan's reduction to T2 and R3 of grid 6 (ASET), MSC Nastran 359.0738 and 2934.100 Hz."""
    mesh = mp.read_mesh(DATA / "superelements" / "guyanReduction.dat", "in", "slinch")
    model = mp.assemble(mesh, {}, ROOT, mass="nastran")
    plane = model.dof[1:, [1, 5]]
    kept, others = plane[mesh.labels[1:] == 6].ravel(), plane[mesh.labels[1:] != 6].ravel()
    K, M = model.K.toarray(), model.M.toarray()
    T = np.zeros((model.n_dof, 2))
    T[kept] = np.eye(2)
    T[others] = -np.linalg.solve(K[np.ix_(others, others)], K[np.ix_(others, kept)])
    w2 = eigh(T.T @ K @ T, T.T @ M @ T, eigvals_only=True)
    np.testing.assert_allclose(np.sqrt(w2) / (2 * np.pi), [359.0738, 2934.100], rtol=2e-7)  # of seven digits


@needs_data
def test_frame_with_coupled_masses_has_the_frequencies_of_nastran():
    """NX Nastran, tests/nas2cam_extseout of pyYeti: 117 bars, free-free, 54 elastic modes."""
    mesh = mp.read_mesh(DATA / "nastran_cb" / "full.dat", "m", "kg")  # in the deck's own numbers: mm, kg, s
    model = mp.assemble(mesh, {}, {"root": mp.Interface(node=3, kind="node")}, mass="nastran")
    K, M = ((model.C.T @ A @ model.C).tocsr() for A in (model.K, model.M))
    found = np.sqrt(np.abs(lowest_modes(K, M, 60, shift=-100.0).w2)) / (2 * np.pi)
    lines = (DATA / "nastran_cb" / "full.frequencies.txt").read_text().splitlines()
    nastran = np.array([float(line.split()[1]) for line in lines if line.strip()])
    np.testing.assert_allclose(found[6:], nastran[6:], rtol=1e-6)  # seen 5e-7, the last of seven digits
