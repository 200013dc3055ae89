"""Openings, pins and plane faces found in meshes, against the shapes that they were made from."""

import numpy as np
import pytest
from fe.generated import needs_gmsh

import modalprep as mp
from modalprep.fe.features.cylinder import fit_cylinder
from modalprep.fe.features.groups import structural_groups
from modalprep.fe.features.openings import openings
from modalprep.fe.features.planes import plane_faces
from modalprep.fe.features.skin import skin_of
from modalprep.fe.generation.generate import make_mesh
from modalprep.vectors import as_rotation

TURNED = as_rotation((np.array([1.0, 2.0, 3.0]), 0.7), "test")


def found_in(mesh):
    return openings(mesh, skin_of(mesh))


@pytest.fixture(scope="module")
def bracket(project):
    return mp.read_mesh(project / "meshes" / "bracket.msh", "mm")


def test_bolt_holes_of_the_bracket(bracket):
    """Corner nodes lie on the holes to the sixteen digits of the file, whatever the size of the facets between them."""
    first, second = found_in(bracket)
    for one, centre in ((first, [0, 0, 0]), (second, [0.08, 0.05, 0])):
        assert one.hole
        assert one.cylinder.radius == pytest.approx(0.0045, rel=1e-9)
        assert one.length == pytest.approx(0.008, rel=1e-9)
        np.testing.assert_allclose(one.centre, centre, atol=1e-9 * 0.1)
        np.testing.assert_allclose(one.cylinder.axis, [0, 0, 1], atol=1e-9)
    bolt = bracket.nodes("bolt_a")
    assert set(first.nodes) == set(bolt) & set(bracket.cells["tetra10"][:, :4].ravel())


def test_turned_and_moved(bracket):
    moved = bracket.with_(points=bracket.points @ TURNED.T + [3.0, -2.0, 1.0])
    for one, centre in zip(
        sorted(found_in(moved), key=lambda one: one.centre[0]), ([0, 0, 0], [0.08, 0.05, 0]), strict=True
    ):
        assert one.cylinder.radius == pytest.approx(0.0045, rel=1e-8)  # round-off of coordinates of 3 m: 1e-13 of them
        np.testing.assert_allclose(abs(one.cylinder.axis @ TURNED[:, 2]), 1.0, rtol=1e-12)
        np.testing.assert_allclose(one.centre, TURNED @ centre + [3.0, -2.0, 1.0], atol=1e-9)


def test_coordinates_of_few_digits(bracket):
    """Nodes rounded to a hundredth of a millimetre, as short fields of decks have them: 59 of them average it."""
    rough = bracket.with_(points=bracket.points.round(5))
    for one in found_in(rough):
        assert one.cylinder.radius == pytest.approx(0.0045, abs=0.5e-5)
        assert np.linalg.norm(one.cylinder.axis[:2]) < 2 * 0.5e-5 / 0.004  # over half the thickness


def test_plane_faces_of_the_bracket(bracket):
    """Top and bottom: the outline less the two holes and what the two roundings cut off."""
    planes = plane_faces(skin_of(bracket))
    assert [tuple(one.normal.round(9) + 0.0) for one in planes[:2]] in (
        [(0, 0, 1), (0, 0, -1)],
        [(0, 0, -1), (0, 0, 1)],
    )
    assert planes[0].area == pytest.approx(planes[1].area, rel=1e-3)  # facets of different circles' edges
    assert all(abs(one.point[2]) == pytest.approx(0.004, rel=1e-9) for one in planes[:2])


def solid(tmp_path, draw, size):
    import gmsh

    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        draw(gmsh.model)
        gmsh.model.occ.synchronize()
        gmsh.option.setNumber("Mesh.MeshSizeMax", size)
        gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", 12)
        gmsh.model.mesh.generate(3)
        gmsh.write(str(tmp_path / "mesh.msh"))
    finally:
        gmsh.finalize()
    return mp.read_mesh(tmp_path / "mesh.msh")


