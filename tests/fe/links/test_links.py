"""Rigid and averaging links: kinematics, statics and prestress against closed forms."""

import numpy as np
import pytest
from compare import assert_close
from scipy.optimize import brentq
from scipy.sparse.linalg import spsolve
from scipy.spatial.transform import Rotation

import modalprep as mp
from modalprep.examples import beam_mesh, spinup_section
from modalprep.fe.links.constraints import constrain
from modalprep.fe.links.interface import interface_position
from modalprep.fe.links.multipoint import PlacedLink
from modalprep.fe.mesh.mesh import Link, Mesh

NODE = {"root": mp.Interface(group="root", kind="node")}


def ring(n=8, radius=0.5, height=0.3):
    angle = 2 * np.pi * np.arange(n) / n
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(n, height)], axis=1)


def placed(kind, nodes, *, keeps_frame=False, weights=None, components=None):
    """A frame at the origin with DOFs 0..5 and nodes with three DOFs each."""
    k = len(nodes)
    dofs = np.full((k, 6), -1)
    dofs[:, :3] = 6 + np.arange(3 * k).reshape(k, 3)
    every = np.ones(6, dtype=bool) if components is None else components
    w = np.ones(k) if weights is None else weights
    return PlacedLink(kind, kind, np.arange(6), dofs, nodes, every, w, keeps_frame)


def rigid(nodes, motion):
    return (motion[:3] + np.cross(motion[3:], nodes)).ravel()


@pytest.mark.parametrize("keeps_frame", [False, True])
def test_rbe3_follows_a_rigid_motion_of_its_nodes(keeps_frame):
    """Whatever the weights, the mean of a rigid motion is that motion."""
    nodes = ring() + np.array([0.2, -0.1, 0.0])
    weights = np.random.default_rng(0).uniform(0.5, 2.0, len(nodes))
    motion = np.array([1.0, -2.0, 0.5, 0.3, -0.2, 0.7])
    u = np.concatenate([motion, rigid(nodes, motion)])
    found = constrain([placed("rbe3", nodes, weights=weights, keeps_frame=keeps_frame)], len(u))
    free = found.free
    np.testing.assert_allclose(found.C @ u[free], u, atol=1e-12)
    assert len(free) == len(u) - 6
    assert (0 in free) == keeps_frame


def test_rbe3_spreads_a_force_as_nastran_does():
    """A force over the centroid splits by the weights; a moment about the axis gives forces ~ w r."""
    nodes = ring(height=0.0)
    weights = np.linspace(1.0, 2.0, len(nodes))
    nodes = nodes - weights @ nodes / weights.sum()  # frame at the weighted centroid
    C = constrain([placed("rbe3", nodes, weights=weights)], 6 + nodes.size).C
    load = np.zeros(6 + nodes.size)
    load[2] = 1.0
    spread = (C.T @ load).reshape(-1, 3)
    np.testing.assert_allclose(spread[:, 2], weights / weights.sum(), atol=1e-12)
    load[:] = 0
    load[5] = 1.0
    moment = (C.T @ load).reshape(-1, 3)
    expected = np.cross([0, 0, 1.0], nodes) * weights[:, None]
    np.testing.assert_allclose(moment, expected / (weights @ np.sum(nodes[:, :2] ** 2, axis=1)), atol=1e-12)


def test_link_that_hangs_on_a_link():
    far = PlacedLink("rbe2", "b", np.arange(6, 12), np.arange(12, 18)[None], np.array([[0, 1.0, 0]]), np.ones(6, bool),
                     np.ones(1), False)  # fmt: skip
    near = PlacedLink("rbe2", "a", np.arange(6), np.arange(6, 12)[None], np.array([[1.0, 0, 0]]), np.ones(6, bool),
                      np.ones(1), False)  # fmt: skip
    found = constrain([far, near], 18)
    turn = np.array([0, 0, 0, 0, 0, 1.0])
    assert list(found.free) == [0, 1, 2, 3, 4, 5]
    np.testing.assert_allclose((found.C @ turn)[12:15], [-1.0, 1.0, 0.0], atol=1e-15)  # z x (1, 1, 0)


