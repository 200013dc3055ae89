"""Mesh quality: every flaw is made by hand and counted; sound meshes give no finding."""

import json

import numpy as np
import pytest

import modalprep as mp
from modalprep.cli import main
from modalprep.fe.mesh.cells import CELLS
from modalprep.fe.mesh.curved_gradients import curved_gradient
from modalprep.fe.mesh.mesh import Link, Mesh
from modalprep.fe.properties.points import Spring
from modalprep.fe.quality.quality import check_mesh
from modalprep.fe.quality.shape import measure

BRICK = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
PARTS = {  # of a hexahedron: corners of the cells that fill it
    "hexahedron": [range(8)],
    "wedge": [(0, 1, 2, 4, 5, 6), (0, 2, 3, 4, 6, 7)],
    "tetra": [(0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)],
}
VOLUMES = [(cell.shape, cell.count) for cell in CELLS.values() if cell.dimension == 3]


def plate(nx=4, ny=3):
    """Points and quads of unit squares, cell number i*ny + j, node number i*(ny+1) + j."""
    x, y = np.meshgrid(np.arange(nx + 1.0), np.arange(ny + 1.0), indexing="ij")
    number = np.arange(x.size).reshape(x.shape)
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1)
    return np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1), quads.reshape(-1, 4)


def block(kind="hexahedron", n=(3, 2, 2)):
    """Points and first-order cells of a block of unit cubes."""
    points = np.stack(np.meshgrid(*(np.arange(k + 1.0) for k in n), indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(points)).reshape([k + 1 for k in n])
    corners = [number[i : n[0] + i, j : n[1] + j, k : n[2] + k].ravel() for i, j, k in BRICK]
    bricks = np.stack(corners, axis=1)
    return points, np.concatenate([bricks[:, list(part)] for part in PARTS[kind]])


def second_order(points, cells, kind):
    """Return the mesh with a node in the middle of each edge."""
    ends = np.sort(cells[:, CELLS[kind].edges].reshape(-1, 2), axis=1)
    unique, place = np.unique(ends, axis=0, return_inverse=True)
    middle = len(points) + place.reshape(len(cells), -1)
    return np.vstack([points, points[unique].mean(axis=1)]), np.hstack([cells, middle])


def mesh(points, groups=None, links=(), **cells):
    return Mesh(points=np.array(points, dtype=float), cells={k: np.array(c) for k, c in cells.items()},
                groups=groups or {}, links=links)  # fmt: skip


def kinds(quality):
    return {f.kind: f.count for f in quality.findings}


def only(quality, kind, severity):
    """The finding, which must be the only one."""
    assert kinds(quality).keys() == {kind}, [f.message for f in quality.findings]
    (finding,) = quality.findings
    assert finding.severity == severity
    assert "{" not in finding.message
    assert "; " in finding.message
    return finding


def found(quality, kind, severity):
    (finding,) = [f for f in quality.findings if f.kind == kind]
    assert finding.severity == severity
    return finding


def single(kind, count):
    """The reference cell alone, its corners and mid-side nodes."""
    name = kind if count == CELLS[kind].count else f"{kind}{count}"
    return name, CELLS[name].node_coordinates(), np.arange(count)[None]


# ---- sound meshes


@pytest.mark.parametrize("kind", ["hexahedron", "wedge", "tetra"])
@pytest.mark.parametrize("order", [1, 2])
def test_sound_solids_give_no_finding(kind, order):
    points, cells = block(kind)
    if order == 2:
        points, cells = second_order(points, cells, kind)
    name = kind + ("" if order == 1 else str(cells.shape[1]))
    quality = check_mesh(mesh(points, **{name: cells}))
    assert kinds(quality) == ({"linear tetra": len(cells)} if name == "tetra" else {})
    assert quality.statistics[name].count == len(cells)


@pytest.mark.parametrize(("kind", "count"), VOLUMES)
def test_every_reference_volume_is_sound_and_its_mirror_inverted(kind, count):
    name, nodes, conn = single(kind, count)
    assert not check_mesh(mesh(nodes, **{name: conn})).errors
    quality = check_mesh(mesh(nodes * [1, 1, -1], **{name: conn}))
    finding = found(quality, "inverted", "error")
    assert finding.count == 1
    assert finding.worst < 0


def test_sound_shells_and_beams_give_no_finding():
    points, quads = plate()
    assert check_mesh(mesh(points, quad=quads)).findings == ()
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    assert check_mesh(mesh(points, triangle=triangles)).findings == ()
    for kind, cells in (("quad", quads), ("triangle", triangles)):
        more, cells = second_order(points, cells, kind)
        assert check_mesh(mesh(more, **{f"{kind}{cells.shape[1]}": cells})).findings == ()
    stiffener = np.array([[0, 4], [4, 8], [8, 12], [12, 16]])
    quality = check_mesh(mesh(points, quad=quads, line=stiffener))
    assert quality.findings == ()
    assert (quality.free_edges, quality.joints) == (14, 0)


def test_meshes_of_the_project_are_sound(project):
    for name in ("bracket", "beam"):
        assert check_mesh(mp.read_mesh(project / "meshes" / f"{name}.msh", "mm")).findings == ()


def test_statistics_of_a_rectangle_and_a_regular_tetrahedron():
    quality = check_mesh(mesh([[0, 0, 0], [3, 0, 0], [3, 1, 0], [0, 1, 0]], quad=[[0, 1, 2, 3]]))
    row = quality.statistics["quad"]
    assert (row.smallest, row.median, row.largest, row.aspect) == (2, 2, 2, 3)
    assert (row.small, row.large) == pytest.approx((90, 90))
    assert row.jacobian == pytest.approx(1)
    regular = [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]
    shape = measure("tetra", np.array([[0, 2, 1, 3]]), np.array(regular, dtype=float))
    assert abs(shape.jacobian[0]) == pytest.approx(1)
    assert shape.small[0] == pytest.approx(60)
    assert shape.size[0] == pytest.approx(8**0.5)


# ---- errors


@pytest.mark.parametrize("kind", ["hexahedron", "wedge", "tetra"])
def test_inverted_cells_among_sound_ones(kind):
    points, cells = block(kind)
    half = cells.shape[1] // 2
    swap = [1, 0, 2, 3] if kind == "tetra" else [*range(half, 2 * half), *range(half)]
    cells[[2, 5]] = cells[[2, 5]][:, swap]
    finding = found(check_mesh(mesh(points, **{kind: cells})), "inverted", "error")
    assert finding.count == 2
    assert finding.cells[kind].tolist() == [2, 5]
    assert finding.where == pytest.approx(points[cells[2]].mean(axis=0))


def test_one_bad_corner_inverts_a_hexahedron():
    points, cells = block(n=(1, 1, 1))
    points = np.array(points)
    points[cells[0, 6]] = [0.3, 0.3, 0.3]  # behind the plane of its neighbours: 1.0 needed on the diagonal
    assert found(check_mesh(mesh(points, hexahedron=cells)), "inverted", "error").count == 1
    points[cells[0, 6]] = [0.8, 0.8, 0.8]
    assert not check_mesh(mesh(points, hexahedron=cells)).errors


def test_curved_tetrahedron_is_inverted_only_when_its_mid_node_goes_too_far():
    name, nodes, conn = single("tetra", 10)
    nodes[4] += [0, 0, 0.2]  # of an edge of length 1: less than a quarter
    assert check_mesh(mesh(nodes, **{name: conn})).findings == ()
    nodes[4] += [0.3, 0, -0.2]  # along the edge beyond its quarter point: dx/dxi = 1 - 4*0.3 < 0 at the end
    quality = check_mesh(mesh(nodes, **{name: conn}))
    assert kinds(quality) == {"inverted": 1}


def test_gradients_of_curved_volumes_differentiate_a_linear_field():
    for kind, count in VOLUMES:
        gradient = curved_gradient(kind, count)
        if gradient is None:
            assert count == len(CELLS[kind].corners)
            continue
        nodes = CELLS[f"{kind}{count}"].node_coordinates()[: gradient.shape[2]]
        assert gradient @ nodes == pytest.approx(np.broadcast_to(np.eye(3), (len(gradient), 3, 3)))


@pytest.mark.parametrize(
    ("kind", "nodes"),
    [
        ("line", [[0, 0, 0], [0, 0, 0]]),
        ("triangle", [[0, 0, 0], [1, 1, 0], [2, 2, 0]]),
        ("quad", [[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]]),
        ("tetra", [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]),
        ("hexahedron", np.array(BRICK) * [1, 1, 0] + [[0.1 * k, 0, 0] for k in range(8)]),
    ],
)
def test_cells_without_extent_are_degenerate(kind, nodes):
    quality = check_mesh(mesh(nodes, **{kind: [range(len(nodes))]}))
    assert found(quality, "degenerate", "error").count == 1
    assert kinds(quality).keys() <= {"degenerate", "linear tetra"}


@pytest.mark.parametrize("kind", ["quad", "hexahedron"])
def test_node_used_twice_is_degenerate(kind):
    points, cells = plate() if kind == "quad" else block()
    cells[1, 1] = cells[1, 0]
    finding = found(check_mesh(mesh(points, **{kind: cells})), "degenerate", "error")
    assert finding.cells[kind].tolist() == [1]


def test_node_used_twice_by_opposite_corners_is_degenerate():
    assert only(check_mesh(mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], quad=[[0, 1, 0, 2]])), "degenerate", "error")


