"""Bases in the DOFs of a model: measures of cells in space, facets that scikit-fem finds, forms of a user."""

import numpy as np
import pytest
import skfem
from skfem.helpers import dot
from structured import box, random_rotation, surface

import modalprep as mp
from modalprep.errors import InputError
from modalprep.fe.families import FAMILIES
from modalprep.fe.forms.cells import corner_mesh
from modalprep.fe.mesh.cells import CELLS
from modalprep.fe.mesh.facets import boundary, distinct, facets

STEEL = mp.Material(E=2e11, nu=0.3, rho=8000.0)
R = random_rotation(7)
measure = skfem.Functional(lambda w: 1.0 + 0 * w.x[0])
outward = skfem.Functional(lambda w: dot(w.x, w.n))
pressure = skfem.LinearForm(lambda v, w: -dot(w.n, v))


def model(kind):
    """A unit cube or a unit square of distorted cells in a random position."""
    solid = CELLS[kind].dimension == 3
    points, cells = box(kind, (2, 2, 2), distort=0.1) if solid else surface(2, 2, kind, distort=0.1)
    section = mp.Solid(material=STEEL) if solid else mp.Shell(material=STEEL, thickness=0.01)
    mesh = mp.fe.Mesh(
        points=points @ R.T,
        cells={kind: cells},
        groups={"body": {kind: np.arange(len(cells))}},
    )
    root = mp.Interface(plane=(tuple(R @ (1.0, 0, 0)), tuple(R[:, 0])))
    return mp.assemble(mesh, {"body": section}, {"root": root})


@pytest.mark.parametrize("kind", FAMILIES[mp.Solid])
def test_faces_of_solids(kind):
    """The skin of a cube: its area, the divergence theorem for ``x``, and no force of a constant pressure."""
    cube = model(kind)
    faces = mp.fe.facet_bases(cube, "body")
    assert skfem.asm(measure, faces) == pytest.approx(6, rel=1e-12)
    assert skfem.asm(outward, faces) == pytest.approx(3, rel=1e-12)  # outward normals, volume 1
    force = cube.rigid_body().T @ skfem.asm(pressure, faces)
    np.testing.assert_allclose(force, 0, atol=1e-12)
    [solid] = mp.fe.group_bases(cube, "body")
    assert skfem.asm(measure, solid) == pytest.approx(1, rel=1e-12)


@pytest.mark.parametrize("kind", FAMILIES[mp.Shell])
def test_shells_in_space(kind):
    """Area, perimeter, and a bed over the area of a unit square that stands askew."""
    sheet = model(kind)
    own = mp.fe.group_bases(sheet, "body")
    assert skfem.asm(measure, own) == pytest.approx(1, rel=1e-12)
    assert skfem.asm(measure, mp.fe.facet_bases(sheet, "body")) == pytest.approx(4, rel=1e-12)
    bed = skfem.asm(skfem.BilinearForm(lambda u, t, v, s, w: dot(u, w.n) * dot(v, w.n)), own)
    lift = sheet.rigid_body()[:, :3] @ R[:, 2]
    assert lift @ bed @ lift == pytest.approx(1, rel=1e-12)


def test_some_facets():
    """The far face of a cube by a condition on its place, in the model's frame."""
    cube = model("hexahedron")
    far = mp.fe.facet_bases(cube, "body", lambda x: R[:, 0] @ x < -0.99)
    assert skfem.asm(measure, far) == pytest.approx(1, rel=1e-12)
    with pytest.raises(InputError, match="has no facet where"):
        mp.fe.facet_bases(cube, "body", lambda x: x[0] > 9)


def test_facets_of_two_wedges():
    """Five faces each, of which they share the triangle between them, whatever its first node."""
    for upper in ([3, 4, 5, 6, 7, 8], [4, 5, 3, 7, 8, 6]):
        found = boundary([("wedge", np.array([[0, 1, 2, 3, 4, 5], upper]))])
        assert {kind: len(cells) for kind, cells in found.items()} == {"triangle": 2, "quad": 6}


def test_facets_of_two_kinds_of_cells():
    """What a wedge and a hexahedron share is no facet of their union."""
    parts = [("hexahedron", np.array([[0, 1, 2, 3, 5, 6, 7, 8]])), ("wedge", np.array([[1, 4, 2, 6, 9, 7]]))]
    found = boundary(parts)
    assert {kind: len(cells) for kind, cells in found.items()} == {"quad": 7, "triangle": 2}


@pytest.mark.parametrize("kind", ["triangle", "quad", "tetra", "hexahedron"])
def test_facets_are_those_of_scikit_fem(kind):
    """Corners of all facets of a mesh, and of those on its boundary; not of wedges, see `mesh.facets`."""
    points, cells = box(kind, (3, 2, 2)) if CELLS[kind].dimension == 3 else surface(3, 2, kind)
    mesh = corner_mesh(kind, points, cells)
    for found, wanted in (
        (distinct(facets([(kind, cells)])), mesh.facets),
        (boundary([(kind, cells)]), mesh.facets[:, mesh.boundary_facets()]),
    ):
        own = [frozenset(face) for faces in found.values() for face in faces.tolist()]
        assert len(own) == wanted.shape[1]
        assert set(own) == set(map(frozenset, wanted.T.tolist()))


@pytest.mark.parametrize("kind", [kind for kind, cell in CELLS.items() if cell.dimension > 1])
def test_facets_have_the_nodes_of_their_kind(kind):
    """On the unit cell: mid-side nodes and centres are in the middle of their corners."""
    at = CELLS[kind].node_coordinates()
    for name, own in CELLS[kind].facets:
        corners, cell = at[own[: len(CELLS[name].corners)]], CELLS[name]
        middles = [corners[edge].mean(axis=0) for edge in cell.edges] + [corners.mean(axis=0)]
        np.testing.assert_array_equal(at[own], [*corners, *middles][: cell.count])


def test_a_group_that_has_no_basis():
    with pytest.raises(InputError, match="no elements of a group 'bdy'; did you mean 'body'"):
        mp.fe.group_bases(model("tetra"), "bdy")


@pytest.mark.parametrize("kind", ["tetra10", "quad", "quad8"])
def test_dofs_that_scikit_fem_finds_are_those_of_the_model(kind):
    """`get_dofs` on a side, against the model's table of DOFs."""
    own = model(kind)
    [basis] = mp.fe.group_bases(own, "body")
    found = basis.get_dofs(lambda x: np.abs(R[:, 0] @ x) < 1e-9).flatten()
    on = np.abs(own.points @ R[:, 0]) < 1e-9
    np.testing.assert_array_equal(found, np.sort(own.dof[: len(on)][on][own.dof[: len(on)][on] >= 0]))
