"""Orthotropic and anisotropic solids: patch tests, equal materials, rotations, rods along and across, decks."""

import numpy as np
import pytest
from analytic import off_axis_modulus
from scipy.sparse.linalg import spsolve
from structured import SOLVER, box, free_dofs, random_rotation, solid_model, submatrix

import modalprep as mp
from modalprep.fe import Anisotropic, Orthotropic3D
from modalprep.linalg.factor import factorise

KINDS = ("tetra", "tetra10", "wedge", "hexahedron", "hexahedron20", "hexahedron27")
WOOD = Orthotropic3D(
    E1=11e9, E2=0.9e9, E3=0.5e9, nu12=0.38, nu13=0.46, nu23=0.6, G12=0.88e9, G13=0.72e9, G23=0.06e9, rho=500.0
)
UPPER = np.triu_indices(6)


def random_material(seed=0):
    A = np.random.default_rng(seed).standard_normal((6, 6))
    C = 1e10 * (A @ A.T + 3 * np.eye(6))
    return Anisotropic(C=tuple(C[UPPER]), rho=2000.0), C


def axes_of(R):
    """The material's e1 and a direction beside it, for a body that R turns."""
    return tuple(R[:, 0]), tuple(R[:, 1] + 0.4 * R[:, 0])


@pytest.mark.parametrize("kind", KINDS)
def test_patch(kind):
    """Linear displacements on the surface of a distorted box give constant strain, and the stress of Hooke's law."""
    material, C = random_material()
    points, cells = box(kind, (3, 3, 3), (0.24, 0.12, 0.1), distort=0.3, seed=5)
    R = random_rotation(6)
    model = solid_model(points @ R.T, cells, kind, mp.Solid(material=material, axes=axes_of(R)))
    G = 1e-4 * np.random.default_rng(0).standard_normal((3, 3))
    dof, exact = model.dof[: len(points), :3], np.zeros(model.n_dof)
    exact[dof] = (points @ G.T) @ R.T
    size = np.array([0.24, 0.12, 0.1])
    outside = np.any(np.isclose(points, 0, atol=1e-12) | np.isclose(points, size, atol=1e-12), axis=1)
    inner, found = dof[~outside].ravel(), exact.copy()
    found[inner] = 0
    found[inner] = -factorise(submatrix(model.K, inner), SOLVER).solve((model.K @ found)[inner])
    assert np.abs(found - exact).max() < 1e-11 * np.abs(exact).max()
    strain = np.array([G[0, 0], G[1, 1], G[2, 2], G[0, 1] + G[1, 0], G[1, 2] + G[2, 1], G[0, 2] + G[2, 0]])
    xx, yy, zz, xy, yz, xz = C @ strain
    assert found @ (model.K @ found) / 2 == pytest.approx(strain @ C @ strain / 2 * size.prod(), rel=1e-11)
    sigma = R @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ R.T
    block = model.strain_energy.blocks[0]
    nodal = block.nodal_stress(found[model.dof[block.nodes, :3]].reshape(len(block.nodes), -1, 1))[""][1]
    expected = [sigma[0, 0], sigma[1, 1], sigma[2, 2], sigma[0, 1], sigma[1, 2], sigma[0, 2]]
    np.testing.assert_allclose(nodal[..., 0], np.broadcast_to(expected, nodal.shape[:3]), atol=1e-9 * abs(sigma).max())


