"""The outer surface as arrays: closed, of the right area, through mid-side nodes, as VTK finds it."""

import meshio
import numpy as np
import pytest
from report.conftest import block_points, hexahedra, quadratic
from scipy.spatial import ConvexHull
from vtkmodules import vtkCommonDataModel

from modalprep.errors import RenderError
from modalprep.fe.mesh.cells import CELLS
from modalprep.report.scene.skin import outer_skin, simplified

REFERENCE = {  # VTK's cell of each kind: it knows by itself where the nodes of second order lie
    ("tetra", 4): "vtkTetra", ("tetra", 10): "vtkQuadraticTetra", ("pyramid", 5): "vtkPyramid",
    ("pyramid", 13): "vtkQuadraticPyramid", ("wedge", 6): "vtkWedge", ("wedge", 15): "vtkQuadraticWedge",
    ("hexahedron", 8): "vtkHexahedron", ("hexahedron", 20): "vtkQuadraticHexahedron",
    ("hexahedron", 27): "vtkTriQuadraticHexahedron",
}  # fmt: skip


def area(points, triangles):
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


def cell(base, count):
    """One cell of size one as VTK numbers its nodes."""
    known = getattr(vtkCommonDataModel, REFERENCE[base, count])()
    points = np.array(known.GetParametricCoords()).reshape(-1, 3)[:count]
    for number in range(count):
        known.GetPointIds().SetId(number, number)
    for number in range(known.GetNumberOfEdges() if count > CELLS[base].count else 0):
        edge = known.GetEdge(number).GetPointIds()
        start, end, middle = (edge.GetId(k) for k in range(3))
        points[middle] = (points[start] + points[end]) / 2  # VTK's own place is another in the pyramid
    return points, {base if count == CELLS[base].count else f"{base}{count}": np.arange(count)[None]}


def open_edges(triangles):
    """Number of sides that not exactly two triangles have."""
    sides = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    return int((np.unique(sides, axis=0, return_counts=True)[1] != 2).sum())


@pytest.mark.parametrize(("base", "count"), REFERENCE)
def test_cell_of_every_kind_has_its_closed_surface(base, count):
    points, cells = cell(base, count)
    skin = outer_skin(points, cells)
    assert open_edges(skin.triangles) == 0
    assert area(points, skin.triangles) == pytest.approx(ConvexHull(points).area)
    halves = 2 if count > CELLS[base].count else 1
    assert len(skin.edges) == halves * len(CELLS[base].edges)
    lengths = np.linalg.norm(np.diff(points[skin.edges], axis=1)[:, 0], axis=1)
    whole = [np.linalg.norm(points[a] - points[b]) for a, b in CELLS[base].edges]
    assert lengths.sum() == pytest.approx(sum(whole))


@pytest.mark.parametrize(("base", "count"), [(b, n) for b, n in REFERENCE if n > CELLS[b].count])
def test_every_mid_side_node_is_followed(base, count):
    """Moved outwards, each middle node takes the surface with it, at its own edge."""
    points, cells = cell(base, count)
    used = np.unique(outer_skin(points, cells).triangles)
    inner = {count - 1} if count == 27 else set()
    assert set(range(count)) - set(used.tolist()) == inner
    flat = np.unique(outer_skin(points, cells, curved=False).triangles)
    assert flat.max() < CELLS[base].count


def test_faces_between_cells_of_any_kind_are_not_seen():
    """A brick, a pyramid on it, and a tetrahedron on the pyramid's side."""
    points = np.vstack([cell("hexahedron", 8)[0], [(0.5, 0.5, 2), (0.5, -1, 1.5)]])
    cells = {
        "hexahedron": np.arange(8)[None],
        "pyramid": np.array([[4, 5, 6, 7, 8]]),
        "tetra": np.array([[4, 5, 8, 9]]),
    }
    skin = outer_skin(points, cells)
    assert len(skin.triangles) == 5 * 2 + 3 + 3
    assert open_edges(skin.triangles) == 0


