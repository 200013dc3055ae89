"""Generated meshes: measures from closed forms, topology by counting edges, groups where the docstrings put them."""

import json
import runpy
import subprocess
import sys

import numpy as np
import pytest
from scipy.integrate import dblquad
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from modalprep.cli import main
from modalprep.errors import InputError
from modalprep.fe import generate
from modalprep.fe.generate import GENERATORS, make_mesh
from modalprep.fe.mesh import cell_dimension
from modalprep.fe.read import read_mesh


def gmsh_problem():
    try:
        import gmsh  # noqa: F401
    except (ImportError, OSError) as error:
        return f"gmsh cannot be imported: {error}"
    return None


needs_gmsh = pytest.mark.skipif(gmsh_problem() is not None, reason=str(gmsh_problem()))

STRUCTURE = {
    "beam": ("beam",),
    "plate": ("plate",),
    "stiffened-panel": ("skin", "stiffeners"),
    "tube": ("tube",),
    "box": ("box",),
    "truss-tower": ("legs", "braces"),
    "boom": ("boom",),
    "l-bracket": ("bracket",),
    "blade": ("blade",),
}
HOLED = {"hole": 0.2}
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


def title(case):
    return "-".join([case[0], *(f"{k}={v}" for k, v in case[1].items())])


def every(cases):
    return pytest.mark.parametrize("case", cases, ids=title)


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


def triangles(mesh, group):
    """Corners (k, 3, 3) of the triangles that the shells of a group are, or are cut into."""
    cells = mesh.group(group)
    quads, plain = cells.get("quad", np.zeros((0, 4), int)), cells.get("triangle", np.zeros((0, 3), int))
    return mesh.points[np.concatenate([plain, quads[:, :3], quads[:, [2, 3, 0]]])]


def normals(mesh, group):
    """Area vectors of those triangles, m2."""
    corner = triangles(mesh, group)
    return np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]) / 2


def area(mesh, group):
    return np.linalg.norm(normals(mesh, group), axis=1).sum()


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


# --- files ----------------------------------------------------------------------------------------------------------


@needs_gmsh
@every([(name, {}) for name in GENERATORS] + [("plate", HOLED)])
def test_same_input_same_bytes(tmp_path, case):
    """Also after other meshes were made in this process."""
    first = make_mesh(case[0], tmp_path / "a.msh", **case[1])
    make_mesh("box", tmp_path / "other.msh", size=0.1)
    again = make_mesh(case[0], tmp_path / "b.msh", **case[1])
    assert first.sha256 == again.sha256


@needs_gmsh
def test_same_bytes_in_another_process(tmp_path):
    here = make_mesh("l-bracket", tmp_path / "here.msh")
    code = f"from modalprep.fe.generate import make_mesh; make_mesh('l-bracket', {str(tmp_path / 'there.msh')!r})"
    subprocess.run([sys.executable, "-c", code], check=True)
    assert read_mesh(tmp_path / "there.msh").sha256 == here.sha256


@needs_gmsh
def test_text_and_numbers_mean_the_same(tmp_path):
    a = make_mesh("box", tmp_path / "a.msh", size=0.1, order=1, element="tetrahedron")
    b = make_mesh("box", tmp_path / "b.msh", size="1e-1", order="1", element="tetrahedron")
    assert a.sha256 == b.sha256


@needs_gmsh
def test_gmsh_is_closed_after_success_and_failure(tmp_path):
    import gmsh

    make_mesh("beam", tmp_path / "a.msh")
    assert not gmsh.isInitialized()
    with pytest.raises(InputError, match="does not fit into a plate"):
        make_mesh("plate", tmp_path / "b.msh", hole=0.5)
    assert not gmsh.isInitialized()
    assert [file.name for file in tmp_path.iterdir()] == ["a.msh"]


@needs_gmsh
def test_a_model_open_in_gmsh_is_left_alone(tmp_path):
    import gmsh

    gmsh.initialize(interruptible=False)
    try:
        gmsh.model.add("mine")
        with pytest.raises(InputError, match=r"gmsh is open in this program.*gmsh.finalize"):
            make_mesh("beam", tmp_path / "a.msh")
        assert gmsh.isInitialized()
        assert gmsh.model.getCurrent() == "mine"
    finally:
        gmsh.finalize()


