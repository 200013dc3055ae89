"""Trusses, eccentric beams, springs and point masses against closed forms."""

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse.linalg import spsolve
from scipy.spatial.transform import Rotation

import modalprep as mp
from modalprep.examples import beam_mesh, spinup_section
from modalprep.fe.mesh.mesh import Mesh

STEEL = mp.Material(E=2.1e11, nu=0.3, rho=7800.0)
ROOT = {"root": mp.Interface(group="root", kind="node")}


def solve(model, load, held):
    """Static answer (n_dof,) with the DOFs `held` at zero; loose DOFs stay zero."""
    K = model.C.T @ model.K @ model.C
    free = np.setdiff1d(np.arange(K.shape[0]), np.searchsorted(model.free, held))
    x = np.zeros(K.shape[0])
    x[free] = spsolve(K[free][:, free].tocsc(), (model.C.T @ load)[free])
    return model.C @ x


def turned(mesh, seed=0):
    R = Rotation.random(random_state=seed).as_matrix()
    return mesh.with_(points=mesh.points @ R.T + [0.3, -2.0, 1.0]), R


def two_bars(kind="line"):
    """Three nodes of a two-bar truss, 3 m wide and 2 m high, apex last."""
    points = np.array([[-1.5, 0, 0], [1.5, 0, 0], [0, 2.0, 0]])
    return Mesh(points=points, cells={"line": np.array([[0, 2], [1, 2]]), "vertex": np.array([[0], [1], [2]])},
                groups={"bars": {"line": np.array([0, 1])}, "feet": {"vertex": np.array([0, 1])},
                        "apex": {"vertex": np.array([2])}})  # fmt: skip


def test_two_bar_truss():
    """Apex load P: bar force P / (2 sin a), drop P L / (2 EA sin^2 a)."""
    mesh, R = turned(two_bars())
    model = mp.assemble(mesh, {"bars": mp.Truss(material=STEEL, A=1e-4)}, {"all": mp.Interface(plane=plane(mesh))})
    assert model.dof.max() + 1 == 9 + 6
    dofs = model.dof[:3, :3]
    K = model.K[dofs[2]][:, dofs[2]].toarray()
    length, sine = np.hypot(1.5, 2.0), 2.0 / np.hypot(1.5, 2.0)
    in_plane = R[:, :2]
    drop = np.linalg.solve(in_plane.T @ K @ in_plane, [0, -1.0])
    np.testing.assert_allclose(drop, [0, -length / (2 * 2.1e7 * sine**2)], rtol=1e-12, atol=1e-20)
    assert model.rigid.m == pytest.approx(2 * 7800 * 1e-4 * length, rel=1e-14)


def plane(mesh):
    """The plane of the three points."""
    a, b, c = mesh.points[:3]
    return tuple(a), tuple(np.cross(b - a, c - a))


def test_truss_prestress_is_that_of_a_string():
    """A taut string of bars: Kg gives ``f = (1/2L) sqrt(N / rho A)`` across, 20 bars to order h^2."""
    n, L, N = 20, 4.0, 1e4
    mesh = beam_mesh(n, L)
    bars = mp.Truss(material=STEEL, A=1e-4, J=1e-9)  # with J the end node can carry the frame
    model = mp.assemble(mesh, {"beam": bars}, ROOT)
    x = np.zeros(model.n_dof)
    x[model.dof[: n + 1, 0]] = N / (2.1e11 * 1e-4) * mesh.points[:, 0]
    Kg = model.geometric_stiffness(x, model.K @ x)
    inner = model.dof[1:n, 1]
    w2 = eigh(Kg[inner][:, inner].toarray(), model.M[inner][:, inner].toarray(), eigvals_only=True)
    # linear shapes against a sine: error (pi/n)^2 / 24 = 1.0e-3
    assert np.sqrt(w2[0]) / (np.pi / L * np.sqrt(N / 0.78)) - 1 == pytest.approx((np.pi / n) ** 2 / 24, rel=0.02)


def test_torque_of_a_bar():
    """``GJ / L`` and rotations only where J is given; ends along any direction."""
    mesh, R = turned(beam_mesh(4, 2.0), 1)
    bar = mp.Truss(material=STEEL, A=1e-4, J=3e-8)
    model = mp.assemble(mesh, {"beam": bar}, ROOT)
    axis = R[:, 0]
    load = np.zeros(model.n_dof)
    load[model.dof[4, 3:]] = 5.0 * axis
    K = model.K.toarray()
    twist = np.linalg.lstsq(K[6:, 6:], load[6:], rcond=1e-9)[0][-3:]
    np.testing.assert_allclose(twist, 5.0 * 2.0 / (STEEL.G * 3e-8) * axis, rtol=1e-9, atol=1e-15)
    assert all(check.passed for check in mp.body.check_model(model))


