"""Geometric stiffness against finite differences of the nonlinear strain energy: elements, links, masses on arms."""

from dataclasses import replace

import numpy as np
import pytest
from element_cases import ELEMENTS, METAL, STIFF, built
from structured import random_rotation, surface

import modalprep as mp
from modalprep.body.verify import _third, check_geometric_stiffness
from modalprep.cli import main
from modalprep.fe.mesh.mesh import Link
from modalprep.vectors import skew


def motions(block, seed):
    rng = np.random.default_rng(seed)
    return 0.003 * rng.standard_normal((2, len(block.nodes), block.nodes.shape[1] * block.components))


@pytest.mark.parametrize("name", ELEMENTS)
def test_geometric_stiffness_is_the_third_derivative_of_the_energy(name):
    block = built(name)
    for seed in range(3):
        d, y = motions(block, seed)
        own = np.einsum("ei,eij,ej->", y, block.geometric_stiffness(d), y)
        beside = 2 * np.einsum("ei,eij,ej->", d, block.geometric_stiffness(y), y)
        found = _third(lambda s, t, d=d, y=y: block.energy(s * d + t * y).sum())
        # steps of 0.003: the derivative of the fifth order is 1e-6 of that of the third
        assert own + beside == pytest.approx(found, abs=3e-6 * (abs(own) + abs(beside)))
        assert abs(own) > 1e-3 * abs(found)


@pytest.mark.parametrize("name", ELEMENTS)
def test_energy_does_not_change_as_the_element_turns(name):
    """To the third order, of which the geometric stiffness is made: nodes turn by R, ``x + u`` to ``R (x + u)``.

    Without the stiffness against hourglass motions, which is that of small displacements.
    """
    block, (_, _, points, nodes, *_) = built(name), ELEMENTS[name]
    if getattr(block, "free_faces", None) is not None:
        block = replace(block, free_faces=None)
    points, n = (points @ random_rotation(3).T)[nodes], nodes.shape[1]
    d = motions(block, 0)[0].reshape(len(nodes), n, block.components)
    axis, size = np.array([0.6, -0.3, 0.5]), 1e-2
    gaps = []
    for turn in (size, size / 2):
        w = turn * axis
        R = np.eye(3) + skew(w) + skew(w) @ skew(w) / 2
        moved = (turn / size) * d
        still = moved.copy()
        moved = moved.copy()
        moved[..., :3] = (points + still[..., :3]) @ R.T - points
        if block.components == 6:  # R exp(t) to second order
            moved[..., 3:] = still[..., 3:] + w + np.cross(w, still[..., 3:]) / 2
        gaps.append(sum(block.energy(x.reshape(len(x), -1)).sum() * sign for x, sign in ((moved, 1), (still, -1))))
    assert abs(gaps[0]) < 1e-12 or np.log2(gaps[0] / gaps[1]) > 3.7  # the fourth order, and no energy below it


def mast(links=(), extra=(), section=None, **masses):
    """A bent cantilever of 12 beams in the mesh axes, its tip with masses and links to the `extra` points."""
    s = np.linspace(0, 1, 13)
    points = np.vstack([np.stack([s, 0.3 * s**2, 0.2 * s**3], axis=1), *extra])
    vertices = np.concatenate([[0, 12], np.arange(13, len(points))]).astype(int)
    groups = {"beam": {"line": np.arange(12)}, "root": {"vertex": [0]}, "tip": {"vertex": [1]}}
    groups |= {"ends": {"vertex": np.arange(2, len(vertices))}} if len(extra) else {}
    cells = {"line": np.stack([np.arange(12), np.arange(1, 13)], axis=1), "vertex": vertices[:, None]}
    mesh = mp.fe.Mesh(points=points, cells=cells, groups=groups, links=tuple(links))
    section = section or mp.fe.beam_section(
        "rectangle", STIFF, width=0.06, height=0.03, up=(0, 0, 1), offset=(0.02, 0.01)
    )
    ends = {"root": mp.Interface(group="root", kind="node")}
    return mp.assemble(mesh, {"beam": section} | masses, ends)


def panel(tip, depth=0.2, faces=False):
    """A strip of quads bent to an arch and twisted, whose tip of a depth is held by a frame of that kind."""
    points, cells = surface(8, 3, "quad", lambda s, t: (
        np.sin(s), (t - 0.5) * 0.3 * np.cos(s), 1 - np.cos(s) + (t - 0.5) * 0.3 * np.sin(s)))  # fmt: skip
    ends = {
        "root": np.flatnonzero(points[:, 0] < 1e-9),
        "tip": np.flatnonzero(points[:, 0] > points[:, 0].max() - depth),
    }
    groups = {"skin": {"quad": np.arange(len(cells))}}
    groups |= {"root": {"vertex": np.arange(4)}, "tip": {"vertex": 4 + np.arange(len(ends["tip"]))}}
    groups |= {"tip": {"quad": np.flatnonzero(np.isin(cells, ends["tip"]).all(axis=1))}} if faces else {}
    vertices = np.concatenate(list(ends.values()))[:, None]
    mesh = mp.fe.Mesh(points=points, cells={"quad": cells, "vertex": vertices}, groups=groups)
    held = {"root": mp.Interface(group="root"), "tip": mp.Interface(group="tip", kind=tip, boundary="free")}
    return mp.assemble(mesh, {"skin": mp.Shell(material=METAL, thickness=0.02, offset=0.01)}, held)