@needs_gmsh
def test_what_gmsh_refuses_is_one_sentence(tmp_path, monkeypatch):
    import gmsh

    def fail(dimension):
        raise Exception("no luck today")

    monkeypatch.setattr(gmsh.model.mesh, "generate", fail)
    with pytest.raises(InputError, match="gmsh cannot mesh this beam: no luck today; choose other parameters"):
        make_mesh("beam", tmp_path / "a.msh")
    assert not gmsh.isInitialized()


@needs_gmsh
def test_generate_does_not_touch_its_parameters(tmp_path):
    params = {"length": "2", "elements": 3.0}
    make_mesh("beam", tmp_path / "a.msh", **params)
    assert params == {"length": "2", "elements": 3.0}


# --- bad input ------------------------------------------------------------------------------------------------------

SENTENCES = [
    ("plat", {}, r"unknown shape 'plat'; did you mean 'plate'\? known are beam, plate"),
    ("plate", {"lenght": 2}, r"shape plate has no parameter 'lenght'; did you mean 'length'\? it has length, width"),
    ("plate", {"length": "wide"}, "length = wide is not a number; give one in m"),
    ("plate", {"length": ""}, "length =  is not a number"),
    ("plate", {"length": None}, "length = None is not a number"),
    ("plate", {"length": True}, "length = True is not a number"),
    ("plate", {"length": "nan"}, "length = nan is not a finite number"),
    ("plate", {"length": float("inf")}, "length = inf is not a finite number"),
    ("plate", {"length": 0}, "length = 0 must be positive$"),
    ("plate", {"length": -2}, "length = -2 must be positive$"),
    ("plate", {"hole": -1}, "hole = -1 must be positive or zero$"),
    ("plate", {"length": 1e9}, "length = 1e.09 m is outside 1e-05 to 1e.06; give metres"),
    ("plate", {"length": 1e-9}, "length = 1e-09 m is outside"),
    ("plate", {"length": 1e5, "width": 1e-4}, "width = 0.0001 m is lost beside length = 100000 m"),
    ("plate", {"element": "quads"}, r"element = quads is unknown; did you mean 'quad'\? known are quad, triangle"),
    ("box", {"order": 3}, "order = 3 is unknown; known are 1, 2"),
    ("beam", {"elements": 2.5}, "elements = 2.5 is not a whole number"),
    ("beam", {"elements": 0}, "elements = 0 must be positive"),
]
NEED_GMSH = [
    ("plate", {"hole": 0.46}, "hole = 0.46 m does not fit into a plate of 1 m by 0.5 m; make it smaller than 0.45 m"),
    ("plate", {"size": 1e-5}, "the mesh would have about 5e.09 elements, more than 500000; give a larger size"),
    ("plate", {"size": 1e-5, "hole": 0.1}, "about 5e.09 elements"),
    ("tube", {"size": 1e-5}, "elements, more than 500000; give a larger size"),
    ("blade", {"size": 1e-5}, "elements, more than 500000"),
    ("box", {"size": 1e-5}, "elements, more than 500000"),
    ("box", {"size": 1e-5, "element": "hexahedron"}, "elements, more than 500000"),
    ("l-bracket", {"size": 1e-5}, "elements, more than 500000"),
    ("beam", {"elements": "1e300"}, "elements, more than 500000; choose fewer elements"),
    ("truss-tower", {"bays": 10**9}, "choose fewer bays or elements"),
    ("stiffened-panel", {"stiffeners": 10**7}, "choose fewer stiffeners"),
    ("boom", {"angle": 360}, "angle = 360 deg leaves no slit; make it at most 355, or take shape tube"),
    ("blade", {"twist": -400}, "twist = -400 deg is more than one turn"),
    ("l-bracket", {"hole": 0.037}, "hole = 0.037 m does not fit beside the fillet; make it smaller than 0.036 m"),
    ("l-bracket", {"fillet": 0.06}, "does not fit beside the fillet; make length and height larger"),
]


def refused(folder, name, params, sentence):
    with pytest.raises(InputError, match=sentence) as caught:
        make_mesh(name, folder / "a.msh", **params)
    assert "\n" not in str(caught.value)
    assert not list(folder.iterdir())


@pytest.mark.parametrize(("name", "params", "sentence"), SENTENCES)
def test_bad_parameters(tmp_path, name, params, sentence):
    refused(tmp_path, name, params, sentence)


@needs_gmsh
@pytest.mark.parametrize(("name", "params", "sentence"), NEED_GMSH)
def test_impossible_shapes(tmp_path, name, params, sentence):
    refused(tmp_path, name, params, sentence)