def test_eccentric_beam_is_a_beam_on_rigid_arms():
    """Axial force at the nodes bends a beam whose centroid lies e above them: curvature ``N e / EI``."""
    e, L, N = 0.2, 10.0, 1000.0
    section = spinup_section(offset=(0.0, e))
    mesh, R = turned(beam_mesh(6, L), 2)
    section = spinup_section(offset=(0.0, e), up=tuple(R[:, 2]))
    model = mp.assemble(mesh, {"beam": section}, ROOT)
    load = np.zeros(model.n_dof)
    load[model.dof[6, :3]] = N * R[:, 0]
    x = solve(model, load, model.interfaces[0].dofs)
    tip = R.T @ x[model.dof[6, :3]]
    turn = R.T @ x[model.dof[6, 3:]]
    EA, EI = 2.8e7, 7e10 * section.Iy
    # the force at the node, e below the centroid: moment N e about e2, tip turns N e L / EI
    assert abs(turn[1]) == pytest.approx(N * e * L / EI, rel=1e-9)
    assert tip[0] == pytest.approx(N * L / EA + e * N * e * L / EI, rel=1e-9)
    assert abs(tip[2]) == pytest.approx(N * e * L**2 / (2 * EI), rel=1e-9)
    assert all(check.passed for check in mp.body.check_model(model))


def test_offset_does_not_change_a_free_beam():
    """The spectrum of a free beam does not know where its nodes are."""
    spectra = []
    for offset in ((0.0, 0.0), (0.3, -0.2)):
        model = mp.assemble(beam_mesh(6), {"beam": spinup_section(offset=offset)}, ROOT)
        spectra.append(eigh(model.K.toarray(), model.M.toarray(), eigvals_only=True)[6:14])
    np.testing.assert_allclose(spectra[1], spectra[0], rtol=1e-8)


def test_eccentric_column_buckles_where_its_centroid_is():
    """Euler load of the centroid line, whatever the nodes' offset, with the load on that line: needs Kg of the arms."""
    e, L = 0.5, 10.0
    mesh = beam_mesh(16, L)
    model = mp.assemble(mesh, {"beam": spinup_section(offset=(e, 0.0), theory="euler-bernoulli")}, ROOT)
    load = np.zeros(model.n_dof)
    load[model.dof[16, 0]] = -1.0
    load[model.dof[16, 5]] = -e  # e2 = up x e1 = +y: moves the force to the centroid
    assert mp.reduction.buckling(model, load).value[0] == pytest.approx(np.pi**2 * 1.4e4 / (4 * L**2), rel=2e-3)


def test_per_element_orientation_overrides_the_section():
    mesh = beam_mesh(4)
    up = np.tile([0, 1.0, 0], (4, 1))
    given = mp.assemble(mesh.with_(data={"up": {"line": up}}), {"beam": spinup_section()}, ROOT)
    direct = mp.assemble(mesh, {"beam": spinup_section(up=(0, 1.0, 0))}, ROOT)
    other = mp.assemble(mesh, {"beam": spinup_section()}, ROOT)
    np.testing.assert_array_equal(given.K.toarray(), direct.K.toarray())
    assert abs(given.K - other.K).max() > 1e3


def spring_mesh(gap):
    """A beam of 4 elements and a line from its tip to a node `gap` further on, held by a grounded spring."""
    mesh = beam_mesh(4, 2.0)
    points = np.concatenate([mesh.points, [[2.0 + gap, 0, 0]]])
    cells = {"line": np.concatenate([mesh.cells["line"], [[4, 5]]]), "vertex": np.array([[0], [5]])}
    groups = {"beam": {"line": np.arange(4)}, "bush": {"line": np.array([4])}, "root": {"vertex": np.array([0])},
              "ground": {"vertex": np.array([1])}}  # fmt: skip
    return Mesh(points=points, cells=cells, groups=groups)


