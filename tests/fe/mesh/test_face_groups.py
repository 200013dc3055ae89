"""Cells without a property beside those that have one are groups of nodes: faces of solids, as Gmsh writes them."""

import numpy as np
import pytest
from structured import box

import modalprep as mp
from modalprep.fe.mesh.cells import CELLS

STEEL = mp.Material(E=2.0e11, nu=0.3, rho=8000.0)
GMSH = {"tetra": ("C3D4", "CPS3"), "tetra10": ("C3D10", "CPS6"), "hexahedron": ("C3D8", "CPS4"),
        "hexahedron20": ("C3D20", "CPS8")}  # fmt: skip


def faces_at(points, cells, kind):
    """The faces of cells with all nodes at x = 0, their mid-side nodes between the corners."""
    cell, found = CELLS[kind], []
    number = {frozenset(edge): len(cell.corners) + k for k, edge in enumerate(cell.edges.tolist())}
    for conn in cells:
        for face in cell.faces:
            middles = [number[frozenset(pair)] for pair in zip(face, (*face[1:], face[0]), strict=True)]
            nodes = conn[[*face, *(middles if cell.second_order else [])]]
            if np.allclose(points[nodes, 0], 0):
                found.append(nodes)
    return np.array(found)


@pytest.mark.parametrize("kind", GMSH)
def test_faces_of_gmsh_in_an_abaqus_deck(tmp_path, kind):
    points, cells = box(kind, (2, 1, 1))
    faces, (solid, plane) = faces_at(points, cells, kind), GMSH[kind]
    lines = ["*Heading", "*NODE", *(", ".join(map(str, [k, *p])) for k, p in enumerate(points.tolist(), 1))]
    for name, group, conn, first in ((plane, "Surface1", faces, 1), (solid, "Volume1", cells, len(faces) + 1)):
        lines.append(f"*ELEMENT, TYPE={name}, ELSET={group}")
        rows = enumerate((conn + 1).tolist(), first)
        lines += [",\n".join(", ".join(map(str, part)) for part in ([k, *c][:11], c[10:]) if part) for k, c in rows]
    (tmp_path / "deck.inp").write_text("\n".join([*lines, "*ELSET, ELSET=wall", ", ".join(
        map(str, range(1, len(faces) + 1)))]) + "\n")  # fmt: skip
    mesh = mp.read_mesh(tmp_path / "deck.inp")
    model = mp.assemble(mesh, {"Volume1": mp.Solid(material=STEEL)}, {"root": mp.Interface(group="wall")})
    assert model.rigid.m == pytest.approx(8000.0, rel=1e-12)
    np.testing.assert_array_equal(mesh.nodes("wall"), np.flatnonzero(np.isclose(points[:, 0], 0)))
    assert not [note for note in model.notes if "no property" in note]  # a group that an interface names is in use
    solid = {"Volume1": mp.Solid(material=STEEL)}
    other = mp.assemble(mesh, solid, {"root": mp.Interface(plane=((1.0, 0.0, 0.0), (1.0, 0.0, 0.0)))})
    (note,) = [note for note in other.notes if "no property" in note]
    assert note.startswith(f"{len(faces)} of {len(faces)} ")
    assert note.endswith("(group 'Surface1') and are left out; their groups name nodes only")