def guided():
    """A bent mast whose tip guides the end of a second one: rigid in two directions off the axes of the mesh."""
    s = np.linspace(0, 1, 9)
    first = np.stack([s, 0.3 * s**2, 0.2 * s**3], axis=1)
    points = np.vstack([first, first[1:] @ np.diag([1.0, -1.4, 2.0])])
    lines = np.array([[k, k + 1] for k in range(8)] + [[0, 9]] + [[k, k + 1] for k in range(9, 16)])
    components = np.array([1, 0, 1, 0, 1, 0], dtype=bool)
    link = Link(kind="rbe2", node=8, nodes=np.array([16]), components=components, axes=random_rotation(8)[None])
    groups = {"beam": {"line": np.arange(16)}, "root": {"vertex": np.array([0])}}
    mesh = mp.fe.Mesh(points=points, cells={"line": lines, "vertex": np.array([[0]])}, groups=groups, links=(link,))
    section = mp.fe.beam_section("rectangle", STIFF, width=0.06, height=0.03, up=(0, 0, 1))
    return mp.assemble(mesh, {"beam": section}, {"root": mp.Interface(group="root", kind="node")})


ARMS = (np.array([[1.1, 0.5, 0.2]]), np.array([[0.9, 0.1, 0.4]]), np.array([[1.0, 0.4, -0.2]]))
MODELS = {
    "eccentric beams": mast,
    "inertia and offset": lambda: mast(
        tip=mp.PointMass(mass=0.01, inertia=(1e-3, 2e-3, 2.5e-3, 2e-4, -1e-4, 3e-4), offset=(0.1, 0.05, -0.1))
    ),
    "masses on rigid arms": lambda: mast(
        [Link(kind="rbe2", node=12, nodes=np.arange(13, 16))], ARMS, ends=mp.PointMass(mass=0.01)
    ),
    "an end guided in oblique directions": guided,
    "skin on a rigid frame": lambda: panel("rbe2"),
    "skin on a mean frame": lambda: panel("rbe3"),
    "skin on the mean of some faces": lambda: panel("rbe3", 0.4, faces=True),
    "skin on the mean of its straight edge": lambda: panel("rbe3", 1e-6),
}


def sound(name):
    model = MODELS[name]()
    reduction = mp.craig_bampton(model, modes=8, truncation=())
    return model, reduction, mp.flexible_body(model, reduction, name="body")


@pytest.mark.parametrize("name", MODELS)
def test_geometric_stiffness_of_a_body_is_that_of_the_energy(name):
    model, reduction, body = sound(name)
    (check,) = check_geometric_stiffness(model, reduction, body)
    assert check.within, check
    for array in ("Kg_A", "Kg_W", "Kg_F"):
        value = getattr(body, array)
        if np.any(value):
            (check,) = check_geometric_stiffness(model, reduction, body.with_(**{array: 1.1 * value}, T=None))
            assert not check.within, array


def test_mass_on_the_mean_of_nodes():
    """An rbe3 that carries a mass with offset: its frame turns as its nodes do, to second order."""
    model = panel("rbe3")
    free = mp.craig_bampton(model, modes=8, truncation=())
    link = model.geometric_stiffness.links.constraints.links[1]
    turn = 1e-3 * np.array([0.3, -0.5, 0.4])
    d = np.zeros(model.n_dof)
    R = np.eye(3) + skew(turn) + skew(turn) @ skew(turn) / 2
    d[link.dofs[:, :3]] = link.arm @ (R - np.eye(3)).T
    np.testing.assert_allclose(link._fitted(d)[3:], turn, atol=1e-8)  # the third order of R
    assert free.basis.shape[1] == 8


def test_check_command_compares_with_the_energy(project, capsys):
    assert main(["check", str(project / "pipelines" / "half-beam.toml"), "--energy"]) == 0
    assert "energy of second order" in capsys.readouterr().out


def test_a_modal_file_has_no_energy_to_compare_with(tmp_path, capsys):
    from modalprep.examples import uniform_beam

    file = mp.write_body(uniform_beam(modes=2), tmp_path / "beam.h5")
    assert main(["check", str(file), "--energy"]) == 2
    assert "no mesh" in capsys.readouterr().err
