"""Generated meshes: measures from closed forms, topology by counting edges, groups where the docstrings put them."""

import numpy as np
import pytest
from fe.generated import HOLED, STRUCTURE, area, every, needs_gmsh, normals, triangles
from scipy.integrate import dblquad
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from modalprep.fe.generation.generate import GENERATORS, make_mesh
from modalprep.fe.mesh.cells import cell_dimension

SHELLS = [
    ("plate", {}),
    ("plate", HOLED),
    ("stiffened-panel", {}),
    ("tube", {}),
    ("boom", {}),
    ("boom", {"angle": 90}),
    ("blade", {}),
]
SHELLS = [(name, {**p, "element": element}) for name, p in SHELLS for element in ("quad", "triangle")]
SOLIDS = [("box", {"element": e, "order": o}) for e in ("tetrahedron", "hexahedron") for o in (1, 2)]
SOLIDS += [("l-bracket", {}), ("l-bracket", {"order": 1}), ("l-bracket", {"fillet": 0})]
LINES = [("beam", {}), ("truss-tower", {}), ("truss-tower", {"bracing": "single", "elements": 3})]
EVERY = SHELLS + SOLIDS + LINES


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Return ``made(name, **params)``; equal calls share one mesh."""
    folder, known = tmp_path_factory.mktemp("meshes"), {}

    def make(name, **params):
        key = (name, *sorted(params.items()))
        if key not in known:
            known[key] = make_mesh(name, folder / f"{len(known)}.msh", **params)
        return known[key]

    return make


def lengths(mesh, group):
    a, b = mesh.points[mesh.group(group)["line"]].swapaxes(0, 1)
    return np.linalg.norm(b - a, axis=1)


EDGES = np.array([(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)])  # mid-edge nodes of meshio's tetra10
SIDE = np.full((4, 4), 1 / 6) + np.eye(4) / 3
POINTS, WEIGHTS = np.vstack([np.full(4, 0.25), SIDE]), np.array([-0.8, *[0.45] * 4]) / 6  # exact for cubics


def tetrahedron_jacobians(points):
    """Jacobian determinants (ne, 5) of tetra10 cells, cubic polynomials, at the quadrature points."""
    of_L = np.array([[-1, -1, -1], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    found = []
    for L in POINTS:
        corner = (4 * L[:, None] - 1) * of_L
        middle = 4 * (L[EDGES[:, 0], None] * of_L[EDGES[:, 1]] + L[EDGES[:, 1], None] * of_L[EDGES[:, 0]])
        found.append(np.linalg.det(np.einsum("eni,nj->eij", points, np.vstack([corner, middle]))))
    return np.array(found).T


def straight_tetrahedra(points):
    return np.linalg.det(points[:, 1:4] - points[:, :1]) / 6


def straight_hexahedra(points):
    """Volumes of hexahedra with parallel edges."""
    return np.linalg.det(points[:, [1, 3, 4]] - points[:, :1])


# --- measures -------------------------------------------------------------------------------------------------------


@needs_gmsh
def test_beam(made):
    mesh = made("beam", length=2.5, elements=7)
    assert lengths(mesh, "beam") == pytest.approx(np.full(7, 2.5 / 7), rel=1e-12)
    assert len(mesh.points) == 8
    assert mesh.points[mesh.nodes("root")].tolist() == [[0, 0, 0]]
    assert mesh.points[mesh.nodes("tip")].tolist() == [[2.5, 0, 0]]


@needs_gmsh
@pytest.mark.parametrize("element", ["quad", "triangle"])
def test_plate_area(made, element):
    mesh = made("plate", length=2.0, width=0.6, size=0.1, element=element)
    assert area(mesh, "plate") == pytest.approx(1.2, rel=1e-12)
    assert len(mesh.points) == 21 * 7
    assert lengths(mesh, "edge").sum() == pytest.approx(5.2, rel=1e-12)


@needs_gmsh
@pytest.mark.parametrize("element", ["quad", "triangle"])
@pytest.mark.parametrize("hole", [0.02, 0.2, 0.45])
def test_plate_with_a_hole(made, element, hole):
    """The rim is a polygon with its corners on the circle, inscribed at equal angles."""
    mesh = made("plate", hole=hole, element=element)
    x, y, _ = (mesh.points[mesh.nodes("hole")] - [0.5, 0, 0]).T
    n = len(x)
    assert n >= 16
    assert np.hypot(x, y) == pytest.approx(hole / 2, rel=1e-12)
    polygon = n / 2 * (hole / 2) ** 2 * np.sin(2 * np.pi / n)
    assert area(mesh, "plate") == pytest.approx(0.5 - polygon, rel=1e-8)


@needs_gmsh
@pytest.mark.parametrize("shape", [{}, HOLED, {"hole": 0.001, "size": 0.09}, {"hole": 0.01, "size": 0.5}])
def test_quads_mean_quads(made, shape):
    """Not one triangle among them, however small the hole is in its elements."""
    assert {kind for kind in made("plate", **shape).cells if cell_dimension(kind) == 2} == {"quad"}


@needs_gmsh
def test_stiffened_panel(made):
    mesh = made("stiffened-panel", length=3.0, width=1.2, stiffeners=3, size=0.1)
    assert area(mesh, "skin") == pytest.approx(3.6, rel=1e-12)
    assert lengths(mesh, "stiffeners").sum() == pytest.approx(9.0, rel=1e-12)
    assert np.unique(mesh.points[mesh.nodes("stiffeners"), 1].round(12)) == pytest.approx([-0.4, 0, 0.4], abs=1e-12)


@needs_gmsh
@pytest.mark.parametrize("element", ["quad", "triangle"])
def test_tube_area(made, element):
    """A prism over the regular polygon inscribed in the circle; gmsh spaces its corners to some 1e-9."""
    mesh = made("tube", length=3.0, radius=0.2, size=0.08, element=element)
    n = len(mesh.nodes("root"))
    assert n == 16
    assert np.hypot(*mesh.points[:, 1:].T) == pytest.approx(0.2, rel=1e-12)
    assert area(mesh, "tube") == pytest.approx(n * 2 * 0.2 * np.sin(np.pi / n) * 3.0, rel=1e-8)


@needs_gmsh
@pytest.mark.parametrize("angle", [40.0, 180.0, 270.0, 355.0])
def test_boom_area(made, angle):
    mesh = made("boom", length=0.5, radius=0.03, angle=angle)
    n, arc = len(mesh.nodes("root")) - 1, np.deg2rad(angle)
    assert area(mesh, "boom") == pytest.approx(n * 2 * 0.03 * np.sin(arc / 2 / n) * 0.5, rel=1e-8)
    across = np.arctan2(mesh.points[:, 1], mesh.points[:, 2])  # from +z, which halves the arc
    assert [across.min(), across.max()] == pytest.approx([-arc / 2, arc / 2], rel=1e-9)
    assert lengths(mesh, "edge").sum() == pytest.approx(1.0, rel=1e-12)


@needs_gmsh
def test_blade_without_twist_is_a_trapezoid(made):
    mesh = made("blade", span=3.0, root_chord=0.4, tip_chord=0.1, twist=0)
    assert area(mesh, "blade") == pytest.approx(0.75, rel=1e-12)
    assert np.ptp(mesh.points[:, 2]) == 0


def blade_area(span, root, tip, twist):
    """Integrate ``|r_x x r_s| = c sqrt(1 + (c s theta')^2)`` of r = (x, c s cos theta, c s sin theta)."""

    def element(s, x):
        c = root + (tip - root) * x / span
        return c * np.sqrt(1 + (c * s * np.deg2rad(twist) / span) ** 2)

    return dblquad(element, 0, span, -0.5, 0.5, epsabs=1e-12)[0]


@needs_gmsh
@pytest.mark.parametrize("element", ["quad", "triangle"])
def test_twisted_blade_converges_with_the_square_of_the_size(made, element):
    shape = {"span": 1.0, "root_chord": 0.5, "tip_chord": 0.25, "twist": 90}
    exact = blade_area(*shape.values())
    error = [abs(area(made("blade", **shape, size=size, element=element), "blade") - exact) for size in (0.05, 0.025)]
    assert np.log2(error[0] / error[1]) == pytest.approx(2, abs=0.2)
    assert error[1] < 1e-3 * exact


@needs_gmsh
def test_blade_tip_is_turned(made):
    mesh = made("blade", span=2.0, root_chord=0.3, tip_chord=0.2, twist=30)
    tip = mesh.points[mesh.nodes("tip")]
    assert tip[:, 0] == pytest.approx(2.0)
    ends = tip[[tip[:, 1].argmin(), tip[:, 1].argmax()]]
    c, s = 0.1 * np.cos(np.pi / 6), 0.1 * np.sin(np.pi / 6)
    assert ends == pytest.approx(np.array([[2, -c, -s], [2, c, s]]), abs=1e-12)


@needs_gmsh
@every(SOLIDS[:4])
def test_box_volume(made, case):
    mesh = made(case[0], **case[1])
    cells = mesh.group("box")
    (kind,) = cells
    measure = straight_tetrahedra if kind.startswith("tetra") else straight_hexahedra
    volume = measure(mesh.points[cells[kind]])
    assert (
        kind
        == {
            ("tetrahedron", 1): "tetra",
            ("tetrahedron", 2): "tetra10",
            ("hexahedron", 1): "hexahedron",
            ("hexahedron", 2): "hexahedron20",
        }[tuple(case[1].values())]
    )
    assert volume.min() > 0
    assert volume.sum() == pytest.approx(1.0 * 0.2 * 0.1, rel=1e-12)
    if kind == "tetra10":
        assert tetrahedron_jacobians(mesh.points[cells[kind]]) @ WEIGHTS == pytest.approx(volume, rel=1e-9)


@needs_gmsh
@pytest.mark.parametrize("fillet", [0.0, 0.005])
def test_bracket_volume(made, fillet):
    """Two plates and the fillet less two holes; curved tetrahedra follow the arcs to (h/r)^4."""
    mesh = made("l-bracket", fillet=fillet)
    jacobian = tetrahedron_jacobians(mesh.points[mesh.group("bracket")["tetra10"]])
    plates = 0.04 * (0.08 * 0.006 + (0.06 - 0.006) * 0.006 + fillet**2 * (1 - np.pi / 4))
    assert jacobian.min() > 0
    assert (jacobian @ WEIGHTS).sum() == pytest.approx(plates - 2 * np.pi * 0.0045**2 * 0.006, rel=2e-5)


@needs_gmsh
def test_bracket_bolts(made):
    """Every node of the walls, mid-edge nodes too, is on its cylinder."""
    mesh = made("l-bracket")
    x, y, z = mesh.points[mesh.nodes("bolt_a")].T
    assert np.hypot(x - (0.011 + 0.08) / 2, y) == pytest.approx(0.0045, rel=1e-9)
    assert [z.min(), z.max()] == pytest.approx([0, 0.006], abs=1e-12)
    x, y, z = mesh.points[mesh.nodes("bolt_b")].T
    assert np.hypot(y, z - (0.011 + 0.06) / 2) == pytest.approx(0.0045, rel=1e-9)
    assert [x.min(), x.max()] == pytest.approx([0, 0.006], abs=1e-12)


@needs_gmsh
@pytest.mark.parametrize("elements", [1, 4])
@pytest.mark.parametrize(("bracing", "diagonals"), [("cross", 8), ("single", 4)])
def test_tower_lengths(made, elements, bracing, diagonals):
    shape = {"height": 12.0, "base": 3.0, "top": 1.0, "bays": 5}
    mesh = made("truss-tower", **shape, bracing=bracing, elements=elements)
    legs, braces = lengths(mesh, "legs"), lengths(mesh, "braces")
    assert len(legs) == 20 * elements
    assert len(braces) == (4 + diagonals) * 5 * elements
    assert legs.sum() == pytest.approx(4 * np.sqrt(12.0**2 + 1 + 1), rel=1e-12)  # a corner moves 1 m in x and in y
    width = 3.0 - 2.0 * np.arange(6) / 5
    rings = 4 * width[1:]
    slant = np.sqrt((12 / 5) ** 2 + (np.diff(width) / 2) ** 2 + (width[1:] + width[:-1]) ** 2 / 4)
    assert braces.sum() == pytest.approx((rings + diagonals * slant).sum(), rel=1e-12)


@needs_gmsh
@pytest.mark.parametrize("bracing", ["cross", "single"])
@pytest.mark.parametrize("top", [2.0, 0.5])
def test_tower_of_hinged_bars_is_no_mechanism(made, bracing, top):
    """Calladine: no mechanism where the compatibility matrix has the rank of the free displacements."""
    mesh = made("truss-tower", top=top, bracing=bracing)
    bars = np.concatenate([mesh.group(group)["line"] for group in ("legs", "braces")])
    direction = mesh.points[bars[:, 1]] - mesh.points[bars[:, 0]]
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    B = np.zeros((len(bars), len(mesh.points), 3))
    rows = np.arange(len(bars))
    B[rows, bars[:, 0]], B[rows, bars[:, 1]] = -direction, direction
    free = np.setdiff1d(np.arange(len(mesh.points)), mesh.nodes("root"))
    assert np.linalg.matrix_rank(B[:, free].reshape(len(bars), -1), tol=1e-6) == 3 * len(free)


# --- topology -------------------------------------------------------------------------------------------------------


def shell_edges(mesh):
    """Directed edges (k, 2) of all shells, element by element."""
    cells = [conn for kind, conn in mesh.cells.items() if cell_dimension(kind) == 2]
    return np.concatenate([np.stack([c, np.roll(c, -1, axis=1)], axis=2).reshape(-1, 2) for c in cells])


@needs_gmsh
@every(SHELLS)
def test_shells_are_oriented_alike(made, case):
    """Neighbours run through their common edge in opposite directions: no directed edge comes twice."""
    edges = shell_edges(made(case[0], **case[1]))
    assert len(np.unique(edges, axis=0)) == len(edges)
    _, count = np.unique(np.sort(edges, axis=1), axis=0, return_counts=True)
    assert count.max() == 2


@needs_gmsh
@every(SHELLS)
def test_normals(made, case):
    """Flat shells face +z, rolled ones outwards."""
    mesh = made(case[0], **case[1])
    group = STRUCTURE[case[0]][0]
    out = triangles(mesh, group).mean(axis=1) * [0, 1, 1] if case[0] in ("tube", "boom") else np.array([0, 0, 1.0])
    assert ((normals(mesh, group) * out).sum(axis=1) > 0).all()


@needs_gmsh
@every(SHELLS)
def test_lines_of_shells_are_edges_of_elements(made, case):
    mesh = made(case[0], **case[1])
    known = {tuple(edge) for edge in np.sort(shell_edges(mesh), axis=1).tolist()}
    assert {tuple(line) for line in np.sort(mesh.cells["line"], axis=1).tolist()} <= known


@needs_gmsh
@every(SHELLS)
def test_free_edges_are_named(made, case):
    """The boundary of a shell is the lines of its groups, nothing more or less."""
    mesh = made(case[0], **case[1])
    edges, count = np.unique(np.sort(shell_edges(mesh), axis=1), axis=0, return_counts=True)
    boundary = {tuple(edge) for edge in edges[count == 1].tolist()}
    lines = [mesh.group(group)["line"] for group in mesh.groups if group in ("root", "tip", "edge", "hole")]
    assert {tuple(line) for line in np.sort(np.concatenate(lines), axis=1).tolist()} == boundary


@needs_gmsh
@every(EVERY)
def test_one_part_without_stray_or_double_nodes(made, case):
    mesh = made(case[0], **case[1])
    structure = [conn for name in STRUCTURE[case[0]] for conn in mesh.group(name).values()]
    assert np.unique(np.concatenate([c.ravel() for c in structure])).tolist() == list(range(len(mesh.points)))
    pairs = np.concatenate(
        [np.stack([c[:, :1].repeat(c.shape[1], axis=1), c], axis=2).reshape(-1, 2) for c in structure]
    )
    graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(mesh.points),) * 2)
    assert connected_components(graph, directed=False)[0] == 1
    assert not cKDTree(mesh.points).query_pairs(1e-6 * np.ptp(mesh.points, axis=0).max())