def test_loop_and_double_drive_are_refused():
    one = np.ones(6, dtype=bool)
    a = PlacedLink("rbe2", "a", np.arange(6), np.arange(6, 12)[None], np.zeros((1, 3)), one, np.ones(1), False)
    b = PlacedLink("rbe2", "b", np.arange(6, 12), np.arange(6)[None], np.zeros((1, 3)), one, np.ones(1), False)
    with pytest.raises(mp.InputError, match="drive each other in a loop"):
        constrain([a, b], 12)
    with pytest.raises(mp.InputError, match="a and c drive the same node"):
        constrain([a, PlacedLink("rbe2", "c", np.arange(12, 18), *vars_of(a))], 18)


def vars_of(link):
    return link.dofs, link.arm, link.components, link.weights, link.keeps_frame


def test_rbe3_on_a_line_cannot_carry_rotation():
    with pytest.raises(mp.InputError, match="lie on one line"):
        placed("rbe3", np.array([[0, 0, 0.0], [1, 0, 0], [2, 0, 0]])).rows  # noqa: B018


def test_the_nodes_of_an_rbe3_have_equal_weights_by_default():
    assert Link(kind="rbe3", node=0, nodes=np.array([1, 2, 3])).weights.tolist() == [1.0, 1.0, 1.0]
    assert len(Link(kind="rbe2", node=0, nodes=np.array([1, 2, 3])).weights) == 0


def test_mass_on_an_rbe3_adds_its_inertia():
    """Two cantilevers side by side carry a mass between their tips by an rbe3: rigid mass matrix of the whole."""
    line = beam_mesh(4)
    points = np.concatenate([line.points + np.array(shift) for shift in ((0, 0, 0), (0, 1.0, 0), (0, 0, 1.0))])
    cells = np.concatenate([line.cells["line"] + 5 * k for k in range(3)])
    vertices = np.array([[0], [5], [10], [4], [9], [14]])
    mesh = Mesh(points=points, cells={"line": cells, "vertex": vertices},
                groups={"beam": {"line": np.arange(12)}, "root": {"vertex": np.arange(3)},
                        "tips": {"vertex": np.arange(3, 6)}})  # fmt: skip
    tank = mp.PointMass(mass=7.0, inertia=(1.0, 2.0, 2.5, 0.1, 0.0, -0.2), offset=(0.1, 0.0, 0.2))
    held, sections = {"root": mp.Interface(group="root")}, {"beam": spinup_section(), "tank": tank}
    model = mp.assemble(mesh, sections, held, connections={"tank": mp.Connection(group="tips")})
    assert all(check.passed for check in mp.body.check_model(model))
    assert model.rigid.m == pytest.approx(3 * 12.0 + 7.0)
    at = points[vertices[3:, 0]].mean(axis=0) + tank.offset - model.origin
    alone = mp.assemble(mesh, {"beam": spinup_section()}, {"root": mp.Interface(group="root")})
    np.testing.assert_allclose(model.rigid.s0 - alone.rigid.s0, 7.0 * at, atol=1e-12)
    xx, yy, zz, xy, xz, yz = tank.inertia
    J = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) + 7.0 * (at @ at * np.eye(3) - np.outer(at, at))
    R = model.rigid_body()
    full = (R.T @ model.M @ R)[3:, 3:] - (alone.rigid_body().T @ alone.M @ alone.rigid_body())[3:, 3:]
    np.testing.assert_allclose(full, J, rtol=1e-10)


