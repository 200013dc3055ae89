"""A panel with a stringer under its skin: every shell against solids; beams that stand on shells by an arm.

The stringer is as thin as the skin, since a thick one stiffens the skin where they meet, which no shell and beam know.
"""

from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np
import pytest
from size import some
from stiffened import ALUMINIUM, SHELLS, Stiffened, assembled, bricks, frequencies, skin_and_beams
from structured import random_rotation, random_surface, surface

import modalprep as mp
from modalprep.fe.elements.shells.shell import ShellBlock
from modalprep.fe.elements.shells.yielding import HELD
from modalprep.fe.mesh.mesh import Link

COARSE, FINE = (24, 8), (36, 12)  # cells along and across
PANELS = {curved: Stiffened(radius=0.3 * curved) for curved in (False, True)}


def modes(curved, kind, membrane, n):
    """Return frequencies of the clamped panel."""
    return frequencies(assembled(PANELS[curved], *skin_and_beams(PANELS[curved], kind, n, membrane)))


@cache
def solids(curved):
    return frequencies(assembled(PANELS[curved], *bricks(PANELS[curved], (48, 16))))


def linked(kind):
    """Return frequencies of the flat panel whose stringer stands on nodes of its own, by rigid links."""
    shape = PANELS[False]
    mesh, sections = skin_and_beams(shape, kind, COARSE)
    lines = mesh.groups["stiffener"]["line"]
    middle, own = np.unique(mesh.cells["line"][lines], return_inverse=True)
    cells = mesh.cells["line"].copy()
    cells[lines] = len(mesh.points) + own.reshape(-1, 2)
    links = (Link(kind="rbe2", node=int(a), nodes=np.array([len(mesh.points) + k])) for k, a in enumerate(middle))
    points = np.vstack([mesh.points, mesh.points[middle] + [0, 0, shape.below]])
    mesh = mesh.with_(points=points, cells=mesh.cells | {"line": cells}, links=tuple(links))
    sections["stiffener"] = replace(sections["stiffener"], offset=(0.0, 0.0))
    return frequencies(assembled(shape, mesh, sections))


@pytest.mark.parametrize(("shell", "curved"), some(product(SHELLS, [False, True]), 4))
def test_a_stringer_under_a_skin(shell, curved):
    """Bending, twist and their overtones; if drilling rotations hold the stringer, triangles are 13 to 30 % too stiff.

    Less than 1.5 % remains, most of it the corner between both; constant strain on a curved skin converges slowly.
    """
    error = np.abs(modes(curved, *shell, FINE) / solids(curved) - 1)
    slow = curved and shell[1] == "cst"
    assert error.max() < (0.05 if slow else 0.015)
    if slow:
        assert error.max() < 0.6 * np.abs(modes(curved, *shell, COARSE) / solids(curved) - 1).max()


@pytest.mark.parametrize("kind", ["triangle", "quad"])
def test_a_stringer_on_rigid_links_is_one_with_an_offset(kind):
    np.testing.assert_allclose(
        linked(kind), modes(False, kind, "opt", COARSE), rtol=1e-6
    )  # the same matrices but for eliminated nodes