def test_springs_need_no_length_and_may_lie_side_by_side():
    points = [[0, 0, 0], [1, 0, 0], [1, 0, 0], [2, 0, 0]]
    cells = np.array([[0, 1], [1, 2], [1, 2], [2, 3]])
    groups = {"bar": {"line": np.array([0, 3])}, "hinge": {"line": np.array([1, 2])}}
    net = mesh(points, groups, line=cells)
    spring = Spring(translation=(1.0, 1.0, 1.0), rotation=(0.0, 0.0, 0.0))
    assert check_mesh(net, {"bar": None, "hinge": spring}).findings == ()
    assert check_mesh(net.with_(properties={"hinge": spring}), ["bar", "hinge"]).findings == ()
    assert kinds(check_mesh(net)) == {"degenerate": 2, "duplicate": 1}


@pytest.mark.parametrize(
    ("corners", "bad"),
    [
        ([(0, 0), (1, 0), (1, 1), (0, 1)], False),
        ([(0, 0), (1, 0), (0, 1), (1, 1)], True),  # even bow-tie, no area
        ([(0, 0), (2, 0), (0, 1), (1, 1)], True),  # uneven bow-tie
        ([(0, 0), (1, 0), (0.3, 0.3), (0, 1)], True),  # re-entrant: inside the line from (1, 0) to (0, 1)
        ([(0, 0), (1, 0), (0.6, 0.6), (0, 1)], False),
    ],
)
@pytest.mark.parametrize("turn", range(4))
def test_crossed_and_re_entrant_quads(corners, bad, turn):
    turned = np.roll(np.column_stack([corners, np.zeros(4)]), turn, axis=0)
    quality = check_mesh(mesh(turned, quad=[[0, 1, 2, 3]]))
    assert kinds(quality) == ({"bow-tie": 1} if bad else {})
    if bad:
        assert only(quality, "bow-tie", "error").cells["quad"].tolist() == [0]


