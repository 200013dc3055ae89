"""MED and universal files that gmsh writes: the same cells, node by node, and the same groups as its own .msh."""

import contextlib
import random

import gmsh
import h5py
import numpy as np
import pytest
from shared_data import DATA
from size import seeds

import modalprep as mp
from modalprep.errors import InputError
from modalprep.fe.mesh.cells import CELLS
from modalprep.fe.readers.med import in_vtk_order

DECK = DATA.parent / "repro" / "decks" / "gmsh_names.med"


def tetrahedra():
    box = gmsh.model.occ.addBox(0, 0, 0, 1, 0.8, 0.6)
    gmsh.model.occ.synchronize()
    gmsh.model.addPhysicalGroup(3, [box], name="body")
    gmsh.model.addPhysicalGroup(2, [1], name="face")


def bricks_and_wedges():
    occ = gmsh.model.occ
    pieces = [occ.addRectangle(x, 0, 0, 1, 1) for x in (0, 1)]
    occ.fragment([(2, pieces[0])], [(2, pieces[1])])
    occ.extrude([(2, piece) for piece in pieces], 0, 0, 1, [2], recombine=True)
    occ.synchronize()
    gmsh.model.addPhysicalGroup(3, [tag for _, tag in gmsh.model.getEntities(3)], name="body")
    gmsh.model.mesh.setRecombine(2, pieces[0])


@pytest.fixture(
    scope="module", params=[(tetrahedra, 1), (tetrahedra, 2), (bricks_and_wedges, 1), (bricks_and_wedges, 2)]
)
def written(request, tmp_path_factory):
    make, order = request.param
    folder = tmp_path_factory.mktemp("gmsh")
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.7)
        gmsh.option.setNumber("Mesh.SecondOrderIncomplete", 1)
        make()
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(order)
        for suffix in ("msh", "med", "unv"):
            gmsh.write(str(folder / f"mesh.{suffix}"))
    finally:
        gmsh.finalize()
    return folder


def cells(mesh, kind):
    """Coordinates of the nodes of each cell, (n, 3 count), in an order of their own."""
    rows = mesh.points[mesh.cells[kind]].reshape(len(mesh.cells[kind]), -1).round(9) + 0.0
    return rows[np.lexsort(rows.T)]


@pytest.mark.parametrize("suffix", ["med", "unv"])
def test_cells_and_groups_are_those_of_the_msh_file(written, suffix):
    expected = mp.read_mesh(written / "mesh.msh")
    found = mp.read_mesh(written / f"mesh.{suffix}")
    assert set(found.groups) == set(expected.groups)
    for kind in expected.cells:
        np.testing.assert_array_equal(cells(found, kind), cells(expected, kind))
    for name, group in expected.groups.items():
        assert {kind: len(rows) for kind, rows in found.groups[name].items()} == {k: len(r) for k, r in group.items()}


@pytest.mark.parametrize(
    "kind", [k for k in CELLS if CELLS[k].dimension == 3 and CELLS[k].count < 27 and k != "pyramid14"]
)
def test_order_of_med_is_its_own_inverse(kind):
    """A volume that is seen from the other side twice is itself, and the middles stay between their corners."""
    points = CELLS[kind].node_coordinates()
    nodes = np.arange(len(points))[None]
    mirrored = points * [-1, 1, 1]
    turned = in_vtk_order(kind, nodes, mirrored)
    corners, edges = len(CELLS[kind].corners), CELLS[kind].edges
    found = mirrored[turned[0]]
    np.testing.assert_array_equal(
        found[corners : corners + len(edges)], found[edges].mean(axis=1)[: len(points) - corners]
    )
    np.testing.assert_array_equal(in_vtk_order(kind, turned, mirrored), turned)
    np.testing.assert_array_equal(in_vtk_order(kind, turned, points), nodes)