@pytest.mark.parametrize("kind", KINDS)
def test_an_isotropic_material_in_three_ways(kind):
    """E, nu; nine equal constants; 21 moduli: the same stiffness, geometric stiffness and stress, whatever the axes."""
    E, nu, rho = 7e10, 0.3, 2700.0
    G = E / (2 * (1 + nu))
    plain = mp.Material(E=E, nu=nu, rho=rho)
    nine = Orthotropic3D(E1=E, E2=E, E3=E, nu12=nu, nu13=nu, nu23=nu, G12=G, G13=G, G23=G, rho=rho)
    every = Anisotropic(C=tuple(nine.moduli()[UPPER]), rho=rho)
    points, cells = box(kind, (2, 2, 1), distort=0.3, seed=7)
    axes = axes_of(random_rotation(2))
    sections = [mp.Solid(material=plain)] + [mp.Solid(material=m, axes=axes) for m in (nine, every)]
    models = [solid_model(points, cells, kind, section) for section in sections]
    d = 1e-4 * np.random.default_rng(1).standard_normal(models[0].n_dof)
    for other in models[1:]:
        for a, b in ((models[0].K, other.K), tuple(m.geometric_stiffness(d, m.K @ d) for m in (models[0], other))):
            assert abs(a - b).max() < 1e-13 * abs(a).max()


@pytest.mark.parametrize("kind", ["tetra10", "hexahedron"])
def test_rotation_of_body_and_material(kind):
    """The stiffness turns with the body when the axes of its material do, and only then."""
    points, cells = box(kind, (2, 1, 1), distort=0.2, seed=3)
    R = random_rotation(9)
    straight = solid_model(points, cells, kind, mp.Solid(material=WOOD))
    d = np.random.default_rng(2).standard_normal((len(points), 3))
    energies = []
    for axes in (axes_of(R), None):
        model = solid_model(points @ R.T, cells, kind, mp.Solid(material=WOOD, axes=axes))
        u = np.zeros(model.n_dof)
        u[model.dof[: len(points), :3]] = d @ R.T
        energies.append(u @ (model.K @ u))
    u[straight.dof[: len(points), :3]] = d
    assert energies[0] == pytest.approx(u @ (straight.K @ u), rel=1e-12)
    assert abs(energies[1] / energies[0] - 1) > 1e-3


def test_elements_with_axes_of_their_own():
    """Each brick has the stiffness and the stress that it has alone; where it has no axes, those of the section."""
    points, cells = box("hexahedron", (3, 1, 1), distort=0.2, seed=4)
    frames = np.array([random_rotation(1).T, random_rotation(2).T, np.full((3, 3), np.nan)])
    mesh = mp.fe.Mesh(points=points, cells={"hexahedron": cells}, groups={"body": {"hexahedron": np.arange(3)}},
                      data={"frame": {"hexahedron": frames}})  # fmt: skip
    section, root = mp.Solid(material=WOOD), {"root": mp.Interface(plane=((0.0, 0, 0), (1.0, 0, 0)))}
    block = mp.assemble(mesh, {"body": section}, root).strain_energy.blocks[0]
    d = np.random.default_rng(0).standard_normal((3, 24, 1))
    stress = block.nodal_stress(d)[""][1]
    for k in range(3):
        axes = None if k == 2 else axes_of(frames[k].T)
        alone = block.build("hexahedron", points, cells[k : k + 1], mp.Solid(material=WOOD, axes=axes), {}, np.zeros(3))
        np.testing.assert_allclose(block.stiffness()[k], alone.stiffness()[0], rtol=1e-9, atol=1e-3)
        np.testing.assert_allclose(block.piece([k]).nodal_stress(d[[k]])[""][1][0], stress[k], rtol=1e-12)
        np.testing.assert_allclose(alone.nodal_stress(d[[k]])[""][1][0], stress[k], rtol=1e-9, atol=1e-2)


def test_axes_that_are_not_orthonormal_are_refused():
    points, cells = box("hexahedron", (1, 1, 1))
    groups, data = {"body": {"hexahedron": np.arange(1)}}, {"frame": {"hexahedron": 2 * np.eye(3)[None]}}
    mesh = mp.fe.Mesh(points=points, cells={"hexahedron": cells}, groups=groups, data=data)
    with pytest.raises(
        mp.InputError, match="group 'body': the axes of the material of a solid element are not orthono"
    ):
        mp.assemble(mesh, {"body": mp.Solid(material=WOOD)}, {"root": mp.Interface(plane=((0.0, 0, 0), (1.0, 0, 0)))})