def test_duplicate_elements_in_any_order_of_nodes():
    points, quads = plate()
    doubled = np.concatenate([quads, quads[[3]], np.roll(quads[[3]], 1, axis=1), quads[[7]][:, ::-1]])
    finding = found(check_mesh(mesh(points, quad=doubled)), "duplicate", "error")
    assert finding.count == 3
    assert finding.cells["quad"].tolist() == [12, 13, 14]


def test_overlaid_elements_of_two_properties_are_only_suspicious():
    points = [[0, 0, 0], [1, 0, 0], [2, 0, 0]]
    groups = {"beams": {"line": np.array([0, 1, 3])}, "bars": {"line": np.array([2])}}
    net = mesh(points, groups, line=[[0, 1], [1, 2], [1, 0], [2, 1]])
    quality = check_mesh(net, ["beams", "bars"])
    assert found(quality, "overlay", "warning").cells["line"].tolist() == [2]
    assert found(quality, "duplicate", "error").cells["line"].tolist() == [3]
    assert kinds(check_mesh(net)) == {"duplicate": 2}


def test_disconnected_parts_and_what_joins_them():
    points, quads = plate()
    apart = np.vstack([points, plate(1, 1)[0] + [10, 0, 0]])
    cells = np.concatenate([quads, plate(1, 1)[1] + len(points)])
    base = {"near": {"quad": np.array([0])}, "far": {"quad": np.array([12])}}
    base["both"] = {"quad": np.array([11, 12])}
    net = mesh(apart, base, quad=cells)
    finding = found(check_mesh(net), "disconnected", "error")
    assert (finding.count, finding.cells["quad"].tolist()) == (2, [12])
    assert "2 disconnected parts, the smallest has 4 nodes" in finding.message
    tie = Link(kind="rbe2", node=0, nodes=np.array([len(points), len(points) + 1]))
    assert check_mesh(net.with_(links=(tie,))).findings == ()
    assert check_mesh(net, joined=["both"]).findings == ()
    assert "disconnected" in kinds(check_mesh(net, joined=["near"]))