@needs_gmsh
@every(EVERY)
def test_groups(made, case):
    """Those the list announces, none empty; the structure is in its groups and no other cell of its dimension is."""
    name, params = case
    mesh = made(name, **params)
    optional = set() if params.get("hole") or name != "plate" else {"hole"}
    assert set(mesh.groups) == set(GENERATORS[name].groups) - optional
    assert all(len(mesh.nodes(group)) for group in mesh.groups)
    dimension = max(map(cell_dimension, mesh.cells))
    for kind, conn in mesh.cells.items():
        if cell_dimension(kind) == dimension:
            rows = np.concatenate([mesh.groups[group].get(kind, []) for group in STRUCTURE[name]])
            assert np.sort(rows).tolist() == list(range(len(conn)))


@needs_gmsh
@every([case for case in EVERY if case[0] != "l-bracket"])
def test_root_and_tip_are_the_ends(made, case):
    mesh = made(case[0], **case[1])
    along = mesh.points[:, 2 if case[0] == "truss-tower" else 0].copy()
    if case[0] == "truss-tower":
        along[np.setdiff1d(np.arange(len(along)), mesh.nodes("legs"))] = np.nan  # rings run through the top as well
    end = next(iter(GENERATORS[case[0]].parameters.values())).default  # length, span or height
    assert sorted(mesh.nodes("root")) == np.flatnonzero(abs(along) < 1e-9).tolist()
    assert sorted(mesh.nodes("tip")) == np.flatnonzero(abs(along - end) < 1e-9).tolist()


@needs_gmsh
@pytest.mark.parametrize("name", ["plate", "stiffened-panel"])
def test_corners(made, name):
    mesh = made(name, length=2.0, width=1.0)
    corners = mesh.points[mesh.nodes("corners")].tolist()
    assert sorted(corners) == [[0, -0.5, 0], [0, 0.5, 0], [2, -0.5, 0], [2, 0.5, 0]]
