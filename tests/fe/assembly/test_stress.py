"""Stress at points: states of constant strain and curvature exactly, slender bodies against beam theory."""

import numpy as np
import pytest
from structured import box, free_dofs, macneal_harder, random_rotation, shell_model, solid_model, static, surface

import modalprep as mp
from modalprep.examples import beam_mesh
from modalprep.fe.elements.shells.laminate import plane_stress
from modalprep.fe.families import FAMILIES

STEEL = mp.Material(E=2e11, nu=0.3, rho=7800.0)
BOX = tuple(FAMILIES[mp.Solid])
ROUND_OFF = 1e-9  # of strains, differences of displacements: 1e-16 over the smallest cell's share of the size
FORCE, MOMENT = np.array([3e3, -40.0, 70.0]), np.array([25.0, 0, 0])


def mesh_of(points, cells, kind, *more):
    """The mesh that `structured` assembles, with the groups that tests name."""
    rows = {name: {kind: np.array(k)} for name, k in more}
    return mp.fe.Mesh(points=points, cells={kind: cells}, groups={"all": {kind: np.arange(len(cells))}, **rows})


def everywhere(model, mesh, **options):
    return mp.fe.stress_recovery(model, mesh, {"p": mp.fe.StressPoint(group="all", **options)})


# --- solids -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", BOX)
def test_solids_have_the_stress_of_a_constant_strain(kind):
    """``sigma = lambda tr(e) 1 + 2 mu e`` at every node of a distorted mesh, with any rotation."""
    points, cells = box(kind, (2, 2, 2), (1.0, 0.5, 0.4), distort=0.2)
    model = solid_model(points, cells, kind, mp.Solid(material=STEEL))
    slope = np.random.default_rng(0).standard_normal((3, 3))
    d = np.zeros((model.n_dof, 1))
    d[model.dof[: len(points), :3], 0] = points @ slope.T
    found = everywhere(model, mesh_of(points, cells, kind))(d)
    assert len(found) == len(points)
    strain, mu = (slope + slope.T) / 2, STEEL.E / 2.6
    exact = STEEL.E * 0.3 / (1.3 * 0.4) * np.trace(strain) * np.eye(3) + 2 * mu * strain
    for number, at in found.items():
        assert at.components == ("xx", "yy", "zz", "xy", "yz", "xz")
        assert np.array_equal(at.position, model.points[int(number.split(".")[1]) - 1])
        got = at.modes[:, 0]
        np.testing.assert_allclose(got, exact[[0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]], rtol=0, atol=ROUND_OFF * 1e11)


@pytest.mark.parametrize("kind", ["hexahedron", "hexahedron20", "hexahedron27", "tetra10"])
def test_solids_in_pure_bending(kind):
    """``u = k x z``, ``v = -k nu y z``, ``w = -k (x^2 + nu (z^2 - y^2)) / 2``: ``sigma_xx = E k z`` alone, in bricks.

    Linear hexahedra need their incompatible modes for it.
    """
    points, cells = box(kind, (3, 2, 1), (1.0, 0.2, 0.1))
    model, k, nu = solid_model(points, cells, kind, mp.Solid(material=STEEL)), 1e-3, 0.3
    x, y, z = points.T
    d = np.zeros((model.n_dof, 1))
    u = np.stack([k * x * z, -k * nu * y * z, -k * (x**2 + nu * (z**2 - y**2)) / 2], axis=1)
    d[model.dof[: len(points), :3], 0] = u
    for name, at in everywhere(model, mesh_of(points, cells, kind))(d).items():
        place = points[int(name.split(".")[1]) - 1]
        np.testing.assert_allclose(at.modes[:, 0], [2e11 * k * place[2], 0, 0, 0, 0, 0], atol=1.0)  # of 2e7 Pa