def test_coordinates_that_are_not_numbers():
    points, quads = plate()
    points[5, 2], points[6, 0] = np.nan, np.inf
    finding = found(check_mesh(mesh(points, quad=quads)), "not a number", "error")
    assert finding.nodes.tolist() == [5, 6]
    assert not check_mesh(mesh(np.full((4, 3), np.nan), quad=[[0, 1, 2, 3]])).warnings


# ---- warnings


@pytest.mark.parametrize(("side", "bad"), [(9.9, False), (10.1, True)])
def test_aspect_ratio(side, bad):
    points, quads = plate()
    quality = check_mesh(mesh(points * [side, 1, 1], quad=quads))
    assert kinds(quality) == ({"aspect ratio": 12} if bad else {})
    if bad:
        assert only(quality, "aspect ratio", "warning").worst == pytest.approx(10.1)


@pytest.mark.parametrize(("height", "bad"), [(0.28, False), (0.32, True)])
def test_warpage_is_a_quarter_of_the_lifted_corner_over_the_diagonal(height, bad):
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, height], [0, 1, 0]])
    quality = check_mesh(mesh(corners, quad=[[0, 1, 2, 3]]))
    normal = np.cross(corners[2] - corners[0], corners[3] - corners[1])
    normal /= np.linalg.norm(normal)
    middle = corners.mean(axis=0)
    diagonals = [np.linalg.norm(corners[2] - corners[0]), np.linalg.norm(corners[3] - corners[1])]
    expected = abs((corners[0] - middle) @ normal) / np.mean(diagonals)
    assert quality.statistics["quad"].warpage == pytest.approx(expected)
    assert kinds(quality) == ({"warped": 1} if bad else {})


