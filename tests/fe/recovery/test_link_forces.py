"""Forces of links: balance of each link, and of its nodes with the section forces of the beams that meet there."""

import numpy as np
import pytest
from body.test_recovered_forces import ROOT, TIP, frame_section, linear, only

import modalprep as mp
from modalprep.fe import Link, Mesh

BEAMS = np.array([[0, 1], [0, 2], [3, 4], [6, 5]])  # two arms, a mast on the link, a strut on it by another link
POINTS = np.array(
    [[0.0, 0, 0], [1, 0.3, 0.1], [1.1, -0.4, 0.2], [1.2, 0, 0.1], [2, 0.2, 0.6], [1.5, 1, 0.3], [2, 1, 1]]
)


@pytest.fixture(scope="module", params=["rbe2", "rbe3"])
def frame(request):
    """Beams, joined by a link of either kind, and one that hangs on another link; recoveries at a random motion."""
    groups = {"beam": {"line": np.arange(4)}, "root": {"vertex": np.array([0])}, "tip": {"vertex": np.array([1])}}
    nodes, points, stays = np.array([1, 2]), POINTS, {}
    if request.param == "rbe3":  # three nodes, not on a line
        nodes, points, stays = np.array([1, 2, 7]), np.vstack([POINTS, [0.9, 0.1, -0.5]]), {"line": [[0, 7]]}
        groups["beam"]["line"] = np.arange(5)
    weights = np.linspace(1, 2, len(nodes))
    mesh = Mesh(
        points=points,
        cells={"line": np.vstack([BEAMS, *stays.values()]), "vertex": np.array([[0], [5]])},
        groups=groups,
        links=(
            Link(kind=request.param, node=3, nodes=nodes, weights=weights),
            Link(kind="rbe2", node=4, nodes=np.array([6])),
        ),
    )
    model = mp.assemble(mesh, {"beam": frame_section()}, {"root": ROOT, "tip": TIP})
    Recover = mp.fe.Recover
    wanted = {
        "links": Recover(kind="mpc_force"),
        "some": Recover(kind="mpc_force", node=4),
        "beams": Recover(kind="section_force"),
    }
    reduction = mp.craig_bampton(model, modes=3, truncation=())
    body = mp.flexible_body(model, reduction, name="frame", recovery=mp.fe.model_recovery(model, mesh, wanted))
    random = np.random.default_rng(1)
    A, omega, alpha = random.standard_normal((3, 3)) * np.array([[10], [3], [20]])
    motion = linear(body, A=A, omega=omega, alpha=alpha, loads=random.standard_normal((2, 6)) * 100)
    return mesh, model, body, motion


def test_links_are_in_balance(frame):
    """The forces on all nodes, and the moments about any point, add up to zero: links have no mass."""
    _, _, body, motion = frame
    block = body.recovery["links"]
    values = only(block, motion)
    moments = values[:, 3:] + np.cross(block.position - [3.0, -2, 1], values[:, :3])
    assert np.abs(values).max() > 10
    assert np.abs(np.concatenate([values[:, :3], moments], axis=1).sum(axis=0)).max() < 1e-9 * np.abs(values).max()


def test_nodes_of_links_are_in_balance(frame):
    """What links exert on a node is what the node exerts on its beams, dependent or not: three kept modes, corrected.

    Forces of the beams are those of both ends in the axes of the mesh, without the weight of the nodes, which is none.
    """
    mesh, model, body, motion = frame
    block, beams = body.recovery["links"], only(body.recovery["beams"], motion).reshape(-1, 2, 6)
    values = dict(zip(block.node.tolist(), only(block, motion), strict=True))
    on_beams = np.zeros((len(mesh.points), 6))
    for nodes, R, arms, ends in (
        (b.nodes[e], b.frame[e], b.arm[e], beams[b.nodes[:, :2].tolist().index(b.nodes[e].tolist())])
        for b in model.strain_energy.blocks
        for e in range(len(b.nodes))
    ):
        for node, arm, sign, force in zip(nodes, arms, (-1, 1), ends, strict=True):
            own = sign * np.concatenate([R.T @ force[:3], R.T @ force[3:]])
            own[3:] += np.cross(arm, own[:3])
            on_beams[node] += own
    largest = np.abs(on_beams).max()
    assert set(values) == ({1, 2, 3, 4, 6} | ({7} if 7 < len(mesh.points) else set()))
    for node, force in values.items():
        assert force == pytest.approx(on_beams[node], abs=1e-9 * largest)  # round-off of the finite-element solution
    assert only(body.recovery["some"], motion)[0] == pytest.approx(values[3], abs=1e-12 * largest)


def test_the_frame_of_an_interface_carries_its_load():
    """An rbe2 interface at the end of a beam: it takes the load at its frame and gives it to the beam's last node."""
    points = np.array([[0.0, 0, 0], [1, 0, 0]])
    groups = {"beam": {"line": np.arange(1)}, "root": {"vertex": np.array([0])}, "end": {"vertex": np.array([1])}}
    mesh = Mesh(points=points, cells={"line": np.array([[0, 1]]), "vertex": np.array([[0], [1]])}, groups=groups)
    tip = mp.Interface(group="end", kind="rbe2", boundary="free", position=(1.0, 0.5, 0))
    model = mp.assemble(mesh, {"beam": frame_section()}, {"root": ROOT, "tip": tip})
    wanted = {"links": mp.fe.Recover(kind="mpc_force")}
    recovery = mp.fe.model_recovery(model, mesh, wanted)
    body = mp.flexible_body(model, mp.craig_bampton(model, modes=1), name="beam", recovery=recovery)
    load = np.zeros((2, 6))
    load[1] = F = 3.0, 5.0, -7.0, 1.0, 2.0, 4.0
    found = dict(
        zip(body.recovery["links"].places, only(body.recovery["links"], linear(body, loads=load)), strict=True)
    )
    assert found["tip"] == pytest.approx(-np.array(F), rel=1e-8)
    carried = [*F[:3], *(F[3:] + np.cross([0, 0.5, 0], F[:3]))]
    assert found["2"] == pytest.approx(carried, rel=1e-8)


def test_nodes_without_links_are_refused():
    mesh = Mesh(
        points=np.eye(3)[:2],
        cells={"line": np.array([[0, 1]]), "vertex": np.array([[0]])},
        groups={"beam": {"line": np.arange(1)}, "root": {"vertex": np.array([0])}},
    )
    model = mp.assemble(mesh, {"beam": frame_section()}, {"root": ROOT})
    with pytest.raises(mp.InputError, match="recovery 'x': no link, equation or support holds a node of the model"):
        mp.fe.model_recovery(model, mesh, {"x": mp.fe.Recover(kind="mpc_force")})