@pytest.mark.parametrize(("kind", "tolerance"), [("hexahedron", 1e-9), ("hexahedron20", 1e-5), ("tetra10", 5e-3)])
def test_solid_cantilever_bends_like_a_beam(kind, tolerance):
    """``sigma_xx = M z / I`` half-way between clamp and tip force; with twice the elements 2/3 of the error."""
    errors = [abs(solid_cantilever(kind, n, 0.5) - 1) for n in (6, 12)]
    assert errors[1] < tolerance
    assert errors[1] < max(2 / 3 * errors[0], 1e-9)


def test_solid_cantilever_at_its_clamp():
    """Linear hexahedra have the moment of their middle, ``-l / (2 L)``; second order is within 2 % of M z / I.

    The true stress differs from that by as much, for the clamp does not let the section warp.
    """
    for n in (6, 12):
        assert solid_cantilever("hexahedron", n, 0.0) == pytest.approx(1 - 1 / (2 * n), rel=1e-9)
    for kind in ("hexahedron20", "tetra10"):
        assert solid_cantilever(kind, 12, 0.0) == pytest.approx(1, rel=2e-2)


def solid_cantilever(kind, n, place):
    """Stress at the top over M z / I, at a place (m) of a bar of 1 m with n elements along it."""
    length, b, h, force = 1.0, 0.1, 0.1, 500.0
    points, cells = box(kind, (n, 1, 2), (length, b, h))
    at = (abs(points[:, 0]) < 1e-9, points[:, 0] > length - 1e-9, np.all(abs(points - (place, 0, h)) < 1e-9, axis=1))
    clamp, tip, top = map(np.flatnonzero, at)
    model = solid_model(points, cells, kind, mp.Solid(material=mp.Material(E=2e11, nu=0.0, rho=1.0)), clamp)
    mesh = mesh_of(points, cells, kind)
    groups = mesh.groups | {"tip": {"vertex": np.arange(len(tip))}}
    tip_mesh = mesh.with_(cells=mesh.cells | {"vertex": tip[:, None]}, groups=groups)
    load = mp.reduction.nodal_load(model, tip_mesh, "tip", mp.reduction.Load(group="tip", force=(0, 0, force)))
    d = static(model, free_dofs(model, model.dof[clamp]), load)[:, None]
    found = mp.fe.stress_recovery(model, mesh, {"p": mp.fe.StressPoint(node=int(top[0]) + 1)})(d)["p"]
    return found.modes[0, 0] / (-force * (length - place) * (h / 2) / (b * h**3 / 12))


# --- shells -----------------------------------------------------------------------------------------------------------


def plane_state(kind, section, membrane, curvature, seed=1):
    """Stress at all nodes of a patch in an arbitrary plane, components along its own x, and the rotation of the plane.

    ``u = (membrane) x``, ``w = -x^T curvature x / 2``: the rotations ``ty = -w,x``, ``tx = w,y`` have these curvatures.
    """
    flat, cells = macneal_harder(kind)
    R = random_rotation(seed)
    model = shell_model(flat @ R.T, cells, section)
    local = np.zeros((len(flat), 6))
    local[:, :2] = flat[:, :2] @ membrane.T
    bend = flat[:, :2] @ curvature
    local[:, 2] = -np.sum(flat[:, :2] * bend, axis=1) / 2
    local[:, 3], local[:, 4] = -bend[:, 1], bend[:, 0]
    local[:, 5] = (membrane[1, 0] - membrane[0, 1]) / 2
    d = np.zeros((model.n_dof, 1))
    d[model.dof[: len(flat)], 0] = np.concatenate([local[:, :3] @ R.T, local[:, 3:] @ R.T], axis=1)
    mesh = mesh_of(flat @ R.T, cells, kind)
    return everywhere(model, mesh, axis=tuple(R[:, 0]))(d), R