@pytest.mark.skipif(not DECK.is_file(), reason=f"the deck is not at {DECK} (set MODALPREP_DATA)")
def test_names_of_a_file_of_gmsh():
    mesh = mp.read_mesh(DECK)
    assert {name: sum(map(len, group.values())) for name, group in mesh.groups.items()}.keys() == {
        "body", "hole base", "hole_wall",
    }  # fmt: skip
    corners = mesh.points[mesh.cells["tetra"]]
    assert np.linalg.det(corners[:, 1:] - corners[:, :1]).min() > 0


def test_groups_of_nodes_of_a_med_file(written):
    """Families of nodes have positive numbers; one may belong to two groups."""
    path = written / "named.med"
    path.write_bytes((written / "mesh.med").read_bytes())
    with h5py.File(path, "r+") as file:
        [step] = next(iter(file["ENS_MAA"].values())).values()
        family = step["NOE/FAM"][:]
        family[[0, 3]] = 5
        step["NOE/FAM"][:] = family
        made = next(iter(file["FAS"].values())).create_group("NOEUD/ends")
        made.attrs["NUM"] = 5
        made.create_group("GRO").attrs["NBR"] = 2
        names = [list(text.encode().ljust(80, b"\0")) for text in ("left end", "all ends")]
        made["GRO"].create_dataset("NOM", data=np.array(names, dtype="i1"))
    mesh = mp.read_mesh(path)
    assert mesh.nodes("left end").tolist() == mesh.nodes("all ends").tolist() == [0, 3]


REFUSED = {
    "nothing": ([], "holds no nodes"),
    "no elements": (["-1", "2411", "1 1 1 11", "0. 0. 0.", "-1"], "holds no elements"),
    "cut": (["-1", "2411", "1 1 1 11", "0. 0. 0."], "damaged or cut short"),
    "unknown element": (["-1", "2412", "4 999 1 1 7 2", "1 2", "-1"], "element 4 has FE descriptor 999"),
    "missing node": (["-1", "2411", "1 1 1 11", "0. 0. 0.", "-1", "-1", "2412", "4 21 1 1 7 2", "0 0 0", "1 2", "-1"],
                     "element 4 refers to node 2"),
    "nodes too few": (["-1", "2412", "4 111 1 1 7 2", "1 2", "-1"], "damaged or cut short"),
    "nodes too many": (["-1", "2412", "4 111 1 1 7 5", "1 2 3 4 5", "-1"], "damaged or cut short"),
}  # fmt: skip


@pytest.mark.parametrize("what", REFUSED)
def test_universal_files_that_cannot_be_read(tmp_path, what):
    lines, message = REFUSED[what]
    (tmp_path / "a.unv").write_text("\n".join(lines))
    with pytest.raises(InputError, match=message):
        mp.read_mesh(tmp_path / "a.unv")


@pytest.mark.parametrize("seed", seeds(30))
def test_damaged_universal_files_are_read_or_refused(written, tmp_path, seed):
    rng = random.Random(seed)
    text = (written / "mesh.unv").read_text()
    if seed % 2:
        text = text[: rng.randrange(len(text))]
    changed = list(text)
    for _ in range(seed % 5):
        changed[rng.randrange(len(changed))] = rng.choice("0123456789 -.D\nx")
    (tmp_path / "a.unv").write_text("".join(changed))
    with contextlib.suppress(InputError):
        assert len(mp.read_mesh(tmp_path / "a.unv").points)


def test_datasets_that_are_left_out_are_named_with_their_line(tmp_path):
    bar = ["-1", "2411", "1 1 1 11", "0. 0. 0.", "2 1 1 11", "1. 0. 0.", "-1", "-1", "2412", "4 21 1 1 7 2", "0 0 0"]
    (tmp_path / "a.unv").write_text("\n".join([*bar, "1 2", "-1", "-1", "164", "1", "-1"]))
    [note] = mp.read_mesh(tmp_path / "a.unv").notes
    assert "dataset 164" in note
    assert "line 14" in note