@pytest.mark.parametrize("degrees", [0, 20, 45, 90])
def test_tension_of_an_off_axis_bar(degrees):
    """Jones, equation 2.97, with the grain at an angle in the plane 1-2; and along axis 3, E3."""
    angle = np.radians(degrees)
    axes = ((np.cos(angle), np.sin(angle), 0.0), (-np.sin(angle), np.cos(angle), 0.0))
    assert stretch(axes) == pytest.approx(1 / off_axis_modulus(WOOD, angle), rel=1e-9)
    assert stretch(((0.0, 0, 1.0), (1.0, 0, 0))) == pytest.approx(1 / WOOD.E2, rel=1e-9)
    assert stretch(((0.0, 1.0, 0), (0.0, 0, 1.0))) == pytest.approx(1 / WOOD.E3, rel=1e-9)


def stretch(axes):
    """Mean strain per stress of a bar of one brick that is pulled along x, held without restraint."""
    points, cells = box("hexahedron", (1, 1, 1), (2.0, 1.0, 1.0))
    model = solid_model(points, cells, "hexahedron", mp.Solid(material=WOOD, axes=axes))
    end, start = (np.flatnonzero(points[:, 0] == x) for x in (2.0, 0.0))
    load = np.zeros(model.n_dof)
    load[model.dof[end, 0]], load[model.dof[start, 0]] = 0.25, -0.25
    corner, along, up = (np.flatnonzero((points == p).all(axis=1))[0] for p in ([0, 0, 0], [0, 1, 0], [0, 0, 1]))
    held = [*model.dof[corner, :3], model.dof[along, 2], model.dof[along, 0], model.dof[up, 0]]
    keep, u = free_dofs(model, np.array(held), components=range(3)), np.zeros(model.n_dof)
    u[keep] = spsolve(submatrix(model.K, keep).tocsc(), load[keep])
    return (u[model.dof[end, 0]].mean() - u[model.dof[start, 0]].mean()) / 2.0


def test_frequency_of_a_rod_along_and_across_the_grain():
    """Fixed-free thin rod, f = sqrt(E / rho) / 4 L, along each axis of the material."""
    points, cells = box("hexahedron20", (10, 1, 1), (1.0, 0.4, 0.4))
    face = np.flatnonzero(points[:, 0] == 0.0)
    soft = Orthotropic3D(**{**vars(WOOD), "nu12": 0.0, "nu13": 0.0, "nu23": 0.0})  # a clamped end adds no stress then
    for axes, E in ((None, WOOD.E1), (((0.0, 1, 0), (1.0, 0, 0)), WOOD.E2), (((0.0, 0, 1), (0.0, 1, 0)), WOOD.E3)):
        model = solid_model(points, cells, "hexahedron20", mp.Solid(material=soft, axes=axes), face)
        table = mp.craig_bampton(model, modes=24).table.frequency[:24]
        expected = np.sqrt(E / 500.0) / 4.0
        assert np.abs(table / expected - 1).min() < 1e-6  # without contraction across, the rod may be thick


REFUSED = {
    "ratio": ({"nu12": 4.0}, "some strain has no positive energy"),
    "modulus": ({"E3": 0.0}, "E3 = 0 must be positive"),
}


@pytest.mark.parametrize(("changes", "said"), REFUSED.values(), ids=list(REFUSED))
def test_constants_that_no_material_has(changes, said):
    with pytest.raises(mp.InputError, match=said):
        Orthotropic3D(**{**vars(WOOD), **changes})


def test_other_refusals():
    with pytest.raises(mp.InputError, match="no positive energy"):
        Anisotropic(C=(1.0, 2.0) + (0.0,) * 4 + (1.0,) + (0.0,) * 13 + (1.0,), rho=1.0)
    with pytest.raises(mp.InputError, match="C has 3 numbers"):
        Anisotropic(C=(1.0, 2.0, 3.0), rho=1.0)
    lamina = mp.fe.Orthotropic(E1=1.0, E2=1.0, nu12=0.3, G12=1.0, G13=1.0, G23=1.0, rho=1.0)
    with pytest.raises(mp.InputError, match="cannot be made of a lamina"):
        mp.Solid(material=lamina)
    with pytest.raises(mp.InputError, match="of a solid lie on one line"):
        mp.Solid(material=WOOD, axes=((1.0, 0, 0), (-1.0, 0, 0)))