@pytest.mark.parametrize("kind", ["triangle", "quad", "triangle6", "quad8", "quad9"])
def test_sheet_has_the_stress_of_constant_strains_and_curvatures(kind):
    """``Q (e + z k)`` in both faces at all nodes of the MacNeal-Harder patch: membrane and bending, also the twist."""
    membrane, curvature = np.array([[1e-3, 4e-4], [-2e-4, 5e-4]]), np.array([[0.3, 0.1], [0.1, -0.2]])
    found, R = plane_state(kind, mp.Shell(material=STEEL, thickness=0.002), membrane, curvature)
    assert len(found) == 2 * len(macneal_harder(kind)[0])
    vector = [np.array([e[0, 0], e[1, 1], e[0, 1] + e[1, 0]]) for e in (membrane, curvature)]
    for name, at in found.items():
        z = 0.001 if name.endswith(".top") else -0.001
        exact = plane_stress(STEEL) @ (vector[0] + z * vector[1])
        assert at.components == ("xx", "yy", "xy")
        np.testing.assert_allclose(at.axes, R.T, atol=1e-12)
        np.testing.assert_allclose(at.modes[:, 0], exact, rtol=0, atol=1e-8 * np.abs(exact).max())


def test_outer_plies_carry_their_own_stress():
    """Of a laminate the faces are plies: ``sigma_11 = E1 e11 / (1 - nu12 nu21) + ...`` along the turned fibres."""
    carbon = mp.fe.Orthotropic(E1=140e9, E2=9e9, nu12=0.3, G12=5e9, G13=5e9, G23=3e9, rho=1600.0)
    plies = [
        mp.fe.Ply(material=carbon, thickness=t, angle=np.radians(a)) for t, a in ((1e-3, 30), (2e-3, 90), (5e-4, -45))
    ]
    # axis 1 of the laminate is the patch's x in every element
    section = mp.Shell(plies=tuple(plies), axis=tuple(random_rotation(1)[:, 0]))
    membrane, curvature = np.array([[1e-3, 2e-4], [2e-4, -4e-4]]), np.array([[0.5, -0.1], [-0.1, 0.2]])
    found, _ = plane_state("quad", section, membrane, curvature)
    for name, at in found.items():
        face, angle = (1, np.radians(-45)) if name.endswith(".top") else (-1, np.radians(30))
        strain = membrane + face * 1.75e-3 * curvature
        c, s = np.cos(angle), np.sin(angle)
        fibre = np.array([[c, s], [-s, c]])
        e = fibre @ strain @ fibre.T
        nu21 = 0.3 * 9 / 140
        k = 1 / (1 - 0.3 * nu21)
        own = np.diag([k * (140e9 * e[0, 0] + nu21 * 140e9 * e[1, 1]), k * 9e9 * (0.3 * e[0, 0] + e[1, 1])])
        own[0, 1] = own[1, 0] = 5e9 * 2 * e[0, 1]
        exact = fibre.T @ own @ fibre
        got = at.modes[:, 0]
        np.testing.assert_allclose(got, exact[[0, 1, 0], [0, 1, 1]], rtol=0, atol=1e-8 * np.abs(exact).max())


@pytest.mark.parametrize(("kind", "at_root", "within"), [("quad", 1e-6, 1e-6), ("triangle", 2e-2, 1e-4)])
def test_plate_strip_bends_like_a_beam(kind, at_root, within):
    """``6 M / (b t^2)`` at the clamp and half-way to the tip force, compressed where the strip bends to; nu = 0."""
    length, b, t, force = 1.0, 0.2, 0.01, 5.0
    points, cells = surface(8, 4, kind, lambda s, r: (length * s, b * (r - 0.5), 0 * s))
    model = shell_model(points, cells, mp.Shell(material=mp.Material(E=2e11, nu=0.0, rho=1.0), thickness=t))
    clamp, tip = (np.flatnonzero(abs(points[:, 0] - x) < 1e-9) for x in (0, length))
    load = np.zeros(model.n_dof)
    load[model.dof[tip, 2]] = force / 4 * np.array([0.5, 1, 1, 1, 0.5])
    d = static(model, free_dofs(model, model.dof[clamp]), load)[:, None]
    for place, tolerance in ((0.0, at_root), (0.5, within)):
        middle = {"p": mp.fe.StressPoint(near=(place, 0, 0))}
        found = mp.fe.stress_recovery(model, mesh_of(points, cells, kind), middle)(d)
        exact = 6 * force * (length - place) / (b * t**2)
        assert found["p.top"].modes[0, 0] == pytest.approx(-exact, rel=tolerance)
        assert found["p.bottom"].modes[0, 0] == pytest.approx(exact, rel=tolerance)
        assert abs(found["p.top"].modes[1:, 0]).max() < tolerance * exact