def test_small_and_large_angles_of_triangles_and_quads():
    def fan(degrees):
        end = np.radians(degrees)
        return [[0, 0, 0], [1, 0, 0], [np.cos(end), np.sin(end), 0]]

    assert kinds(check_mesh(mesh(fan(5.8), triangle=[[0, 1, 2]]))) == {}  # opposite edge 0.101: aspect below 10
    assert kinds(check_mesh(mesh(fan(4.5), triangle=[[0, 1, 2]]))) == {"small angle": 1, "aspect ratio": 1}
    assert kinds(check_mesh(mesh(fan(169), triangle=[[0, 1, 2]]))) == {}
    assert found(check_mesh(mesh(fan(172), triangle=[[0, 1, 2]])), "large angle", "warning").worst == pytest.approx(172)

    def lean(degrees):
        x, y = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        return [[0, 0, 0], [1, 0, 0], [1 + x, y, 0], [x, y, 0]]

    assert kinds(check_mesh(mesh(lean(21), quad=[[0, 1, 2, 3]]))) == {}
    assert kinds(check_mesh(mesh(lean(19), quad=[[0, 1, 2, 3]]))) == {"large angle": 1}
    assert kinds(check_mesh(mesh(lean(9), quad=[[0, 1, 2, 3]]))) == {"small angle": 1, "large angle": 1}


def test_flat_tetrahedron_whose_faces_are_good():
    sliver = np.array([[0, 0, 0], [1, 1, 0], [0, 1, 0.02], [1, 0, 0.02]])
    points, cells = second_order(sliver, np.array([[0, 1, 2, 3]]), "tetra")
    finding = only(check_mesh(mesh(points, tetra10=cells)), "flat", "warning")
    assert 0 < finding.worst < finding.limit


def test_mid_side_nodes_off_their_edge():
    name, nodes, conn = single("hexahedron", 20)
    quality = check_mesh(mesh(nodes + np.outer(np.arange(20) == 8, [0, -0.2, 0]), **{name: conn}))
    assert quality.findings == ()
    quality = check_mesh(mesh(nodes + np.outer(np.arange(20) == 8, [0, -0.3, 0]), **{name: conn}))
    assert found(quality, "middle node", "warning").worst == pytest.approx(0.3)
    bent = check_mesh(mesh([[0, 0, 0], [1, 0, 0], [0.5, 0.3, 0]], line3=[[0, 1, 2]]))
    assert only(bent, "middle node", "warning").cells["line3"].tolist() == [0]


def test_first_order_tetrahedra():
    points, cells = block("tetra")
    finding = only(check_mesh(mesh(points, tetra=cells)), "linear tetra", "warning")
    assert finding.count == 72
    assert "save the mesh with second-order elements" in finding.message


def cut(points, quads, along):
    """Give the cells on the right of the nodes `along` nodes of their own."""
    points, quads = np.array(points), np.array(quads)
    for node in along:
        right = points[quads].mean(axis=1)[:, 0] > points[node, 0]
        quads[right] = np.where(quads[right] == node, len(points), quads[right])
        points = np.vstack([points, points[node]])
    return points, quads


def test_slit_between_shells():
    points, quads = cut(*plate(), along=[8, 9, 10])  # x = 2, y = 0 to 2; the node at y = 3 is merged
    quality = check_mesh(mesh(points, quad=quads))
    assert kinds(quality) == {"coincident": 6, "crack": 3}
    crack = found(quality, "crack", "warning")
    assert sorted(crack.cells["quad"].tolist()) == [3, 4, 5, 6, 7, 8]
    assert set(crack.nodes.tolist()) <= {8, 9, 10, 11, 20, 21, 22}
    assert crack.where == pytest.approx([2, 0.5, 0])
    assert quality.free_edges == 14 + 6


def test_slit_between_second_order_shells_has_no_hanging_nodes():
    points, quads = cut(*plate(), along=[8, 9, 10])
    points, quads = second_order(points, quads, "quad")
    assert kinds(check_mesh(mesh(points, quad8=quads))) == {"coincident": 6 + 6, "crack": 3}