def test_block_of_many_cells_shows_its_outside_only(block):
    skin = outer_skin(block.points, block.cells)
    assert open_edges(skin.triangles) == 0
    assert area(block.points, skin.triangles) == pytest.approx(2 * (1.5 * 0.5 + 1.5 * 0.4 + 0.5 * 0.4))
    folds = np.linalg.norm(np.diff(block.points[skin.outline], axis=1)[:, 0], axis=1).sum()
    assert folds == pytest.approx(4 * (1.5 + 0.5 + 0.4))  # the twelve edges of the block


def test_shells_are_all_seen_and_end_where_they_end(frame):
    shells = {kind: frame.cells[kind] for kind in ("quad", "line", "vertex")}
    skin = outer_skin(frame.points, shells)
    assert area(frame.points, skin.triangles) == pytest.approx(1.0)
    assert np.linalg.norm(np.diff(frame.points[skin.outline], axis=1)[:, 0], axis=1).sum() == pytest.approx(4.0)
    np.testing.assert_array_equal(skin.lines, frame.cells["line"])


@pytest.mark.parametrize(("kind", "nodes", "count"), [("quad8", 8, 6), ("quad9", 9, 8), ("triangle6", 6, 4)])
def test_shells_of_second_order(kind, nodes, count):
    corners = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], dtype=float)[: 3 if nodes == 6 else 4]
    middles = (corners + np.roll(corners, -1, axis=0)) / 2
    points = np.vstack([corners, middles, corners.mean(axis=0)])[:nodes]
    skin = outer_skin(points, {kind: np.arange(nodes)[None]})
    assert len(skin.triangles) == count
    assert area(points, skin.triangles) == pytest.approx(0.5 if nodes == 6 else 1.0)


def test_curved_beams_run_through_their_middle_node():
    skin = outer_skin(np.zeros((3, 3)), {"line3": np.array([[0, 1, 2]])})
    np.testing.assert_array_equal(skin.lines, [[0, 2], [2, 1]])


def test_skin_agrees_with_vtk(bracket_body):
    pyvista = pytest.importorskip("pyvista")
    skin = outer_skin(bracket_body.points, bracket_body.cells)
    cells = {kind: nodes for kind, nodes in bracket_body.cells.items() if kind != "vertex"}
    grid = pyvista.from_meshio(meshio.Mesh(bracket_body.points, cells))
    drawn = grid.extract_surface(algorithm="dataset_surface", nonlinear_subdivision=1)
    assert len(skin.triangles) == drawn.n_cells
    assert area(bracket_body.points, skin.triangles) == pytest.approx(drawn.area, rel=1e-6)


def test_outline_is_that_of_the_undeformed_body():
    """Closed form: the twelve edges of a block; nodes that move fold the surface between any faces, as VTK finds."""
    surface = pytest.importorskip("modalprep.report.pictures.surface")
    points = block_points((4, 4, 4), (1.0, 2.0, 3.0))
    skin = outer_skin(points, {"hexahedron": hexahedra((4, 4, 4))})
    still = surface.segments(skin.outline, points)
    ends = still.points[still.lines.reshape(-1, 3)[:, 1:]]
    assert np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum() == pytest.approx(4 * (1 + 2 + 3), rel=1e-12)
    crumpled = points + 0.2 * np.random.default_rng(0).standard_normal(points.shape)
    assert surface.surface(skin, crumpled).extract_feature_edges(30).n_cells > 2 * still.n_cells


def test_large_surfaces_keep_their_shape_when_simplified():
    points = block_points((20, 20, 20), (1.0, 1.0, 1.0))
    skin = outer_skin(points, {"hexahedron": hexahedra((20, 20, 20))})
    small = simplified(points, skin, 1000)
    assert len(skin.triangles) == 4800
    assert 300 < len(small.triangles) <= 1000
    assert area(points, small.triangles) == pytest.approx(6.0, rel=0.25)
    assert np.ptp(points[small.triangles].reshape(-1, 3), axis=0).min() > 0.85


def test_tetra10_without_curves_has_a_quarter_of_the_triangles():
    points, cells = quadratic(cell("tetra", 4)[0], np.arange(4)[None])
    assert [len(outer_skin(points, {"tetra10": cells}, curved=c).triangles) for c in (True, False)] == [16, 4]


def test_unknown_cells_are_named():
    with pytest.raises(RenderError, match="cells of type polygon cannot be drawn"):
        outer_skin(np.zeros((3, 3)), {"polygon": np.array([[0, 1, 2]])})