@pytest.mark.parametrize("kind", ["quad", "triangle"])
def test_pipe_under_pressure_has_hoop_stress(kind):
    """``p r / t`` around, none along, in axes that turn with the wall: x along the pipe, y around, z outwards.

    Triangles of constant strain: the nodal moments of OPT do not balance across folds, which bends the ends of a pipe.
    """
    n, r, t, p = 48, 0.5, 0.01, 2e5
    points, cells = surface(n, 3, kind, lambda s, h: (r * np.cos(2 * np.pi * s), r * np.sin(2 * np.pi * s), 0.3 * h))
    ring = np.arange(len(points))
    ring[4 * n :] = np.arange(4)  # close the pipe
    points, cells = points[: 4 * n], ring[cells]
    model = shell_model(points, cells, mp.Shell(material=STEEL, thickness=t, membrane="cst"))
    mesh = mesh_of(points, cells, kind)
    load = mp.reduction.nodal_load(model, mesh, "p", mp.reduction.Load(group="all", pressure=p))
    low, quarter = np.flatnonzero(abs(points[:, 2]) < 1e-9), np.arange(0, 4 * n, n)  # the latter at 0, 90, ... degrees
    held = (model.dof[low, 2], model.dof[quarter[::2], 1], model.dof[quarter[1], 0])  # no more than rigid motion
    d = static(model, free_dofs(model, *held), load)
    found = everywhere(model, mesh, axis=(0, 0, 1))(d[:, None])
    assert len(found) == 2 * 4 * n
    for name, at in found.items():
        out = at.position + model.origin
        np.testing.assert_allclose(at.axes[2], [*out[:2] / r, 0], atol=np.pi / n / 2)  # of facets
        np.testing.assert_allclose(at.modes[:, 0] / (p * r / t), [0, 1, 0], atol=3e-3, err_msg=name)  # (pi / n)^2 / 2


def test_quads_bend_in_their_plane():
    """``u = k x y``, ``v = -k (x^2 + nu y^2) / 2``: ``sigma_xx = E k y`` alone, by incompatible modes."""
    points, cells = surface(3, 1, "quad", lambda s, t: (2 * s, t - 0.5, 0 * s))
    model, k = shell_model(points, cells, mp.Shell(material=STEEL, thickness=0.01)), 1e-3
    x, y, _ = points.T
    d = np.zeros((model.n_dof, 1))
    for component, values in ((0, k * x * y), (1, -k * (x**2 + 0.3 * y**2) / 2), (5, -k * x)):
        d[model.dof[: len(points), component], 0] = values
    for name, at in everywhere(model, mesh_of(points, cells, "quad"))(d).items():
        place = points[int(name.split(".")[1]) - 1]
        np.testing.assert_allclose(at.modes[:, 0], [2e11 * k * place[1], 0, 0], atol=1.0)


def test_point_has_the_mean_of_its_elements():
    """Two bars in a row, the second stretched three times as much: 1, 2 and 3 at their nodes."""
    mesh, rod = beam_mesh(2, 2.0), mp.fe.beam_section("rod", STEEL, diameter=0.1)
    model = mp.assemble(mesh, {"beam": rod}, {"root": mp.Interface(group="root", kind="node")})
    d = np.zeros((model.n_dof, 1))
    d[model.dof[:3, 0], 0] = 0, 1e-3, 4e-3
    found = everywhere(model, mesh.with_(groups={"all": mesh.groups["beam"]}), fibres=((0, 0),))(d)
    assert [found[f"p.{node}"].modes[0, 0] for node in (1, 2, 3)] == pytest.approx([2e8, 4e8, 6e8], rel=1e-9)


