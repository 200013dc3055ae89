"""Elements without some of their mid-side nodes: the displacement is linear along such an edge.

The same model with the node in the middle of the edge, and equations that hold it at the mean of the ends, has the same
frequencies.
"""

import numpy as np
import pytest
from fe.ansys_decks import STEEL, deck, eblock, nblock
from fe.decks import STEEL as MAT1
from fe.decks import free

import modalprep as mp
from modalprep.fe.mesh.cells import CELLS

CARDS = {
    "CQUAD8": ("quad8", "PSHELL,3,7,.05,7,,7\n"),
    "CTRIA6": ("triangle6", "PSHELL,3,7,.05,7,,7\n"),
    "CTETRA": ("tetra10", "PSOLID,3,7\n"),
    "CPENTA": ("wedge15", "PSOLID,3,7\n"),
    "CPYRAM": ("pyramid13", "PSOLID,3,7\n"),
    "CHEXA": ("hexahedron20", "PSOLID,3,7\n"),
}
NUMBERS = {"186": "hexahedron20", "95": "hexahedron20", "92": "tetra10", "187": "tetra10", "281": "quad8"}


def points_of(kind):
    """Return the nodes of a cell, out of its unit shape, with straight edges."""
    x = CELLS[kind].node_coordinates()
    x = np.pad(x, ((0, 0), (0, 3 - x.shape[1])))
    return x + 0.2 * x[:, [1, 2, 0]] * (1.0, 0.5, 0.0)


def frequencies(mesh, first):
    """Return the frequencies of a cell held at its first corners."""
    held = {"root": mp.Interface(group="held", kind="rbe2")}
    group = {"vertex": np.arange(first)}
    cells = {**mesh.cells, "vertex": np.arange(first)[:, None]}
    built = mp.assemble(mesh.with_(cells=cells, groups={**mesh.groups, "held": group}), {}, held)
    found = mp.craig_bampton(built, modes=6, truncation=()).table.frequency
    return found[:6]


def at_the_mean(row, a, b, components):
    return [((row, c, 1.0), (a, c, -0.5), (b, c, -0.5)) for c in range(1, components + 1)]


@pytest.mark.parametrize("missing", [1, 2])
@pytest.mark.parametrize("card", CARDS)
def test_cards_without_some_grids(tmp_path, card, missing):
    """The last ones, and one in between."""
    kind, section = CARDS[card]
    cell = CELLS[kind]
    corners = len(cell.corners)
    points = points_of(kind)
    order = list(cell.nastran_order or range(cell.count))
    out = [cell.count - 1, corners][:missing]
    components = 3 if cell.dimension == 3 else 6
    listed = {"given": [], "missing": []}
    for name, skipped in (("given", []), ("missing", out)):
        numbers = [""] * cell.count
        for k, place in enumerate(order):
            numbers[place] = "" if k in skipped else str(k + 1)
        grids = "".join(f"GRID,{k},,{x:.12f},{y:.12f},{z:.12f}\n" for k, (x, y, z) in enumerate(points, 1))
        text = grids + free([card, "9", "3", *numbers]) + section + MAT1
        if not skipped:
            equations = (t for k in out for t in at_the_mean(k, *cell.edges[k - corners], components))
            for terms in equations:
                fields = [f"{node + 1},{c},{f}" for node, c, f in terms]
                text += f"MPC,1,{fields[0]},{fields[1]}\n,,{fields[2]}\n"
        (tmp_path / f"{name}.bdf").write_text(text + "ENDDATA\n")
        listed[name] = frequencies(mp.read_mesh(tmp_path / f"{name}.bdf"), 2 if components == 6 else 3)
    np.testing.assert_allclose(listed["missing"], listed["given"], rtol=1e-9)