@pytest.mark.parametrize("suffix", [".bdf", ".inp", ".vtk", ""])
def test_other_formats_lose_groups(tmp_path, suffix):
    with pytest.raises(InputError, match="generated meshes are .msh files, which keep all groups"):
        make_mesh("beam", tmp_path / f"a{suffix}")


@needs_gmsh
def test_a_place_that_cannot_be_written(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot write"):
        make_mesh("beam", tmp_path / "file" / "a.msh")
    (tmp_path / "a.msh").mkdir()
    with pytest.raises(InputError, match="cannot write"):
        make_mesh("beam", tmp_path / "a.msh")


@pytest.mark.parametrize("error", [ImportError("no module"), OSError("libGLU.so.1: cannot open shared object file")])
def test_gmsh_without_its_libraries(tmp_path, monkeypatch, capsys, error):
    class Finder:
        def find_spec(self, name, *_):
            if name == "gmsh":
                raise error

    monkeypatch.delitem(sys.modules, "gmsh", raising=False)
    monkeypatch.setattr(sys, "meta_path", [Finder(), *sys.meta_path])
    assert main(["mesh", "beam", "-o", str(tmp_path / "a.msh")]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"modalprep: gmsh cannot be imported: {error} (as root: apt-get install libgl1 ")
    assert said.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_advice_names_the_libraries_that_make_demo_installs(project):
    known = runpy.run_path(str(project / ".ci" / "system-libraries"))["GMSH"]
    assert generate.ADVICE.split("apt-get install ")[1].split() == list(known)


# --- command line ---------------------------------------------------------------------------------------------------


@needs_gmsh
def test_command(tmp_path, capsys):
    file = tmp_path / "sub" / "out.msh"
    assert main(["mesh", "plate", "--param", "length=2", "-p", "width=0.5", "-p", "size = 0.1", "-o", str(file)]) == 0
    said = capsys.readouterr().out
    assert "out.msh" in said
    assert "126 points: 4 vertex, 50 line, 100 quad" in said
    assert "plate: 100 quad" in said
    assert "root: 5 line" in said
    assert area(read_mesh(file), "plate") == pytest.approx(1.0, rel=1e-12)


@needs_gmsh
def test_command_as_json_in_the_current_folder(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["mesh", "truss_tower", "-p", "bays=2", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["file"] == "truss-tower.msh"
    assert answer["groups"]["legs"] == {"line": 8}
    assert read_mesh("truss-tower.msh").groups.keys() == answer["groups"].keys()


@needs_gmsh
def test_dashes_in_parameter_names(tmp_path):
    assert main(["mesh", "blade", "-p", "root-chord=0.5", "-o", str(tmp_path / "a.msh")]) == 0
    assert np.ptp(read_mesh(tmp_path / "a.msh").points[:, 1]) == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ([], "no shape given"),
        (["plat"], "did you mean 'plate'?"),
        (["plate", "-p", "length"], "--param 'length' is not NAME=VALUE, such as length=2"),
        (["plate", "-p", "=2"], "is not NAME=VALUE"),
        (["plate", "-p", "length=1", "-p", "length=2"], "--param length is given twice, as 1 and 2; keep one"),
        (["plate", "-p", "lenght=1"], "did you mean 'length'?"),
        (["plate", "-o", "a.bdf"], "generated meshes are .msh files"),
    ],
)
def test_wrong_command_lines(tmp_path, monkeypatch, capsys, arguments, sentence):
    monkeypatch.chdir(tmp_path)
    assert main(["mesh", *arguments]) == 2
    said = capsys.readouterr().err
    assert sentence in said
    assert said.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_list_shows_everything(capsys):
    assert main(["mesh", "--list"]) == 0
    said = capsys.readouterr().out
    for generator in GENERATORS.values():
        assert generator.name in said
        assert all(name in said for name in (*generator.groups, *generator.parameters))
    assert "0.5 m " in said
    assert "300.0 deg" in said
    assert main(["mesh", "--list", "--json"]) == 0
    shapes = json.loads(capsys.readouterr().out)
    assert set(shapes) == set(GENERATORS) == set(STRUCTURE)
    assert shapes["tube"]["parameters"][1]["default"] == 0.1


def test_every_parameter_says_what_it_is():
    for generator in GENERATORS.values():
        assert generator.meaning
        for parameter in generator.parameters.values():
            assert parameter.meaning, f"{generator.name} {parameter.name}"
            assert parameter.read(parameter.default) == parameter.default
            assert parameter.unit in ("m", "deg", "")