def test_triangles_and_quads_that_meet_share_a_point():
    """Constant strain in a quad and two triangles: the mean over both kinds is exact as well."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0], [2.2, 1, 0]])
    cells = {"quad": np.array([[0, 1, 2, 3]]), "triangle": np.array([[1, 4, 2], [4, 5, 2]])}
    groups = {"sheet": {"quad": np.array([0]), "triangle": np.array([0, 1])}, "corner": {"vertex": np.array([0])}}
    mesh = mp.fe.Mesh(points=points, cells=cells | {"vertex": np.array([[0]])}, groups=groups)
    sheet = {"sheet": mp.Shell(material=STEEL, thickness=0.01)}
    model = mp.assemble(mesh, sheet, {"root": mp.Interface(group="corner", kind="node")})
    d = np.zeros((model.n_dof, 1))
    d[model.dof[:6, 0], 0] = 1e-3 * points[:, 0]
    at = mp.fe.stress_recovery(model, mesh, {"p": mp.fe.StressPoint(node=3)})(d)["p.top"]
    np.testing.assert_allclose(at.modes[:, 0], 1e-3 * 2e11 / 0.91 * np.array([1, 0.3, 0]), atol=1.0)


# --- beams and trusses ------------------------------------------------------------------------------------------------


def bent_beam(section, n=3, **options):
    """Stress at every node of a cantilever under FORCE and MOMENT at its tip, both in its own axes (turned)."""
    mesh, R = beam_mesh(n, 2.0), random_rotation(2)
    mesh = mesh.with_(points=mesh.points @ R.T)
    section = section.__class__(**vars(section) | {"up": tuple(R[:, 2])})
    model = mp.assemble(mesh, {"beam": section}, {"root": mp.Interface(group="root", kind="node")})
    load = np.zeros(model.n_dof)
    load[model.dof[n]] = np.concatenate([R @ FORCE, R @ MOMENT])
    d = static(model, free_dofs(model, model.dof[0]), load)[:, None]
    return mp.fe.stress_recovery(model, mesh, {"p": mp.fe.StressPoint(group="beam", **options)})(d), R


@pytest.mark.parametrize("offset", [(0.0, 0.0), (0.02, -0.03)])
def test_beam_fibres_have_the_stress_of_the_section_forces(offset):
    """``N / A + z My / Iy - y Mz / Iz`` and the torque's shear at every node: the beam is exact in statics.

    An offset moves the centroid off the nodes, where the force acts.
    """
    A, Iy, Iz, J = 4e-4, 8e-8, 2e-8, 5e-8
    section = mp.Beam(material=STEEL, A=A, Iy=Iy, Iz=Iz, J=J, offset=offset)
    fibres = ((0.01, 0.02, 7e4), (-0.01, 0.005))
    found, R = bent_beam(section, fibres=fibres)
    N, Fy, Fz = FORCE
    torque = MOMENT[0] + offset[1] * Fy - offset[0] * Fz  # about the centroid: the force acts at -offset from it
    assert len(found) == 4 * 2
    for node in range(4):
        arm = 2.0 * (1 - node / 3)
        My, Mz = -arm * Fz - offset[1] * N, arm * Fy + offset[0] * N
        for number, (y, z, *shear) in enumerate(fibres, start=1):
            at = found[f"p.{node + 1}.{number}"]
            np.testing.assert_allclose(at.axes, R.T, atol=1e-12)
            exact = [N / A + z * My / Iy - y * Mz / Iz, *(w * torque for w in shear)]
            assert at.components == ("xx", "torsion")[: len(exact)]
            np.testing.assert_allclose(at.modes[:, 0], exact, rtol=1e-7, atol=1.0)  # of 1e8 Pa


def test_standard_sections_know_their_fibres():
    """A rectangle has corners and middles of its sides, and no number where a fibre has one place only."""
    found, _ = bent_beam(mp.fe.beam_section("rectangle", STEEL, width=0.02, height=0.03), n=1)
    assert sorted(found) == sorted(f"p.{node}.{k}" for node in (1, 2) for k in range(1, 9))
    b, h = 0.02, 0.03
    corner, side = found["p.1.1"].modes[:, 0], found["p.1.5"].modes[:, 0]
    N, Fy, Fz = FORCE
    My, Mz = -2 * Fz, 2 * Fy
    assert corner[0] == pytest.approx(N / (b * h) + 6 * My / (b * h**2) - 6 * Mz / (h * b**2), rel=1e-9)
    assert corner[1] == 0
    assert side[0] == pytest.approx(N / (b * h) - 6 * Mz / (h * b**2), rel=1e-9)
    one, _ = bent_beam(mp.fe.beam_section("rod", STEEL, diameter=0.02), n=1, fibres=((0, 0.01),))
    assert set(one) == {"p.1", "p.2"}


def test_shear_of_torsion_is_that_of_tables():
    """Rectangle: Timoshenko and Goodier, table 9, ``T / (k2 long short^2)`` in the middle of the long side; in that of
    the short side less by the usual tables' 1, 0.859, 0.795, 0.745, 0.743. Rod ``16 T / (pi d^3)``; box Bredt."""
    for ratio, k2, less in (
        (1, 0.208, 1.0),
        (1.5, 0.231, 0.859),
        (2, 0.246, 0.795),
        (4, 0.282, 0.745),
        (10, 0.312, 0.743),
    ):
        beam = mp.fe.beam_section("rectangle", STEEL, width=0.02, height=0.02 * ratio)
        (_, _, long_side), (_, _, short_side) = beam.fibres[4:6]
        assert long_side == pytest.approx(1 / (k2 * 0.02**3 * ratio), rel=3e-3)  # three digits
        assert short_side == pytest.approx(less * long_side, rel=1.5e-3)
        lying = mp.fe.beam_section("rectangle", STEEL, width=0.02 * ratio, height=0.02)
        assert lying.fibres[5][2] == pytest.approx(long_side, rel=1e-12)
    assert mp.fe.beam_section("rod", STEEL, diameter=0.1).fibres[0] == pytest.approx((0.05, 0, 16 / (np.pi * 0.1**3)))
    tube = mp.fe.beam_section("tube", STEEL, diameter=0.1, thickness=1e-5)
    assert tube.fibres[1][2] == pytest.approx(1 / (2 * np.pi * 0.05**2 * 1e-5), rel=1e-3)
    box_ = mp.fe.beam_section("box", STEEL, width=0.06, height=0.1, thickness=0.001)
    assert box_.fibres[0] == pytest.approx((0.03, 0.05, 1 / (2 * 0.059 * 0.099 * 0.001)))


