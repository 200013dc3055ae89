"""RBE3 over faces weigh areas, over edges lengths; on a straight edge of shells the rotations count."""

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve
from stiffened import SHELLS
from structured import box, surface

import modalprep as mp
from modalprep.fe.links.mean_points import cells_of

E, L, B, H = 7e10, 0.4, 0.1, 0.05
METAL = mp.Material(E=E, nu=0.0, rho=2700.0)
END = {"plane": ((L, 0, 0), (1.0, 0, 0))}
SOLIDS = ["tetra", "tetra10", "wedge", "wedge15", "hexahedron", "hexahedron20", "hexahedron27"]


def held(points, kind, cells, section, **end):
    """Return the model, clamped at x = 0, with a frame of kind rbe3 at the other end."""
    vertices = np.flatnonzero(np.abs(points[:, 0]) < 1e-9)
    mesh = mp.fe.Mesh(
        points=points, cells={kind: cells, "vertex": vertices[:, None]},
        groups={"all": {kind: np.arange(len(cells))}, "root": {"vertex": np.arange(len(vertices))}},
    )  # fmt: skip
    frames = {"root": mp.Interface(group="root", kind="rbe2"), "end": mp.Interface(**(END | {"kind": "rbe3"} | end))}
    return mp.assemble(mesh, {"all": section}, frames)


def moved(model, load):
    """Return all displacements (n_dof,) under a wrench at the end, and the motion (6,) of its frame."""
    root, end = model.interfaces
    K, F = (model.C.T @ model.K @ model.C).tocsc(), np.zeros(model.n_dof)
    F[end.dofs] = load
    free = np.setdiff1d(np.arange(K.shape[0]), np.searchsorted(model.free, root.dofs))
    x = np.zeros(K.shape[0])
    x[free] = spsolve(K[free][:, free], (model.C.T @ F)[free])
    return model.C @ x, (model.C @ x)[end.dofs]


@pytest.mark.parametrize("kind", SOLIDS)
def test_a_bar_pulled_at_its_end_stretches_as_under_uniform_traction(kind):
    """``u = F L / E A`` at every node of the end; equal weights of nodes stretch quadratic bricks by 1 % more."""
    points, cells = box(kind, (2, 2, 1), (L, B, H))
    model = held(points, kind, cells, mp.Solid(material=METAL))
    u, frame = moved(model, [1.0, 0, 0, 0, 0, 0])
    exact = L / (E * B * H)
    np.testing.assert_allclose(u[model.interfaces[1].dofs[0]], exact, rtol=1e-9)  # round-off
    np.testing.assert_allclose(u[model.dof[model.interfaces[1].nodes, 0]], exact, rtol=1e-9)
    np.testing.assert_allclose(frame[1:] * L, 0, atol=1e-9 * exact)


@pytest.mark.parametrize("kind", ["hexahedron20", "hexahedron27", "wedge15", "tetra10"])
def test_a_bar_bent_at_its_end_turns_as_under_linear_traction(kind):
    """``M L / E I``, about both axes: the displacements of pure bending are quadratic."""
    points, cells = box(kind, (2, 2, 1), (L, B, H))
    model = held(points, kind, cells, mp.Solid(material=METAL))
    for axis, inertia in ((4, B * H**3 / 12), (5, H * B**3 / 12)):
        frame = moved(model, np.eye(6)[axis])[1]
        assert frame[axis] == pytest.approx(L / (E * inertia), rel=1e-8)


def test_unlike_faces_weigh_their_areas():
    """A bar whose end is divided at 0.2 and 0.9 of its width: at its centroid, and it stretches uniformly."""
    points, cells = box("hexahedron", (2, 3, 1), (L, B, H))
    points[:, 1] = np.interp(points[:, 1], B * np.arange(4) / 3, B * np.array([0, 0.2, 0.9, 1]))
    model = held(points, "hexahedron", cells, mp.Solid(material=METAL))
    np.testing.assert_allclose(model.interfaces[1].position[1:] + model.origin[1:], [B / 2, H / 2], rtol=1e-12)
    assert moved(model, [1.0, 0, 0, 0, 0, 0])[1][0] == pytest.approx(L / (E * B * H), rel=1e-9)


@pytest.mark.parametrize(("kind", "membrane"), SHELLS)
def test_a_straight_edge_of_shells_turns_with_its_nodes(kind, membrane):
    """A moment about the edge bends a strip by ``M L / E I``; a force off the edge pulls and bends it.

    Of a uniform traction triangles with drilling rotations (OPT) also feel moments, which the mean leaves out.
    """
    points, cells = surface(4, 3, kind, lambda s, t: (L * s, B * t**1.3, 0 * s))
    section = mp.Shell(material=METAL, thickness=H / 10, membrane=membrane)
    area, inertia, height = B * H / 10, B * (H / 10) ** 3 / 12, 0.03
    model = held(points, kind, cells, section)
    frame = moved(model, [0, 0, 0, 0, 1.0, 0])[1]
    assert frame[4] == pytest.approx(L / (E * inertia), rel=1e-6)  # the share of the other rotations of the nodes
    pulled = 1e-2 if (kind, membrane) == ("triangle", "opt") else 1e-6
    assert moved(model, [1.0, 0, 0, 0, 0, 0])[1][0] == pytest.approx(L / (E * area), rel=pulled)
    model = held(points, kind, cells, section, position=(L, B / 2, height))
    frame = moved(model, [1.0, 0, 0, 0, 0, 0])[1]
    assert frame[0] == pytest.approx(L / (E * area) + height**2 * L / (E * inertia), rel=pulled)


def test_an_edge_weighs_its_lengths():
    """Nodes at 0, 0.1, 0.5 and 1 of an edge: half of the sides beside them."""
    points, cells = surface(2, 3, "quad", lambda s, t: (s, np.interp(t, np.arange(4) / 3, [0, 0.1, 0.5, 1]), 0 * s))
    mesh = mp.fe.Mesh(points=points, cells={"quad": cells}, groups={})
    edge = np.flatnonzero(points[:, 0] == 1)
    over = cells_of(mesh, mp.Interface(plane=((1.0, 0, 0), (1.0, 0, 0))), edge)[0]
    weight = mp.fe.links.mean_points.MeanPoints.over(points, edge, over).nodal
    np.testing.assert_allclose(weight[np.argsort(points[edge, 1])], [0.05, 0.25, 0.45, 0.25], rtol=1e-12)


def test_nodes_beside_the_faces_are_said():
    """A plane through the end that meets a loose rib: nothing has areas for both."""
    points, cells = box("hexahedron", (1, 1, 1), (L, B, H))
    rib = np.array([[L, B, H], [L, 2 * B, H]])
    points = np.vstack([points, rib[1:]])
    corner = int(np.argmin(np.linalg.norm(points - rib[0], axis=1)))
    mesh = mp.fe.Mesh(
        points=points, cells={"hexahedron": cells, "line": np.array([[corner, 8]]), "vertex": np.arange(4)[:, None]},
        groups={"all": {"hexahedron": np.array([0])}, "rib": {"line": np.array([0])}},
    )  # fmt: skip
    sections = {"all": mp.Solid(material=METAL), "rib": mp.fe.beam_section("rod", METAL, diameter=0.01)}
    model = mp.assemble(mesh, sections, {"end": mp.Interface(**END, kind="rbe3")})
    (note,) = [note for note in model.notes if "alike" in note]
    assert note == "interface 'end': 1 of its 5 nodes lie on none of its faces or edges: every node counts alike"