@pytest.mark.parametrize("kind", ["rbe2", "rbe3"])
def test_buckling_load_beyond_a_rigid_arm(kind):
    """Clamped column of length L, load at the end of a rigid extension a: ``k a tan(k L) = 1``, ``P = EI k^2``.

    With ``w'' + k^2 w = k^2 (w(L) + a w'(L))``; the limit a = 0 is Euler's ``k L = pi / 2``.
    """
    L, a = 10.0, 3.0
    k = brentq(lambda k: k * a * np.tan(k * L) - 1, 1e-6, np.pi / (2 * L) - 1e-9)
    mesh = beam_mesh(16, L)
    mesh = mesh.with_(
        points=np.concatenate([mesh.points, [[L + a, 0, 0]]]),
        cells={**mesh.cells, "vertex": np.array([[0], [16], [17]])},
        groups={**mesh.groups, "end": {"vertex": np.array([2])}},
        links=(Link(kind=kind, node=17, nodes=np.array([16]), weights=np.ones(1)),),
    )
    if kind == "rbe3":  # an averaging link needs three nodes: a rigid cross at the tip carries them
        cross = np.array([[L, 0.1, 0], [L, -0.1, 0.1], [L, 0, -0.1]])
        mesh = mesh.with_(points=np.concatenate([mesh.points, cross]), links=(
            Link(kind="rbe2", node=16, nodes=np.array([18, 19, 20])),
            Link(kind="rbe3", node=17, nodes=np.array([18, 19, 20]), weights=np.ones(3))),
            cells={**mesh.cells, "line": np.concatenate([mesh.cells["line"], [[18, 19], [19, 20]]])},
            groups={**mesh.groups, "cross": {"line": np.array([16, 17])}})  # fmt: skip
    sections = {"beam": spinup_section(theory="euler-bernoulli")}
    if kind == "rbe3":
        sections["cross"] = spinup_section(theory="euler-bernoulli", up=(1.0, 0.0, 0.0))
    model = mp.assemble(mesh, sections, NODE)
    load = np.zeros(model.n_dof)
    load[model.dof[17, 0]] = -1.0
    assert mp.reduction.buckling(model, load).value[0] == pytest.approx(1.4e4 * k**2, rel=1e-3)  # 16 elements: 1e-5


def test_interface_rbe3_leaves_its_nodes_soft():
    """A frame over the tips of three bars of different stiffness: statics of springs in parallel under weights."""
    line = beam_mesh(1, 2.0)
    points = np.concatenate([line.points + np.array([0, y, z]) for y, z in ((0, 0), (1, 0), (0, 1))])
    mesh = Mesh(points=points, cells={"line": np.array([[0, 1], [2, 3], [4, 5]]), "vertex": np.arange(6)[:, None]},
                groups={"a": {"line": np.array([0])}, "b": {"line": np.array([1, 2])},
                        "root": {"vertex": np.array([0, 2, 4])}, "tips": {"vertex": np.array([1, 3, 5])}})  # fmt: skip
    stiff, soft = spinup_section(A=4e-4), spinup_section(A=1e-4)
    tips = mp.Interface(group="tips", kind="rbe3", boundary="free")
    model = mp.assemble(mesh, {"a": stiff, "b": soft}, {"root": mp.Interface(group="root"), "tips": tips})
    load = mp.reduction.interface_load(model, "tips", force=(3.0, 0, 0))
    held = model.C.T @ model.K @ model.C
    free = np.setdiff1d(np.arange(held.shape[0]), np.searchsorted(model.free, model.interfaces[0].dofs))
    x = np.zeros(held.shape[0])
    x[free] = spsolve(held[free][:, free].tocsc(), (model.C.T @ load)[free])
    u = (model.C @ x)[model.dof[[1, 3, 5], 0]]
    k = 7e10 * np.array([4e-4, 1e-4, 1e-4]) / 2.0
    np.testing.assert_allclose(u, 1.0 / k, rtol=1e-9)  # each bar carries a third, and stretches on its own
    np.testing.assert_allclose((model.C @ x)[model.interfaces[1].dofs[0]], np.mean(1.0 / k), rtol=1e-9)


def test_any_orientation():
    """The constraint matrix of a turned model is the turned one: rigid motions stay free of strain."""
    R = Rotation.random(random_state=1).as_matrix()
    nodes = ring() @ R.T
    motion = np.array([0.1, 0.2, 0.3, -1.0, 0.5, 2.0])
    u = np.concatenate([motion, rigid(nodes, motion)])
    found = constrain([placed("rbe3", nodes, keeps_frame=True)], len(u))
    C, free = found.C, found.free
    np.testing.assert_allclose(C @ u[free], u, atol=1e-12)