# --- decks --------------------------------------------------------------------------------------------------------

BRICK = "".join(
    f"GRID,{k + 1},,{x},{y},{z}\n"
    for k, (x, y, z) in enumerate(
        [(0.0, 1.0, 0.0), (10.0, 1.0, 0.0), (10.0, 5.0, 0.0), (0.0, 4.0, 0.0),
         (0.0, 1.0, 3.0), (10.0, 1.0, 3.0), (10.0, 5.0, 3.0), (0.0, 4.0, 3.5)]
    )
) + "CHEXA,1,4,1,2,3,4,5,6,\n,7,8\n"  # fmt: skip
MAT11 = "MAT11,7,11000.,900.,500.,.38,.46,.6,880.,\n,720.,60.,5.-10\n"


def mat9(C):
    values = [f"{c / 1e6:.9e}".replace("e", "").replace("+0", "+").replace("-0", "-") for c in C[UPPER]]
    return (
        "MAT9,7," + ",".join(values[:7]) + ",\n," + ",".join(values[7:15]) + ",\n," + ",".join(values[15:]) + ",5.-10\n"
    )


def stiffness(mesh):
    return mp.assemble(mesh, {}, {"root": mp.Interface(box=((-1.0, -1, -1), (1.0, 1, 1)))}).K


@pytest.fixture
def mm(read):
    return lambda text: read(text, length=1e-3, mass=1e3)


def test_mat9_and_mat11_in_millimetres(mm):
    nine, one = mm(BRICK + "PSOLID,4,7\n" + MAT11), mm(BRICK + "PSOLID,4,7\n" + mat9(WOOD.moduli()))
    assert vars(nine.properties["psolid_4"].material) == pytest.approx(vars(WOOD), rel=1e-12)
    np.testing.assert_allclose(one.properties["psolid_4"].material.moduli(), WOOD.moduli(), atol=1e-8 * 11e9)
    assert abs(stiffness(nine) - stiffness(one)).max() < 1e-8 * abs(stiffness(one)).max()
    assert "frame" not in nine.data


def test_axes_of_cordm(mm):
    """A cylindrical system about the x axis: e1 radial, e2 tangential at the middle of the element, e3 along x."""
    system = "CORD2C,3,,0.,0.,0.,1.,0.,0.,\n,0.,1.,0.\n"
    mesh = mm(system + BRICK + "PSOLID,4,7,3\n" + MAT11)
    middle = mesh.points[mesh.cells["hexahedron"][0]].mean(axis=0)
    radial = np.array([0, middle[1], middle[2]]) / np.hypot(*middle[1:])
    frame = mesh.data["frame"]["hexahedron"][0]
    np.testing.assert_allclose(frame, [radial, np.cross([1.0, 0, 0], radial), [1, 0, 0]], atol=1e-12)
    other = mesh.with_(data={}, properties={"psolid_4": mp.Solid(material=WOOD, axes=tuple(map(tuple, frame[:2])))})
    assert abs(stiffness(mesh) - stiffness(other)).max() < 1e-12 * abs(stiffness(other)).max()
    plain = mm(BRICK + "PSOLID,4,7\n" + MAT11)
    assert abs(stiffness(mesh) - stiffness(plain)).max() > 0.1 * abs(stiffness(plain)).max()


def test_cordm_of_the_element_is_refused(mm):
    with pytest.raises(mp.InputError, match="PSOLID 4: CORDM = -1 .axes of the element. is not read"):
        mm(BRICK + "PSOLID,4,7,-1\n" + MAT11)
