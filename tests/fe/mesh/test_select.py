"""Node sets by query, and interfaces on them."""

import numpy as np
import pytest

import modalprep as mp
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.mesh.select import NodeSet

STEEL = mp.Material(E=2.1e11, nu=0.3, rho=7800.0)


@pytest.fixture(scope="module")
def grid():
    """A plate of 4 x 2 quads over 4 m x 2 m in z = 1, and a stray node nobody uses."""
    x, y = np.meshgrid(np.arange(5.0), np.arange(3.0), indexing="ij")
    points = np.stack([x.ravel(), y.ravel(), np.ones(15)], axis=1)
    n = np.arange(15).reshape(5, 3)
    quads = np.stack([n[:-1, :-1], n[1:, :-1], n[1:, 1:], n[:-1, 1:]], axis=-1).reshape(-1, 4)
    return Mesh(points=np.concatenate([points, [[0.0, 0.0, 1.0]]]), cells={"quad": quads},
                groups={"plate": {"quad": np.arange(8)}}, labels=100 + np.arange(16))  # fmt: skip


def pick(mesh, **way):
    return NodeSet(**way).nodes(mesh, np.arange(15)).tolist()


def test_each_way_finds_its_nodes(grid):
    assert pick(grid, group="plate") == list(range(15))
    assert pick(grid, node=104) == [4]
    assert pick(grid, near=(2.1, 1.2, 0.0)) == [7]
    assert pick(grid, box=((1.0, 0.0, 0.0), (2.0, 1.0, 2.0))) == [3, 4, 6, 7]  # faces included
    assert pick(grid, plane=((4.0, 0.0, 0.0), (2.0, 0.0, 0.0))) == [12, 13, 14]
    assert pick(grid, cylinder=((2.0, 1.0, 0.0), (0, 0, -3.0), 1.0)) == [4, 6, 8, 10]


def test_queries_see_used_nodes_only(grid):
    assert pick(grid, near=(0.0, 0.0, 1.0)) == [0]  # not the stray node 15 at the same place


def test_node_numbers_count_from_one_without_labels(grid):
    assert pick(grid.with_(labels=np.zeros(0, dtype=int)), node=5) == [4]


@pytest.mark.parametrize(
    ("way", "words"),
    [
        ({}, "exactly one of group, node, near, box, plane, cylinder"),
        ({"group": "a", "node": 3}, "has group and node"),
        ({"box": ((9, 9, 9), (10, 10, 10))}, "no node lies at box ((9, 9, 9), (10, 10, 10)); the mesh spans (0, 0, 1)"),
        ({"plane": ((0, 0, 0), (0, 0, 0))}, "has no length"),
        ({"node": 7}, "no node lies at node 7"),
        ({"group": "wing"}, "no group 'wing'"),
    ],
)
def test_what_selects_nothing_is_reported(grid, way, words):
    with pytest.raises(mp.InputError) as caught:
        pick(grid, **way)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: mp.Interface(group="end", kind="rbe4"), "interface at group 'end': kind 'rbe4' does not exist"),
        (lambda: mp.Interface(group="end", boundary="fred"), "boundary 'fred' does not exist; did you mean 'free'"),
        (lambda: mp.Connection(near=(0, 0, 1), kind="node"), "connection at near (0, 0, 1): kind 'node'"),
        (lambda: mp.Shell(material=STEEL, thickness=0.01, membrane="ops"), "membrane 'ops' does not exist"),
    ],
)
def test_words_that_do_not_exist_are_refused(make, words):
    with pytest.raises(mp.InputError) as caught:
        make()
    assert words in str(caught.value)


def test_interfaces_by_query_are_those_by_group(grid):
    """The left edge as a plane and as a group: the same model."""
    mesh = grid.with_(cells={**grid.cells, "vertex": np.array([[0], [1], [2]])},
                      groups={**grid.groups, "edge": {"vertex": np.arange(3)}})  # fmt: skip
    shell = {"plate": mp.Shell(material=STEEL, thickness=0.01)}
    models = [mp.assemble(mesh, shell, {"edge": mp.Interface(**way)})
              for way in ({"group": "edge"}, {"plane": ((0, 0, 0), (1, 0, 0))})]  # fmt: skip
    np.testing.assert_array_equal(models[0].C.toarray(), models[1].C.toarray())
    np.testing.assert_allclose(models[1].origin, [0, 1, 1])