def test_truss_carries_its_force_over_its_area():
    points = np.array([[0.0, 0, 0], [1, 1, 1], [3, 0, 0], [0, 3, 0]])
    cells = np.array([[0, 1], [2, 1], [3, 1], [0, 2], [2, 3], [3, 0]])
    mesh = mesh_of(points, cells, "line", ("first", [0]))
    mesh = mesh.with_(cells=mesh.cells | {"vertex": np.arange(4)[:, None]},
                      groups=mesh.groups | {"nodes": {"vertex": np.arange(4)}})  # fmt: skip
    model = mp.assemble(mesh, {"all": mp.Truss(material=STEEL, A=1e-4)}, {"root": mp.Interface(group="nodes")})
    load = np.zeros(model.n_dof)
    load[model.dof[1, :3]] = 1e3 * np.array([1.0, 1, 1])  # along the first bar, which alone can carry its z
    d = static(model, model.dof[1, :3], load)[:, None]
    at = mp.fe.stress_recovery(model, mesh, {"p": mp.fe.StressPoint(node=2, element_group="first")})(d)["p"]
    slope = np.array([points[1] - points[k] for k in (0, 2, 3)])
    forces = np.linalg.solve((slope / np.linalg.norm(slope, axis=1)[:, None]).T, 1e3 * np.ones(3))
    assert at.components == ("xx",)
    assert at.modes[0, 0] == pytest.approx(forces[0] / 1e-4, rel=1e-9)
    for k, start in enumerate((0, 2, 3)):
        way = mp.fe.StressPoint(node=2, direction=tuple(points[1] - points[start]))
        at = mp.fe.stress_recovery(model, mesh, {"p": way})(d)["p"]
        assert at.modes[0, 0] == pytest.approx(forces[k] / 1e-4, rel=1e-9, abs=1e-3)
    with pytest.raises(mp.InputError, match="meet at p point in different directions"):
        mp.fe.stress_recovery(model, mesh, {"p": mp.fe.StressPoint(node=2)})