@pytest.mark.parametrize("kind", ["quad", "quad8"])
def test_frame_sits_in_the_centroid_of_its_faces(kind):
    """A trapezoid of parallel sides a = 2, b = 1 and height 1: (a^2 + a b + b^2) / 3 (a + b), (a + 2 b) / 3 (a + b)."""
    corners = np.array([[0, 0, 0], [2.0, 0, 0], [1.0, 1.0, 0], [0, 1.0, 0]])
    points = np.vstack([corners, (corners + np.roll(corners, -1, axis=0)) / 2])[: 4 if kind == "quad" else 8]
    cell = np.arange(len(points))[None]
    mesh = Mesh(points=points, cells={kind: cell}, groups={"face": {kind: np.array([0])}})
    place = interface_position(mesh, "face", mp.Interface(group="face"), cell[0])
    np.testing.assert_allclose(place, [7 / 9, 4 / 9, 0], rtol=1e-14)


@pytest.fixture(scope="module")
def bracket(project):
    """The README's bracket, whose two holes of 4.5 mm are along z from -5 mm to 5 mm."""
    return mp.read_mesh(project / "meshes" / "bracket.msh", "mm")


def place_of(mesh, **given):
    used = np.unique(mesh.cells["tetra10"]) if "tetra10" in mesh.cells else np.arange(len(mesh.points))
    spec = mp.Interface(**given)
    return interface_position(mesh, "x", spec, spec.nodes(mesh, used))


@pytest.mark.parametrize("groups", [True, False])
def test_frame_of_a_cylinder_is_on_its_axis(bracket, groups):
    """The mean of the nodes of an irregular mesh is 0.3 mm beside it; along it the surface has its middle at 0."""
    cells = bracket.cells if groups else {"tetra10": bracket.cells["tetra10"]}
    mesh = bracket.with_(cells=cells, groups=bracket.groups if groups else {})
    place = place_of(mesh, cylinder=((0.0, 0.0, 1.0), (0.0, 0.0, 2.0), 0.0045))
    np.testing.assert_allclose(place, 0, atol=1e-5 * 0.0045)  # the flat triangles of the ends differ: 2e-6
    assert np.all(place[:2] == 0)


def test_frame_of_a_cylinder_without_faces_is_between_its_ends(bracket):
    """Matrices of other programs bring nodes only."""
    cloud = bracket.with_(cells={}, groups={})
    place = place_of(cloud, cylinder=((0.0, 0.0, 1.0), (0.0, 0.0, -2.0), 0.0045))
    np.testing.assert_allclose(place, 0, atol=1e-12)


def test_caps_and_inner_faces_of_a_pin_do_not_count():
    """A prism with one cap divided into more triangles: its middle is that of the mantle, at half the height."""
    angle = 2 * np.pi * np.arange(6) / 6
    rim = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points = np.vstack([np.column_stack([rim, np.full(6, z)]) for z in (0.0, 4.0)])
    wedges = np.array([[0, k, k + 1, 6, 6 + k, 7 + k] for k in range(1, 5)])
    lid = np.array([[6, 6 + k, 7 + k] for k in range(1, 5)])
    mesh = Mesh(points=points, cells={"wedge": wedges, "triangle": lid}, groups={})
    np.testing.assert_allclose(place_of(mesh, cylinder=((0, 0, 0), (0, 0, 1), 1.0)), [0, 0, 2], atol=1e-12)


def test_body_of_a_cylinder_has_the_inertia_of_the_group(bracket):
    """First moment and inertia about the axis of the hole; they were 3e-3 and 8e-3 off."""
    section = {"body": mp.Solid(material=mp.Material(E=70e9, nu=0.33, rho=2700.0))}
    ways = {"group": "bolt_a", "position": (0.0, 0.0, 0.0)}, {"cylinder": ((0, 0, 0), (0, 0, 1), 0.0045)}
    group, cylinder = (mp.assemble(bracket, section, {"bolt": mp.Interface(**way)}).rigid for way in ways)
    assert_close(cylinder.s0, group.s0, 1e-5)  # 2e-6 of the radius along the axis
    assert_close(cylinder.E0, group.E0, 1e-5)