@pytest.mark.parametrize("gap", [0.0, 0.4])
def test_springs_in_series(gap):
    """Tip force through bushing and grounded spring: axial stiffness 1/(1/k1 + 1/k2) in parallel with EA/L."""
    k1, k2 = 3e6, 5e6
    model = mp.assemble(spring_mesh(gap), {
        "beam": spinup_section(), "bush": mp.Spring(translation=(k1, 1e5, 1e5), rotation=(1e3, 1e3, 1e3)),
        "ground": mp.Spring(translation=(k2, 1e5, 1e5), rotation=(1e3, 1e3, 1e3))}, ROOT)  # fmt: skip
    load = np.zeros(model.n_dof)
    load[model.dof[4, 0]] = 100.0
    x = solve(model, load, model.interfaces[0].dofs)
    stiffness = 2.8e7 / 2.0 + 1 / (1 / k1 + 1 / k2)
    assert x[model.dof[4, 0]] == pytest.approx(100.0 / stiffness, rel=1e-9)


@pytest.mark.parametrize("location", [0.0, 0.5, 1.0])
def test_long_bushing_turns_without_force(location):
    mesh, R = turned(spring_mesh(0.4), 3)
    up = tuple(R[:, 2])
    bush = mp.Spring(translation=(3e6, 1e5, 2e5), rotation=(1e3, 2e3, 3e3), up=up, location=location)
    model = mp.assemble(mesh, {"beam": spinup_section(up=up), "bush": bush}, ROOT)
    assert mp.body.check_model(model)[0].passed
    assert np.sum(eigh(model.K.toarray(), eigvals_only=True) < 1e-6) == 6


def test_pendulum_on_a_preloaded_bushing():
    """A bushing pulled by N between elastic centre and node at distance a: its arm adds N a to the rotation."""
    bush = mp.Spring(translation=(1e9, 1e9, 1e9), rotation=(1e6, 1e6, 1e6), location=0.0)
    model = mp.assemble(spring_mesh(0.4), {"beam": spinup_section(), "bush": bush}, ROOT)
    N, a = 50.0, 0.4
    x = np.zeros(model.n_dof)
    x[model.dof[5, 0]] = N / 1e9
    load = model.K @ x
    Kg = model.geometric_stiffness(x, load).toarray()
    swing = np.zeros((model.n_dof, 3))  # of the node around the elastic centre, the bushing unstrained
    swing[model.dof[5, 3:]] = np.eye(3)
    swing[model.dof[5, [2, 1]], [1, 2]] = -a, a
    np.testing.assert_allclose(swing.T @ Kg @ swing, np.diag([0, N * a, N * a]), atol=1e-9)


def test_point_mass_is_a_rigid_body():
    """Mass, offset and inertia tensor of the card, about the root."""
    mass = mp.PointMass(mass=4.0, inertia=(1.0, 2.0, 2.5, 0.2, -0.1, 0.3), offset=(0.5, 0.2, -0.3))
    mesh = beam_mesh(4, 2.0)
    bare = mp.assemble(mesh, {"beam": spinup_section()}, ROOT)
    full = mp.assemble(mesh, {"beam": spinup_section(), "tip": mass}, ROOT)
    r = np.array([2.0, 0, 0]) + mass.offset
    xx, yy, zz, xy, xz, yz = mass.inertia
    J = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) + 4.0 * (r @ r * np.eye(3) - np.outer(r, r))
    R = bare.rigid_body()
    added = R.T @ (full.M - bare.M) @ R
    np.testing.assert_allclose(added[3:, 3:], J, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(full.rigid.s0 - bare.rigid.s0, 4.0 * r, rtol=1e-12)
    assert all(check.passed for check in mp.body.check_model(full))


def test_mass_with_inertia_on_a_solid_is_reported(bracket_model):
    mesh = mp.read_mesh(__file__.rsplit("tests", 1)[0] + "meshes/bracket.msh", "mm")
    node = mesh.nodes("bolt_b")[:1]
    mesh = mesh.with_(cells={**mesh.cells, "vertex": node[:, None]},
                      groups={**mesh.groups, "sensor": {"vertex": np.array([0])}})  # fmt: skip
    body = mp.Solid(material=mp.Material(E=7e10, nu=0.33, rho=2700.0))
    sensor = mp.PointMass(mass=0.1, inertia=(1e-5,) * 3 + (0.0,) * 3, offset=(0, 0, 0.01))
    model = mp.assemble(mesh, {"body": body, "sensor": sensor}, {"bolt_a": mp.Interface(group="bolt_a")})
    assert any("'sensor' sits on a node without rotations" in note for note in model.notes)
    assert model.rigid.m == pytest.approx(bracket_model.rigid.m + 0.1, rel=1e-12)
    assert all(check.passed for check in mp.body.check_model(model))