@pytest.mark.parametrize("I12", [0.0, 4e4])
@pytest.mark.parametrize("card", ["PBAR", "PBEAM"])
def test_nastran_decks_bring_their_fibres(tmp_path, card, I12):
    """Points C to F of PBAR and PBEAM, y towards the orientation vector, under a tip force across: unsymmetric bending.

    ``sigma = -(y, z) [[I1, I12], [I12, I2]]^-1 (Fy, Fz) (L - x)``; blank points are none.
    """
    places = np.array([[15.0, 0.0], [-12.0, 8.0], [3.0, -9.0]])  # mm
    points = ",".join(str(v) for v in places.ravel())
    text = {
        "PBAR": f"PBAR,5,7,600.,1.2+5,6.+4,9.+4\n,{points}\n,1.,1.,{I12}\n",
        "PBEAM": f"PBEAM,5,7,600.,1.2+5,6.+4,{I12},9.+4\n,{points}\n,YES,1.\n,,,,,,,,\n,1.,1.\n",
    }[card]
    deck = f"GRID,1,,0.,0.,0.\nGRID,2,,2000.,0.,0.\nMAT1,7,2.+5,,.3,8.-9\nC{card[1:]},9,5,1,2,0.,1.,0.\n{text}ENDDATA\n"
    (tmp_path / "deck.bdf").write_text(deck)
    mesh = mp.read_mesh(tmp_path / "deck.bdf", "mm", "t")
    model = mp.assemble(mesh, {}, {"root": mp.Interface(node=1, kind="node")})
    load = np.zeros(model.n_dof)
    force = np.array([20.0, -35.0])  # N along y, z
    load[model.dof[1, 1:3]] = force
    d = static(model, free_dofs(model, model.dof[0]), load)[:, None]
    found = mp.fe.stress_recovery(model, mesh, {"p": mp.fe.StressPoint(node=1)})(d)
    second = 1e-12 * np.array([[1.2e5, I12], [I12, 6e4]])
    exact = -1e-3 * places @ np.linalg.solve(second, 2.0 * force)
    assert list(found) == ["p.1", "p.2", "p.3"]
    np.testing.assert_allclose([at.modes[0, 0] for at in found.values()], exact, rtol=1e-7)


# --- what cannot be asked ---------------------------------------------------------------------------------------------


