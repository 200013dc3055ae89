"""Parts of meshes: their masses sum to the body's, branches split, rings are refused."""

import numpy as np
import pytest
from structured import box

import modalprep as mp
from modalprep.errors import InputError
from modalprep.examples import cantilever_model, spinup_section
from modalprep.fe.division.masses import part_masses
from modalprep.fe.division.parts import divide


def frame(points, lines, **masses):
    """Beams between points, root at the first, tip at the last; point masses by name at nodes from 0."""
    cells = {"line": np.array(lines), "vertex": np.array([[node] for node in masses.values()]).reshape(-1, 1)}
    groups = {"beam": {"line": np.arange(len(lines))}}
    groups |= {name: {"vertex": np.array([k])} for k, name in enumerate(masses)}
    mesh = mp.fe.Mesh(points=np.array(points, dtype=float), cells=cells, groups=groups)
    sections = {"beam": spinup_section()} | {name: mp.PointMass(mass=5.0) for name in masses}
    ends = {"root": mp.Interface(node=1, kind="node"), "tip": mp.Interface(node=len(points), kind="node")}
    return mp.assemble(mesh, sections, ends)


def line(start, end, n):
    """Points between two, the first left out."""
    return [start + (np.subtract(end, start)) * k / n for k in range(1, n + 1)]


def tee(**masses):
    """A stem along x of 8 elements that branches to two arms of 4 along y."""
    origin, fork, arm = np.zeros(3), np.array([8.0, 0, 0]), np.array([0, 4.0, 0])
    points = [origin, *line(origin, fork, 8), *line(fork, fork + arm, 4), *line(fork, fork - arm, 4)]
    lines = [[i, i + 1] for i in range(8)] + [[8, 9], [9, 10], [10, 11], [11, 12]]
    lines += [[8, 13], [13, 14], [14, 15], [15, 16]]
    return frame(points, lines, **masses)


def test_branches_split_and_have_the_part_with_the_fork_for_parent():
    """Slabs of 2 m: four on the stem of 8 m, one with the fork, then one on each arm."""
    division = divide(tee(), 6)
    assert division.parent.tolist() == [-1, 0, 1, 2, 3, 4, 4]
    assert np.all(division.of_element[[8, 9, 12, 13]] == 4)
    assert set(division.of_element[10:12]) | set(division.of_element[14:]) == {5, 6}


def test_a_point_mass_belongs_to_the_part_of_its_node():
    model = tee(ball=16)
    division = divide(model, 6)
    assert division.of_element[-1] == division.of_node[16]


@pytest.mark.parametrize("model", [tee, lambda: tee(ball=3, weight=12), cantilever_model, lambda: bar()])
def test_parts_have_the_mass_and_moments_of_the_body(model):
    """Nothing is lost or counted twice."""
    model = model()
    Phi = np.random.default_rng(0).standard_normal((model.n_dof, 3))
    found = part_masses(model, divide(model, 4).of_element, Phi)
    size = model.rigid.m * np.ptp(model.points, axis=0).max() ** 2
    # sums over the same elements in another order
    np.testing.assert_allclose(found.m.sum(), model.rigid.m, rtol=1e-12)
    np.testing.assert_allclose(found.s.sum(axis=0), model.rigid.s0, atol=1e-12 * size)
    np.testing.assert_allclose(found.E.sum(axis=0), model.rigid.E0, atol=1e-12 * size)
    np.testing.assert_allclose(found.S.sum(axis=0), model.g.T @ Phi, atol=1e-12 * size)
    np.testing.assert_allclose(found.H.sum(axis=0), np.einsum("dab,dn->abn", model.h, Phi), atol=1e-12 * size)


def bar():
    """A bar of hexahedra, held by a rigid link at one end, of another at the other."""
    points, cells = box("hexahedron", (8, 2, 2), (4.0, 1.0, 1.0))
    mesh = mp.fe.Mesh(points=points, cells={"hexahedron": cells}, groups={"bar": {"hexahedron": np.arange(len(cells))}})
    ends = {name: mp.Interface(plane=((x, 0, 0), (1, 0, 0))) for name, x in (("root", 0.0), ("tip", 4.0))}
    return mp.assemble(mesh, {"bar": mp.Solid(material=mp.Material(E=2e11, nu=0.3, rho=7800.0))}, ends)


def test_a_ring_is_refused_with_where_it_closes():
    angle = 2 * np.pi * np.arange(16) / 16
    points = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    ring = frame(points, [[i, (i + 1) % 16] for i in range(16)])
    with pytest.raises(InputError, match=r"closes on itself near \(-0\.8"):
        divide(ring, 4)


def test_no_parts_are_refused():
    with pytest.raises(InputError, match="stations = 0 must be at least 1"):
        divide(cantilever_model(), 0)