def test_nodes_tied_by_an_element_or_a_link_are_no_crack():
    points, quads = cut(*plate(), along=[8, 9, 10])
    ties = tuple(Link(kind="rbe2", node=a, nodes=np.array([b])) for a, b in ((8, 20), (9, 21), (10, 22)))
    assert check_mesh(mesh(points, quad=quads, links=ties)).findings == ()
    hinge = np.array([[8, 20], [9, 21], [10, 22]])
    groups = {"plate": {"quad": np.arange(12)}, "hinge": {"line": np.arange(3)}}
    net = mesh(points, groups, quad=quads, line=hinge)
    assert check_mesh(net, {"plate": None, "hinge": Spring(translation=(1.0,) * 3, rotation=(1.0,) * 3)}).findings == ()


def test_coincidence_is_relative_to_the_elements():
    points, quads = cut(*plate(), along=[8])
    for gap, seen in ((1e-7, True), (1e-5, False)):
        moved = np.array(points)
        moved[20, 1] -= gap
        for scale in (1e-3, 1e3):
            assert ("coincident" in kinds(check_mesh(mesh(scale * moved, quad=quads)))) == seen


def test_unmerged_solids():
    points, cells = block(n=(2, 1, 1))
    loose, again = np.unique(cells[1], return_inverse=True)
    cells = np.stack([cells[0], len(points) + again])
    quality = check_mesh(mesh(np.vstack([points, points[loose]]), hexahedron=cells))
    assert kinds(quality) == {"disconnected": 2, "unconnected": 4, "coincident": 8}


def test_unconnected_nodes_but_not_those_of_points_and_links():
    points, quads = plate()
    more = np.vstack([points, [[9, 0, 0], [9, 1, 0], [9, 2, 0], [9, 3, 0]]])
    link = Link(kind="rbe3", node=21, nodes=np.array([0, 1]))
    finding = only(check_mesh(mesh(more, quad=quads, vertex=[[20]], links=(link,))), "unconnected", "warning")
    assert finding.nodes.tolist() == [22, 23]
    assert finding.where.tolist() == [9, 2, 0]


def test_opposite_normals():
    points, quads = plate()
    quads[4] = quads[4][::-1]  # inside: four neighbours
    finding = only(check_mesh(mesh(points, quad=quads)), "opposite normals", "warning")
    assert finding.count == 4
    assert set(map(tuple, np.sort(finding.edges, axis=1).tolist())) == {(5, 6), (5, 9), (6, 10), (9, 10)}


def test_three_shells_on_one_edge_are_a_joint_and_no_finding():
    points, quads = plate()
    web = np.vstack([points, [[2, y, 1] for y in range(4)]])
    more = np.array([[8 + j, 9 + j, 21 + j, 20 + j] for j in range(3)])
    quality = check_mesh(mesh(web, quad=np.concatenate([quads, more])))
    assert quality.findings == ()
    assert quality.joints == 3


@pytest.mark.parametrize(("lift", "seen"), [(0.0, True), (5e-4, True), (0.01, False)])
def test_hanging_node_beside_a_coarser_shell(lift, seen):
    points = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0], [2, 1, 0], [1 + lift, 0.5, 0], [2, 0.5, 0]]
    quality = check_mesh(mesh(points, quad=[[0, 1, 2, 3], [1, 4, 7, 6], [6, 7, 5, 2]]))
    if seen:
        assert only(quality, "hanging", "warning").nodes.tolist() == [6]
    assert bool(quality.findings) == seen
    tie = Link(kind="rbe3", node=6, nodes=np.array([1, 2]))
    tied = mesh(points, quad=[[0, 1, 2, 3], [1, 4, 7, 6], [6, 7, 5, 2]], links=(tie,))
    assert check_mesh(tied).findings == ()


def test_beam_with_a_node_within_the_edge_of_a_shell_hangs():
    points = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0, 0]]
    finding = only(check_mesh(mesh(points, quad=[[0, 1, 2, 3]], line=[[0, 4], [4, 1]])), "hanging", "warning")
    assert finding.nodes.tolist() == [4]


def test_first_order_shell_beside_second_order():
    points, quads = plate(2, 1)
    more, eight = second_order(points, quads[:1], "quad")
    quality = check_mesh(mesh(more, quad8=eight, quad=quads[1:]))
    assert found(quality, "mixed order", "warning").edges.tolist() in ([[2, 3]], [[3, 2]])