def stiffened():
    """A sheet folded along its middle, with a beam along the fold."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 0, 1], [1, 0, 1]])
    quads = np.array([[0, 1, 3, 2], [1, 0, 4, 5]])
    mesh = mp.fe.Mesh(
        points=points,
        cells={"quad": quads, "line": np.array([[0, 1]]), "vertex": np.array([[0], [1]])},
        groups={"sheet": {"quad": np.array([0, 1])}, "floor": {"quad": np.array([0])},
                "stiffener": {"line": np.array([0])}, "root": {"vertex": np.array([0])},
                "lump": {"vertex": np.array([1])}},
    )  # fmt: skip
    beam = mp.Beam(material=STEEL, A=1e-4, Iy=1e-8, Iz=1e-8, J=1e-8)
    parts = {"sheet": mp.Shell(material=STEEL, thickness=0.01), "stiffener": beam, "lump": mp.PointMass(mass=1.0)}
    return mp.assemble(mesh, parts, {"root": mp.Interface(group="root", kind="node")}), mesh


@pytest.mark.parametrize(
    ("point", "words"),
    [
        (dict(node=1), r"different properties \(beam, shell\) meet at p; say whose stress by 'of'"),
        (
            dict(node=1, element_group="sheet"),
            r"different directions, \[0.0, 0.0, 1.0\], \[0.0, 1.0, 0.0\], so .* by 'direction'",
        ),
        (
            dict(node=1, element_group="sheet", direction=(1, 0, 0)),
            r"no element of group 'sheet' in direction \[1, 0, 0\] that",
        ),
        (dict(node=1, direction=(0, 0, 0)), "no element in direction"),
        (dict(node=1, element_group="stiffener"), "does not say where its outer fibres are"),
        (dict(node=1, element_group="lump"), "no element of group 'lump' that has stress"),
        (dict(node=99), "no node lies at node 99"),
        (dict(group="rot"), "no group 'rot'; did you mean 'root'"),
        (dict(node=3, element_group="none"), "has no group 'none'"),
        (dict(node=3, fibres=((0, 0),)), "'fibres' is not for elements of type shell"),
        (dict(node=1, element_group="stiffener", axis=(1, 0, 0)), "'axis' is not for elements of type beam"),
        (dict(node=1, element_group="stiffener", fibres=((0, 0, 0, 0),)), "is not y, z and, where known"),
        (dict(node=1, element_group="stiffener", fibres=((0, np.nan),)), "is not y, z and, where known"),
        (dict(node=3, axis=(0, 0, 1)), "is zero or normal to the shell"),
        (dict(node=3, axis=(0, 0, 0)), "is zero or normal to the shell"),
    ],
)
def test_what_has_no_stress_is_refused(point, words):
    with pytest.raises(mp.InputError, match=f"^stress point 'p': .*{words}"):
        mp.fe.stress_recovery(*stiffened(), {"p": mp.fe.StressPoint(**point)})


def test_names_of_files_and_channels_are_refused():
    for name in ("", "a/b", "a.b"):
        with pytest.raises(mp.InputError, match="cannot be the name of channels"):
            mp.fe.stress_recovery(*stiffened(), {name: mp.fe.StressPoint(node=3)})


def test_too_many_points_are_refused():
    mesh = beam_mesh(1001)
    section = mp.fe.beam_section("rod", STEEL, diameter=0.1)
    model = mp.assemble(mesh, {"beam": section}, {"root": mp.Interface(group="root", kind="node")})
    with pytest.raises(mp.InputError, match="group 'beam' has 1002 nodes; a body keeps the stress of 1000 at most"):
        mp.fe.stress_recovery(model, mesh, {"p": mp.fe.StressPoint(group="beam")})


def test_matrices_have_no_stress():
    model, mesh = stiffened()
    bare = mp.fe.model_from_matrices(model.K, model.M, model.points, interfaces={"root": mp.Interface(node=1)})
    with pytest.raises(mp.InputError, match="a model from matrices knows no elements"):
        mp.fe.stress_recovery(bare, mesh, {"p": mp.fe.StressPoint(node=1)})


@pytest.mark.parametrize("choice", [dict(element_group="floor"), dict(direction=(0.3, 0, 1.0))])
def test_one_side_of_a_fold_can_be_chosen(choice):
    """The floor alone, stretched along x; the wall is at rest but for their common side."""
    model, mesh = stiffened()
    d = np.zeros((model.n_dof, 1))
    d[model.dof[:4, 1], 0] = 1e-3 * model.points[:4, 1]
    at = mp.fe.stress_recovery(model, mesh, {"p": mp.fe.StressPoint(node=1, **choice)})(d)
    np.testing.assert_allclose(at["p.top"].modes[:, 0], 1e-3 * 2e11 / 0.91 * np.array([0.3, 1, 0]), atol=1.0)
