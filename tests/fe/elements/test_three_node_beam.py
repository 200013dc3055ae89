"""Three-node beams (B32, second-order lines of gmsh): two-node beams, closed forms, frames and refusals."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import modalprep as mp
from modalprep.fe.mesh.mesh import Mesh
from modalprep.linalg.modes import lowest_modes
from modalprep.reduction.clamped import clamp

STEEL = mp.Material(E=210e9, nu=0.3, rho=7800.0)
SECTION = mp.fe.beam_section("rectangle", STEEL, width=0.02, height=0.03, offset=(0.004, -0.002))
TURN = Rotation.from_rotvec([0.4, -0.7, 1.1]).as_matrix()
ROOT = {"root": mp.Interface(node=1, kind="node")}


def arc(n, angle, radius=1.0):
    """n elements of three nodes on an arc in a plane, and the same nodes in lines of two."""
    t = np.linspace(0, angle, 2 * n + 1)
    points = radius * np.stack([np.sin(t), 1 - np.cos(t), 0 * t], axis=1)
    k = 2 * np.arange(n)
    three = Mesh(
        points=points, cells={"line3": np.stack([k, k + 2, k + 1], 1)}, groups={"beam": {"line3": np.arange(n)}}
    )
    two = Mesh(points=points, cells={"line": np.stack([np.arange(2 * n), np.arange(1, 2 * n + 1)], 1)},
               groups={"beam": {"line": np.arange(2 * n)}})  # fmt: skip
    return three, two


def turned(mesh):
    return mesh.with_(points=mesh.points @ TURN.T + [0.3, 0.2, -0.1])


def test_everything_is_that_of_two_beams_each():
    """Stiffness, mass objects and arms of a bent, turned, eccentric line."""
    three, two = (mp.assemble(turned(mesh), {"beam": SECTION}, ROOT) for mesh in arc(3, 1.2))
    rng = np.random.default_rng(2)
    Phi = rng.normal(size=(three.n_dof, 3))
    assert np.array_equal(three.dof, two.dof)
    pairs = [(three.K, two.K), (three.M, two.M)]
    for a, b in pairs:
        assert abs(a - b).max() < 1e-12 * abs(b).max()
    for a, b in ((three.g, two.g), (three.h, two.h), (three.M_ab.project(Phi), two.M_ab.project(Phi)),
                 (three.rotating_mass.project(Phi), two.rotating_mass.project(Phi))):  # fmt: skip
        np.testing.assert_allclose(a, b, atol=1e-10 * np.abs(b).max())


@pytest.mark.parametrize("how", ["coupled", "lumped", "nastran"])
def test_rigid_motions_have_the_mass_of_the_line(how):
    model = mp.assemble(turned(arc(3, 1.2)[0]), {"beam": SECTION}, ROOT, mass=how)
    assert [check.name for check in mp.body.check_model(model) if not check.passed] == []


def test_four_frequencies_of_a_cantilever_from_two_elements():
    """Euler and Bernoulli: (lambda / L)^2 sqrt(E I / rho A) with lambda = 1.875104, 4.694091 of a slender line."""
    slender = mp.fe.beam_section("rectangle", STEEL, width=0.002, height=0.003)
    points = np.stack([np.linspace(0, 1, 9), np.zeros(9), np.zeros(9)], axis=1)
    k = 2 * np.arange(4)
    mesh = Mesh(
        points=points, cells={"line3": np.stack([k, k + 2, k + 1], 1)}, groups={"beam": {"line3": np.arange(4)}}
    )
    clamped = clamp(mp.assemble(mesh, {"beam": slender}, ROOT))
    found = np.sqrt(lowest_modes(clamped.K_ii, clamped.M_ii, 4).w2)
    speed = np.sqrt(210e9 / 7800.0 / 12)
    expected = sorted(v**2 * speed * h for v in (1.875104, 4.694091) for h in (0.002, 0.003))
    np.testing.assert_allclose(found, expected, rtol=2e-4)  # rotary inertia and shear of a thickness of 1/300


def test_a_ring_sector_converges_with_the_square_of_the_element():
    """Tip deflection of a quarter ring under a radial force: pi F R^3 / 4 E I (Castigliano, thin)."""
    thin = mp.fe.beam_section("rectangle", STEEL, width=0.003, height=0.003)
    errors = []
    for n in (2, 4, 8):
        mesh, _ = arc(n, np.pi / 2)
        model = mp.assemble(mesh, {"beam": thin}, ROOT)
        held = clamp(model)
        free = model.free[held.i]
        f = np.zeros(model.n_dof)
        f[model.dof[-1, 0]] = 1.0  # along the radius at the free end
        u = np.linalg.solve(held.K_ii.toarray(), f[free])
        exact = np.pi / (4 * 210e9 * 0.003**4 / 12)
        errors.append(abs(u[np.searchsorted(free, model.dof[-1, 0])] / exact - 1))
    assert errors[-1] < 5e-3
    assert np.log2(errors[0] / errors[1]) > 1.8
    assert np.log2(errors[1] / errors[2]) > 1.8


def test_stress_of_a_bent_beam_at_its_three_nodes():
    """M z / I of a tip force at the root, half of it in the middle of the only element."""
    section = mp.fe.beam_section("rectangle", STEEL, width=0.02, height=0.03)
    points = np.array([[0.0, 0, 0], [1.0, 0, 0], [0.5, 0, 0]])
    mesh = Mesh(points=points, cells={"line3": np.array([[0, 1, 2]])}, groups={"beam": {"line3": np.array([0])}})
    model = mp.assemble(mesh, {"beam": section}, ROOT)
    f = np.zeros(model.n_dof)
    f[model.dof[1, 2]] = 100.0
    u = np.zeros(model.n_dof)
    free = np.setdiff1d(np.arange(model.n_dof), model.dof[0])
    u[free] = np.linalg.solve(model.K.toarray()[np.ix_(free, free)], f[free])
    stress = mp.fe.stress_recovery(model, mesh, {"all": mp.fe.StressPoint(group="beam")})(u[:, None])
    largest = 100.0 * 0.015 / (0.02 * 0.03**3 / 12)
    for node, share in ((1, 1.0), (3, 0.5), (2, 0.0)):
        own = [abs(there.modes[0, 0]) for name, there in stress.items() if name.startswith(f"all.{node}.")]
        assert max(own) == pytest.approx(share * largest, abs=1e-9 * largest)