def ring(radius, offset, kind="line", cells=24):
    """Return frequencies of a ring of beams, held at one node, whose centroids are on another radius."""
    n = 2 * cells if kind == "line3" else cells
    angle = 2 * np.pi * np.arange(n) / n
    points = radius * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    ends = np.arange(0, n, n // cells)
    lines = np.stack([ends, np.roll(ends, -1), ends + 1][: len(kind) - 2 if kind == "line3" else 2], axis=1)
    up = points[ends] + points[np.roll(ends, -1)]
    mesh = mp.fe.Mesh(
        points=points, cells={kind: lines, "vertex": np.array([[0]])}, data={"up": {kind: up}},
        groups={"ring": {kind: np.arange(cells)}, "root": {"vertex": np.array([0])}},
    )  # fmt: skip
    section = mp.fe.beam_section("rectangle", ALUMINIUM, width=0.01, height=0.02, offset=(0.0, offset))
    model = mp.assemble(mesh, {"ring": section}, {"root": mp.Interface(group="root", kind="node")})
    return mp.craig_bampton(model, modes=8, truncation=()).frequency


@pytest.mark.parametrize("kind", ["line", "line3"])
def test_a_ring_inside_its_nodes_is_a_ring_of_that_radius(kind):
    """Rigid arms to the nodes change nothing; with an arm normal to each chord it is 0.1 longer, and 15 % lower."""
    inside = ring(0.2, -0.02, kind)
    np.testing.assert_allclose(inside, ring(0.18, 0.0, kind), rtol=1e-6)  # round-off of the lowest of stiff matrices


def test_offsets_at_a_corner_stay_their_own():
    """Two beams at a right angle, offset to the outside: each keeps an arm of that length normal to itself."""
    points = np.array([[0, 0, 0], [1.0, 0, 0], [1.0, 1.0, 0]])
    mesh = mp.fe.Mesh(points=points, cells={"line": np.array([[0, 1], [1, 2]]), "vertex": np.array([[0]])},
                      groups={"frame": {"line": np.arange(2)}, "root": {"vertex": np.array([0])}})  # fmt: skip
    section = mp.fe.beam_section("rod", ALUMINIUM, diameter=0.01, offset=(-0.1, 0.0))
    model = mp.assemble(mesh, {"frame": section}, {"root": mp.Interface(group="root", kind="node")})
    arm = np.concatenate([part.block(slice(None), points, np.zeros(3)).arm for part in model.elements.parts])
    np.testing.assert_allclose(arm, [[[0, -0.1, 0]] * 2, [[0.1, 0, 0]] * 2], atol=1e-15)


@pytest.mark.parametrize(("kind", "membrane"), SHELLS)
@pytest.mark.parametrize("offset", [0.02, -0.01])
def test_flat_shells_with_an_offset_on_a_cylinder_say_what_they_miss(kind, membrane, offset):
    """The area at a distance e from a radius R is ``1 + e / R`` times that of the nodes: curved shells have it."""
    shape = Stiffened(radius=0.15, along="", length=0.3)
    mesh, sections = skin_and_beams(shape, kind, (4, 32), membrane)
    model = assembled(shape, mesh, {"skin": replace(sections["skin"], offset=offset)})
    exact = 0.3 * 0.24 * (1 + offset / 0.15) * 0.005 * 2700
    notes = [note for note in model.notes if "offset" in note]
    if kind[-1] in "689":
        assert notes == []
        assert model.rigid.m == pytest.approx(exact, rel=1e-4)
    else:
        (note,) = notes
        missing = float(note.split(" % too")[0].split()[-1])
        assert missing == pytest.approx(
            100 * abs(1 - model.rigid.m / exact), rel=0.1
        )  # normals at the edges are those of one side
        assert ("too small" in note) == (offset > 0)


def under_beams(kind, **section):
    """Return a warped patch with and without beams on some of its nodes."""
    points, cells = random_surface(kind, 4)
    section = mp.Shell(material=ALUMINIUM, thickness=0.02, **section)
    arm = np.where(np.arange(len(points))[:, None] % 3 == 0, random_rotation(1)[0] * 0.1, np.nan)
    data = {"beam_arm": arm[cells]}
    with_arms, without = (ShellBlock.build(kind, points, cells, section, given, np.zeros(3)) for given in (data, {}))
    assert with_arms.yields.any()
    assert not with_arms.yields.all()
    return points, with_arms, without


@pytest.mark.parametrize(("kind", "section"), [("triangle", {}), ("triangle", {"membrane": "cst"}), ("quad", {}),
                                               ("triangle", {"offset": 0.03})])  # fmt: skip
def test_a_yielding_shell_feels_no_rigid_motion_and_is_the_energy_of_its_strains(kind, section):
    points, block, _ = under_beams(kind, **section)
    K, (B, C, dx) = block.stiffness(), block.strain
    np.testing.assert_allclose(np.einsum("eqsi,est,eqtj,eq->eij", B, np.broadcast_to(C, (len(K), *C.shape[1:])), B, dx),
                               K, atol=1e-12 * np.abs(K).max())  # fmt: skip
    rigid = np.zeros((len(points), 6, 6))
    rigid[:, range(6), range(6)] = 1.0
    for axis in range(3):
        rigid[:, :3, 3 + axis] = np.cross(np.eye(3)[axis], points)
    assert np.abs(K @ rigid[block.nodes].reshape(len(K), -1, 6)).max() < 1e-12 * np.abs(K).max()


@pytest.mark.parametrize("kind", ["triangle", "quad"])
def test_where_a_plate_strains_alike_everywhere_nothing_yields(kind):
    """Nodes that turn as the plate does exert the same forces on it, and the share s of moments, which cancel out."""
    points, cells = surface(3, 3, kind, distort=0.25)
    section, arm = mp.Shell(material=ALUMINIUM, thickness=0.02), np.full((*cells.shape, 3), [0, 0, 0.1])
    pair = [ShellBlock.build(kind, points, cells, section, data, np.zeros(3)) for data in ({}, {"beam_arm": arm})]
    d = np.zeros((len(points), 6))
    d[:, 0], d[:, 1], d[:, 5] = points[:, :2] @ [0.3, -0.2], points[:, :2] @ [0.5, 0.7], (0.5 + 0.2) / 2
    still, yields = ((block.stiffness() @ d[cells].reshape(len(cells), -1, 1)).reshape(-1, 6) for block in pair)
    np.testing.assert_allclose(yields, still * [1, 1, 1, 1, 1, HELD], atol=1e-12 * np.abs(still).max())