@pytest.mark.parametrize("number", NUMBERS)
def test_elements_of_ansys_without_a_mid_side_node(tmp_path, number):
    kind = NUMBERS[number]
    cell = CELLS[kind]
    corners = len(cell.corners)
    out = cell.count - 1
    points = points_of(kind)
    shell = ["SECTYPE,1,SHELL", "SECDATA,.05,1"] if number == "281" else []
    common = [f"ET,1,{number}", *STEEL, *shell, *nblock(points)]
    nodes = list(range(1, cell.count + 1))
    a, b = cell.edges[out - corners]
    labels = ["UX", "UY", "UZ", "ROTX", "ROTY", "ROTZ"][: 6 if shell else 3]
    held = [f"CE,{k},0,{out + 1},{u},1,{a + 1},{u},-.5,{b + 1},{u},-.5" for k, u in enumerate(labels, 1)]
    found = []
    for own, more in ((nodes, held), ([*nodes[:-1], 0], [])):
        mesh = mp.read_mesh(deck(tmp_path, [*common, *eblock(own), *more]))
        assert kind in mesh.cells
        found.append(frequencies(mesh, 2 if shell else 3))
    np.testing.assert_allclose(*found, rtol=1e-9)


def test_elements_that_share_an_edge_share_its_new_node(tmp_path):
    """Two CTETRA with a common edge without grid: one new node, and three equations."""
    x = points_of("tetra10")
    grids = "".join(f"GRID,{k},,{a:.12f},{b:.12f},{c:.12f}\n" for k, (a, b, c) in enumerate(x, 1))
    text = grids + "GRID,11,,.3,.3,-1.\n" + "".join(f"GRID,{k},,0.,0.,{-k / 20}\n" for k in (12, 13, 14))
    text += "CTETRA,1,3,1,2,3,4,,6\n,7,8,9,10\nCTETRA,2,3,1,3,2,11,7,6\n,,12,13,14\nPSOLID,3,7\n" + MAT1 + "ENDDATA\n"
    (tmp_path / "two.bdf").write_text(text)
    mesh = mp.read_mesh(tmp_path / "two.bdf")
    assert len(mesh.points) == 15
    assert mesh.labels[-1] == 15
    assert len(mesh.equations) == 3
    np.testing.assert_allclose(mesh.points[-1], (x[0] + x[1]) / 2, atol=1e-12)


def test_a_plate_of_no_mid_side_grids_is_one_of_corners(tmp_path):
    text = "".join(f"GRID,{k},,{x}.,{y}.\n" for k, (x, y) in enumerate(((0, 0), (1, 0), (1, 1), (0, 1)), 1))
    (tmp_path / "plate.bdf").write_text(text + "CQUAD8,1,3,1,2,3,4\nPSHELL,3,7,.05,7,,7\n" + MAT1 + "ENDDATA\n")
    assert set(mp.read_mesh(tmp_path / "plate.bdf").cells) == {"quad"}


def test_new_nodes_may_lie_on_an_interface(tmp_path):
    """A face of a CHEXA that lacks two of its mid-side grids is held rigidly: its equations say nothing more."""
    x = points_of("hexahedron20")
    text = "".join(f"GRID,{k},,{a:.12f},{b:.12f},{c:.12f}\n" for k, (a, b, c) in enumerate(x, 1))
    order = CELLS["hexahedron20"].nastran_order
    numbers = [""] * 20
    for k, place in enumerate(order):
        numbers[place] = "" if k in (8, 10) else str(k + 1)
    (tmp_path / "brick.bdf").write_text(
        text + free(["CHEXA", "9", "3", *numbers]) + "PSOLID,3,7\n" + MAT1 + "ENDDATA\n"
    )
    mesh = mp.read_mesh(tmp_path / "brick.bdf")
    low = mesh.points[:, 2] < 0.3
    centre = mesh.points[low].mean(axis=0)
    root = {"root": mp.Interface(box=((-9, -9, -9), (9, 9, 0.3)), position=tuple(centre))}
    model = mp.assemble(mesh, {}, root)
    body = mp.flexible_body(model, mp.craig_bampton(model, modes=4), name="brick")
    assert [check.name for check in mp.check_body(body) if not check.passed] == []