def block_with_rounded_bore(model):
    """A bore whose edges are rounded, so that wall, rounding and top are one smooth surface."""
    occ = model.occ
    (block, *_), _ = occ.cut([(3, occ.addBox(-1, -1, 0, 2, 2, 1))], [(3, occ.addCylinder(0, 0, -1, 0, 0, 3, 0.4))])
    occ.synchronize()
    rims = [tag for dim, tag in model.getEntities(1) if is_circle(model, tag)]
    occ.fillet([block[1]], rims, [0.2])


def is_circle(model, tag):
    box = np.reshape(model.getBoundingBox(1, tag), (2, 3))
    return np.ptp(box[:, 2]) < 1e-3 and np.allclose(np.ptp(box, axis=0)[:2], 0.8, atol=1e-3)


def plate_with_slot_and_fork(model):
    """A slot, which is no opening, and two lugs with one bore."""
    occ = model.occ
    slot = occ.fuse(
        [(3, occ.addBox(1, 0.8, -1, 1, 0.4, 3))], [(3, occ.addCylinder(x, 1, -1, 0, 0, 3, 0.2)) for x in (1, 2)]
    )[0]
    plate = occ.cut([(3, occ.addBox(0, 0, 0, 3, 2, 0.5))], slot)[0]
    lugs = [(3, occ.addBox(2.5, y, 0.5, 0.5, 0.3, 1)) for y in (0, 1.7)]
    occ.cut(occ.fuse(plate, lugs)[0], [(3, occ.addCylinder(2.75, -1, 1, 0, 4, 0, 0.15))])


@needs_gmsh
def test_a_bore_in_a_smooth_surface(tmp_path):
    (one,) = found_in(solid(tmp_path, block_with_rounded_bore, 0.3))
    assert one.hole
    assert one.cylinder.radius == pytest.approx(0.4, rel=1e-6)
    assert one.length == pytest.approx(0.6, rel=1e-6)  # between the roundings
    np.testing.assert_allclose(one.centre, [0, 0, 0.5], atol=1e-6)


@needs_gmsh
def test_slots_are_no_openings_and_lugs_are_one(tmp_path):
    (one,) = found_in(solid(tmp_path, plate_with_slot_and_fork, 0.3))
    assert one.cylinder.radius == pytest.approx(0.15, rel=1e-6)
    np.testing.assert_allclose(one.cylinder.axis, [0, 1, 0], atol=1e-6)
    np.testing.assert_allclose(one.centre, [2.75, 1, 1], atol=1e-6)
    assert one.length == pytest.approx(2.0, rel=1e-6)


@needs_gmsh
def test_a_hole_and_the_ends_of_shells(tmp_path):
    plate = make_mesh("plate", tmp_path / "plate.msh", length=1, width=1, hole=0.2)
    (hole,) = found_in(plate)
    assert hole.hole
    assert hole.length == 0
    tube = make_mesh("tube", tmp_path / "tube.msh")
    rims = found_in(tube)
    assert len(rims) == 2
    np.testing.assert_allclose([one.cylinder.radius for one in rims], rims[0].cylinder.radius, rtol=1e-6)


def test_points_on_no_cylinder():
    rng = np.random.default_rng(1)
    assert fit_cylinder(rng.normal(size=(30, 3)), rng.normal(size=(30, 3))) is None
    flat = np.column_stack([rng.normal(size=(30, 2)), np.zeros(30)])
    assert fit_cylinder(flat, np.tile([0.0, 0.0, 1.0], (30, 1))) is None
    cone = np.array([[r * np.cos(a), r * np.sin(a), 5 * r] for r in (1.0, 1.1) for a in np.arange(12) * np.pi / 6])
    assert fit_cylinder(cone, cone * [1, 1, 0]) is None


def test_groups_that_are_structure(project):
    satellite = mp.read_mesh(project / "meshes" / "satellite.msh")
    groups, left = structural_groups(satellite)
    assert {"decks": 2, "struts": 1, "payload": 3, "wings": 2}.items() <= groups.items()
    assert not {"rim", "launcher", "tank_ring"} & groups.keys()
    assert left == 0
    plate = mp.read_mesh(project / "meshes" / "plate.msh")
    assert structural_groups(plate) == ({"plate": 2}, 0)