def branched(*links, **tip):
    """A cantilever whose tip (node 8) carries masses on nodes 9 to 12 by links; frames at the root and the tip."""
    mesh = beam_mesh(8)
    beside = mesh.points[-1] + np.array([[1.0, 0, 0], [1, 0.5, 0], [0, 0, 1], [-0.5, 1, 1]])
    vertices = np.array([[0], *([k] for k in range(9, 13))])
    mesh = mesh.with_(
        points=np.concatenate([mesh.points, beside]), cells={**mesh.cells, "vertex": vertices}, links=links,
        groups={"beam": mesh.groups["beam"], "root": {"vertex": np.array([0])}, "ends": {"vertex": np.arange(1, 5)}},
    )  # fmt: skip
    sections = {"beam": spinup_section(), "ends": mp.PointMass(mass=0.3)}
    return mp.assemble(mesh, sections, {"root": NODE["root"], "tip": mp.Interface(**({"kind": "node"} | tip))})


def same_bodies(a, b):
    """Compare the bodies of two models whose frames are alike."""
    reductions = [mp.craig_bampton(model, modes=6, truncation=("inertia",)) for model in (a, b)]
    bodies = [mp.flexible_body(m, r, name="body") for m, r in zip((a, b), reductions, strict=True)]
    for name in ("K", "Kg_A", "Kg_W"):
        one, two = (getattr(body, name) for body in bodies)
        np.testing.assert_allclose(np.abs(one), np.abs(two), atol=1e-7 * np.abs(one).max())  # modes have any sign


ALL = np.ones(6, dtype=bool)
SOME = np.array([1, 1, 1, 0, 0, 0], dtype=bool)
REROOTED = {
    "a node that a link moves": (
        [Link(kind="rbe2", node=8, nodes=np.array([9, 10, 11, 12]))],
        [Link(kind="rbe2", node=11, nodes=np.array([8, 9, 10, 12]))],
    ),
    "the end of a chain of links": (
        [Link(kind="rbe2", node=8, nodes=np.array([9, 10])), Link(kind="rbe2", node=10, nodes=np.array([11, 12]))],
        [Link(kind="rbe2", node=11, nodes=np.array([8, 9, 10, 12]))],
    ),
    "others follow in part": (
        [Link(kind="rbe2", node=8, nodes=np.array([9, 10, 11, 12]), components=np.array([SOME, ALL, SOME, ALL]))],
        [Link(kind="rbe2", node=10, nodes=np.array([8, 9, 11, 12]), components=np.array([ALL, SOME, SOME, ALL]))],
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", REROOTED)
def test_an_interface_on_a_node_that_a_rigid_link_moves(name):
    """The link written from that node on is the same rigid body; it was refused."""
    given, written = REROOTED[name]
    label = written[0].node + 1
    same_bodies(branched(*given, node=label), branched(*written, node=label))


def test_an_interface_on_the_reference_node_of_an_rbe3():
    """It is the frame of an interface of kind rbe3 over the same nodes."""
    line = beam_mesh(4)
    points = np.concatenate([line.points + np.array(shift) for shift in ((0, 0, 0), (0, 1.0, 0), (0, 0, 1.0))])
    cells = np.concatenate([line.cells["line"] + 5 * k for k in range(3)])
    mesh = Mesh(
        points=points, cells={"line": cells, "vertex": np.array([[0], [5], [10], [4], [9], [14]])},
        groups={"beam": {"line": np.arange(12)}, "root": {"vertex": np.arange(3)}, "tips": {"vertex": np.arange(3, 6)}},
    )  # fmt: skip
    place = np.array([10.0, 0.2, 0.3])
    mean = Link(kind="rbe3", node=15, nodes=np.array([4, 9, 14]))
    with_node = mesh.with_(points=np.vstack([points, place]), links=(mean,))
    root, tip = mp.Interface(group="root"), mp.Interface(group="tips", kind="rbe3", position=tuple(place))
    models = (
        mp.assemble(m, {"beam": spinup_section()}, {"root": root, "tip": end})
        for m, end in ((with_node, mp.Interface(node=16, kind="node")), (mesh, tip))
    )
    same_bodies(*models)


def test_an_interface_whose_node_follows_in_part_is_refused():
    link = Link(kind="rbe2", node=8, nodes=np.array([9, 10, 11, 12]), components=SOME)
    beam = Link(kind="rbe2", node=11, nodes=np.array([10]))
    with pytest.raises(mp.InputError, match="interface 'tip' sits on a node that rbe2 at node 9 drives"):
        branched(link, beam, node=12)