# ---- what is looked at


def test_only_structural_groups_are_checked():
    points, quads = plate()
    quads[0] = quads[0][[0, 1, 3, 2]]
    groups = {"bad": {"quad": np.array([0])}, "good": {"quad": np.arange(1, 12)}}
    net = mesh(points, groups, quad=quads)
    assert check_mesh(net, ["good"]).findings == ()
    assert kinds(check_mesh(net, ["good", "bad"])) == {"bow-tie": 1}
    with pytest.raises(mp.InputError, match="no group 'goood'"):
        check_mesh(net, ["goood"])


def test_surface_cells_that_mark_a_solid_are_no_shells():
    points, bricks = block()
    bottom = bricks[::2, :4].copy()
    bottom[0] = bottom[0][::-1]
    net = mesh(points, {"skin": {"quad": np.arange(len(bottom))}}, hexahedron=bricks, quad=bottom)
    assert check_mesh(net).findings == ()
    assert "opposite normals" in kinds(check_mesh(net, ["skin"]))


def test_cells_of_other_types_and_no_cells_are_passed_over():
    assert check_mesh(mesh(np.eye(3), vertex=[[0], [1], [2]])).findings == ()
    assert check_mesh(mesh(np.eye(3), polygon=[[0, 1, 2]])).findings == ()
    assert check_mesh(mesh(np.eye(3), quad=np.zeros((0, 4), dtype=int), vertex=[[0], [1], [2]])).statistics == {}


def test_errors_come_first():
    points, quads = plate()
    quads[0] = quads[0][[0, 1, 3, 2]]
    quality = check_mesh(mesh(np.vstack([points, [[7, 7, 7]]]), quad=quads))
    assert [f.severity for f in quality.findings] == ["error", "warning"]
    assert "crossed or re-entrant" in quality.errors[0].message


def test_hundred_thousand_cells_are_checked():
    points, quads = plate(320, 320)
    quality = check_mesh(mesh(points, quad=quads))
    assert not quality.findings


# ---- the command


@pytest.fixture
def bad_file(tmp_path):
    import meshio

    points, quads = plate()
    quads[0] = quads[0][[0, 1, 3, 2]]
    sets = {"plate": [np.arange(12)], "rest": [np.arange(1, 12)]}
    file = tmp_path / "bad.vtk"
    meshio.Mesh(1000 * points, [("quad", quads)], cell_sets=sets).write(file)
    return file


def test_command_exits_1_on_errors_and_2_on_unreadable_files(bad_file, project, capsys):
    assert main(["quality", str(bad_file), "--length-unit", "mm"]) == 1
    out = capsys.readouterr().out
    assert "1 quad cell is crossed or re-entrant" in out
    assert "near (0.5, 0.5, 0) m" in out
    assert "1 error, no warnings." in out.lower()
    assert main(["quality", str(project / "meshes" / "beam.msh")]) == 0
    assert "No errors, no warnings." in capsys.readouterr().out
    assert main(["quality", str(bad_file.with_name("none.msh"))]) == 2
    assert main(["quality", str(bad_file), "--length-unit", "parsec"]) == 2


def test_command_as_json(bad_file, capsys):
    assert main(["quality", str(bad_file), "--json"]) == 1
    told = json.loads(capsys.readouterr().out)
    assert (told["errors"], told["warnings"], told["statistics"]["quad"]["count"]) == (1, 0, 12)
    (finding,) = told["findings"]
    assert (finding["kind"], finding["cells"], finding["where_m"]) == ("bow-tie", {"quad": [0]}, [500, 500, 0])


def test_command_takes_unit_groups_and_interfaces_from_a_pipeline(project, capsys):
    assert main(["quality", str(project / "pipelines" / "bracket.toml"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert list(told["statistics"]) == ["tetra10"]
    assert told["statistics"]["tetra10"]["largest_m"] < 0.01
