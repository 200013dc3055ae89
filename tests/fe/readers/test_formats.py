"""One mixed model in six file formats: whatever the road, the same frequencies."""

from dataclasses import dataclass
from pathlib import Path

import meshio
import numpy as np
import pytest
from fe.ansys_decks import deck, eblock, nblock
from structured import box, grid_cells

import modalprep as mp

STEP, NX, NY = 25.0, 8, 4  # mm; the plate lies on z = 0
SCALE = {"m": 1.0, "mm": 1e-3}
ALUMINIUM = mp.Material(E=70e9, nu=0.33, rho=2700.0)
STEEL = mp.Material(E=210e9, nu=0.3, rho=7800.0)
SECTIONS = {
    "plate": mp.Shell(material=ALUMINIUM, thickness=2e-3),
    "block": mp.Solid(material=ALUMINIUM),
    "post": mp.Beam(material=STEEL, A=1e-4, Iy=1e-9, Iz=6e-10, J=1.2e-9, ky=0.5, kz=0.5, up=(1.0, 0.0, 0.0)),
    "tie": mp.Truss(material=STEEL, A=5e-5),
    "tip": mp.PointMass(mass=2.0, inertia=(1e-3, 2e-3, 2.5e-3, 1e-4, 0.0, 0.0)),
}
TOLERANCE = 1e-9  # every number is written with all its digits


@dataclass
class Parts:
    """Points (mm) and the cells of each group by kind."""

    points: np.ndarray
    cells: dict[str, dict[str, np.ndarray]]

    def blocks(self) -> list[tuple[str, str, np.ndarray]]:
        return [(group, kind, conn) for group, kinds in self.cells.items() for kind, conn in kinds.items()]


@pytest.fixture(scope="module")
def parts() -> Parts:
    """A plate of quads and triangles with a block on it, a post with a mass on top and a bar down to a corner."""
    x, y = np.meshgrid(STEP * np.arange(NX + 1), STEP * np.arange(NY + 1), indexing="ij")
    plate = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1)
    quads = grid_cells(NX, NY)
    split = quads[:, 0] >= (NX // 2) * (NY + 1)
    triangles = np.concatenate([quads[split][:, [0, 1, 2]], quads[split][:, [0, 2, 3]]])
    block, bricks = box("hexahedron", (2, 2, 2), (2 * STEP, 2 * STEP, 2 * STEP))
    post = np.array([[6 * STEP, 2 * STEP, STEP * k] for k in range(5)])
    every = np.concatenate([plate, np.add(block, [STEP, STEP, 0.0]), post])
    points, number = np.unique(every, axis=0, return_inverse=True)
    number = number.ravel()
    in_block, in_post = number[len(plate) :], number[len(plate) + len(block) :]
    corner = number[NX * (NY + 1)]
    return Parts(points, {
        "plate": {"quad": number[quads[~split]], "triangle": number[triangles]},
        "block": {"hexahedron": in_block[bricks]},
        "post": {"line": np.stack([in_post[:-1], in_post[1:]], axis=1)},
        "tie": {"line": np.array([[in_post[-1], corner]])},
        "tip": {"vertex": in_post[-1:, None]},
        "root": {"vertex": np.flatnonzero(points[:, 0] == 0)[:, None]},
    })  # fmt: skip


def frequencies(mesh: mp.fe.Mesh, sections: dict, root: str | None = "root") -> np.ndarray:
    """Ten lowest frequencies (Hz), clamped along the edge x = 0."""
    edge = mp.Interface(group=root) if root else mp.Interface(plane=((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)))
    model = mp.assemble(mesh, sections, {"root": edge})
    assert model.notes == ()
    return mp.craig_bampton(model, modes=10).table.frequency[:10]


@pytest.fixture(scope="module")
def expected(parts) -> np.ndarray:
    """Of the mesh made in memory."""
    cells, groups = {}, {}
    for group, kind, conn in parts.blocks():
        first = len(cells.get(kind, ()))
        cells[kind] = np.concatenate([cells[kind], conn]) if kind in cells else conn
        groups.setdefault(group, {})[kind] = np.arange(first, len(cells[kind]))
    return frequencies(mp.fe.Mesh(points=1e-3 * parts.points, cells=cells, groups=groups), SECTIONS)


def test_every_part_matters(parts, expected):
    """The comparisons below cannot pass by leaving something out."""
    assert np.all(np.diff(expected) > 1e-4 * expected[:-1])
    for name, other in {
        "plate": mp.Shell(material=ALUMINIUM, thickness=2.001e-3),
        "block": mp.Solid(material=mp.Material(E=69e9, nu=0.33, rho=2690.0)),
        "post": mp.Beam(material=STEEL, A=1e-4, Iy=1e-9, Iz=6e-10, J=1.2e-9, ky=0.5, kz=0.5, up=(0.0, 1.0, 0.0)),
        "tie": mp.Truss(material=STEEL, A=4.9e-5),
        "tip": mp.PointMass(mass=2.0, inertia=(1e-3, 2e-3, 2.5e-3, 0.0, 0.0, 0.0)),
    }.items():
        cells = {f"{group}_{kind}": (kind, conn) for group, kind, conn in parts.blocks()}
        mesh = in_memory(parts, cells)
        sections = {key: other if key.startswith(name) else SECTIONS[key.partition("_")[0]]
                    for key in cells if not key.startswith("root")}  # fmt: skip
        assert np.abs(frequencies(mesh, sections, "root_vertex") / expected - 1).max() > 1e3 * TOLERANCE, name


def in_memory(parts: Parts, cells: dict) -> mp.fe.Mesh:
    """One group for every block."""
    stacked, groups = {}, {}
    for name, (kind, conn) in cells.items():
        first = len(stacked.get(kind, ()))
        stacked[kind] = np.concatenate([stacked[kind], conn]) if kind in stacked else conn
        groups[name] = {kind: np.arange(first, len(stacked[kind]))}
    return mp.fe.Mesh(points=1e-3 * parts.points, cells=stacked, groups=groups)


# --- Gmsh ---------------------------------------------------------------------------------------------------------

DIMENSION = {"vertex": 0, "line": 1, "triangle": 2, "quad": 2, "hexahedron": 3}


def physical_names(parts: Parts) -> dict[str, np.ndarray]:
    """{group: (number, dimension)} as meshio wants them."""
    return {g: np.array([k, DIMENSION[next(iter(parts.cells[g]))]]) for k, g in enumerate(parts.cells, 1)}


def write_msh41(parts: Parts, file, unit: str) -> None:
    """Write one entity per block; meshio only writes entities that own a node, so that each takes one first."""
    names, blocks = physical_names(parts), parts.blocks()
    tags = [(DIMENSION[kind], number) for number, (_, kind, _) in enumerate(blocks, 1)]
    owner = np.full(len(parts.points), -1)
    for k in sorted(range(len(blocks)), key=lambda k: blocks[k][2].size):
        nodes = np.unique(blocks[k][2])
        owner[nodes[owner[nodes] < 0][0]] = k
    for k, (_, _, conn) in enumerate(blocks):
        nodes = np.unique(conn)
        owner[nodes[owner[nodes] < 0]] = k
    data = {
        "gmsh:physical": [np.full(len(conn), names[group][0]) for group, _, conn in blocks],
        "gmsh:geometrical": [np.full(len(conn), tag) for (_, tag), (_, _, conn) in zip(tags, blocks, strict=True)],
    }
    mesh = meshio.Mesh(
        parts.points * (1e-3 / SCALE[unit]), [(kind, conn) for _, kind, conn in blocks], cell_data=data,
        point_data={"gmsh:dim_tags": np.array(tags)[owner]}, field_data=names,
    )  # fmt: skip
    mesh.write(file, file_format="gmsh", binary=False)


@pytest.mark.parametrize("unit", ["m", "mm"])
def test_msh_41(parts, expected, tmp_path, unit):
    file = tmp_path / "mixed.msh"
    write_msh41(parts, file, unit)
    assert file.read_text().startswith("$MeshFormat\n4.1 0")
    mesh = mp.read_mesh(file, unit)
    assert set(mesh.groups) == set(parts.cells)
    assert frequencies(mesh, SECTIONS) == pytest.approx(expected, rel=TOLERANCE)


def test_msh_22_counts_an_element_of_two_groups_once(parts, expected, tmp_path):
    """In .msh 2.2 the second group lists its elements again."""
    names = physical_names(parts) | {"corner": np.array([20, 2]), "top": np.array([21, 1])}
    blocks = [(names[group][0], kind, conn) for group, kind, conn in parts.blocks()]
    again = {"corner": ("quad", parts.cells["plate"]["quad"][3:7]), "top": ("line", parts.cells["post"]["line"][-2:])}
    blocks += [(names[group][0], kind, conn) for group, (kind, conn) in again.items()]
    numbers = [np.full(len(conn), number) for number, _, conn in blocks]
    mesh = meshio.Mesh(
        1e-3 * parts.points, [(kind, conn) for _, kind, conn in blocks],
        cell_data={"gmsh:physical": numbers, "gmsh:geometrical": numbers}, field_data=names,
    )  # fmt: skip
    file = tmp_path / "mixed.msh"
    mesh.write(file, file_format="gmsh22", binary=False)
    assert "$MeshFormat\n2.2 0" in file.read_text()
    found = mp.read_mesh(file)
    assert {kind: len(c) for kind, c in found.cells.items()} == {
        "quad": 16, "triangle": 32, "hexahedron": 8, "line": 5, "vertex": 1 + NY + 1,
    }  # fmt: skip
    for group, (kind, conn) in again.items():
        assert np.array_equal(found.group(group)[kind], conn)
    assert frequencies(found, SECTIONS) == pytest.approx(expected, rel=TOLERANCE)


# --- Abaqus -------------------------------------------------------------------------------------------------------

ABAQUS = {"quad": "S4R", "triangle": "S3", "hexahedron": "C3D8", "line": "B31"}


def numbered(parts: Parts, start: int = 100) -> list[tuple[str, str, np.ndarray, np.ndarray]]:
    """(group, kind, element numbers, connectivity) of all but points."""
    found = []
    for group, kind, conn in parts.blocks():
        if kind != "vertex":
            found.append((group, kind, start + np.arange(len(conn)), conn))
            start += len(conn) + 10
    return found


def abaqus_nodes(parts: Parts) -> list[str]:
    """Number the nodes 11, 12, ..., those of the root in one run."""
    lines = ["*HEADING", "a plate and what stands on it", "** in mm", "*NODE"]
    return lines + [f"{k}, {x!r}, {y!r}, {z!r}" for k, (x, y, z) in enumerate(parts.points.tolist(), 11)]


def abaqus_node_sets(parts: Parts) -> list[str]:
    root, tip = (parts.cells[name]["vertex"].ravel() + 11 for name in ("root", "tip"))
    assert root.tolist() == list(range(root[0], root[-1] + 1))  # np.unique sorts by x first
    return ["*NSET, NSET=root, GENERATE", f"{root[0]}, {root[-1]}, 1", "*NSET, NSET=tip", f"{tip[0]},"]


def test_inp_with_element_sets(parts, expected, tmp_path):
    lines = abaqus_nodes(parts)
    sets: dict[str, list[str]] = {}
    for group, kind, numbers, conn in numbered(parts):
        lines.append(f"*ELEMENT, TYPE={'T3D2' if group == 'tie' else ABAQUS[kind]}")
        lines += [
            ", ".join(map(str, (number, *nodes))) for number, nodes in zip(numbers, (conn + 11).tolist(), strict=True)
        ]
        sets.setdefault(group, []).extend(map(str, numbers))
    for group, members in sets.items():
        if group == "post":
            lines += ["*ELSET, ELSET=post, GENERATE", f"{members[0]}, {members[-1]}, 1"]
        else:
            lines.append(f"*ELSET, ELSET={group}")
            lines += [", ".join(members[k : k + 16]) + "," for k in range(0, len(members), 16)]
    file = tmp_path / "mixed.inp"
    file.write_text("\n".join([*lines, *abaqus_node_sets(parts), "*MATERIAL, NAME=aluminium", ""]))
    mesh = mp.read_mesh(file, "mm")
    assert {kind: len(c) for kind, c in mesh.group("plate").items()} == {"quad": 16, "triangle": 32}
    assert frequencies(mesh, SECTIONS) == pytest.approx(expected, rel=TOLERANCE)


def test_inp_with_sets_named_on_the_elements(parts, expected, tmp_path):
    lines = abaqus_nodes(parts)
    sections = {}
    for group, kind, numbers, conn in numbered(parts):
        name = f"{group}_{kind}"
        sections[name] = SECTIONS[group]
        lines.append(f"*ELEMENT, TYPE={'T3D2' if group == 'tie' else ABAQUS[kind]}, ELSET={name}")
        lines += [
            ", ".join(map(str, (number, *nodes))) for number, nodes in zip(numbers, (conn + 11).tolist(), strict=True)
        ]
    file = tmp_path / "mixed.inp"
    file.write_text("\n".join([*lines, *abaqus_node_sets(parts), ""]))
    sections["tip"] = SECTIONS["tip"]
    assert frequencies(mp.read_mesh(file, "mm"), sections) == pytest.approx(expected, rel=TOLERANCE)


def shared_elset(parts: Parts, bare: tuple[str, ...]) -> str:
    """One ELSET name on the quads and on the triangles, as HyperMesh writes; `bare` groups get theirs by *ELSET."""
    lines, after = abaqus_nodes(parts), []
    for group, kind, numbers, conn in numbered(parts):
        name = "" if group in bare else f", ELSET={group}"
        lines.append(f"*ELEMENT, TYPE={'T3D2' if group == 'tie' else ABAQUS[kind]}{name}")
        lines += [
            ", ".join(map(str, (number, *nodes))) for number, nodes in zip(numbers, (conn + 11).tolist(), strict=True)
        ]
        if group in bare:
            after += [f"*ELSET, ELSET={group}, GENERATE", f"{numbers[0]}, {numbers[-1]}, 1"]
    return "\n".join([*lines, *after, *abaqus_node_sets(parts), ""])


@pytest.mark.parametrize("bare", [(), ("block",)], ids=["all named", "one by *ELSET"])
def test_inp_with_one_set_of_two_element_types(parts, expected, tmp_path, bare):
    file = tmp_path / "mixed.inp"
    file.write_text(shared_elset(parts, bare))
    mesh = mp.read_mesh(file, "mm")
    assert {kind: len(c) for kind, c in mesh.group("plate").items()} == {"quad": 16, "triangle": 32}
    assert frequencies(mesh, SECTIONS) == pytest.approx(expected, rel=TOLERANCE)


# --- Nastran ------------------------------------------------------------------------------------------------------


def card(name: str, *fields: float | int | str) -> list[str]:
    """Write a card in large fields, 16 columns each, four to a line."""
    words = [nastran(value) for value in fields]
    lines = [words[k : k + 4] for k in range(0, len(words), 4)]
    return [f"{f'{name}*' if k == 0 else '*':<8}" + "".join(f"{word:<16}" for word in line)
            for k, line in enumerate(lines)]  # fmt: skip


def nastran(value: float | int | str) -> str:
    """Write a number in at most 16 columns that hold all its digits; reals need a point and no E."""
    if not isinstance(value, float):
        return str(value)
    digits, _, power = repr(value).partition("e")
    word = digits + ("" if "." in digits else ".") + (f"{int(power):+d}" if power else "")
    assert len(word) <= 16
    return word


def test_bdf_brings_everything_itself(parts, expected, tmp_path):
    """In mm, t and s: Pa are 1e-6 MPa, kg/m^3 are 1e-12 t/mm^3."""
    lines = ["SOL 103", "CEND", "SPC = 7", "BEGIN BULK"]
    for k, point in enumerate(parts.points.tolist(), 1):
        lines += card("GRID", k, "", *point)
    kinds = {"quad": ("CQUAD4", 1), "triangle": ("CTRIA3", 1), "hexahedron": ("CHEXA", 2), "line": ("CBAR", 3)}
    for group, kind, numbers, conn in numbered(parts):
        name, section = ("CROD", 4) if group == "tie" else kinds[kind]
        for number, nodes in zip(numbers, (conn + 1).tolist(), strict=True):
            lines += card(name, number, section, *nodes, *((1.0, 0.0, 0.0) if name == "CBAR" else ()))
    lines += card("MAT1", 1, 70000.0, "", 0.33, 2.7e-9) + card("MAT1", 2, 210000.0, "", 0.3, 7.8e-9)
    lines += card("PSHELL", 1, 1, 2.0, 1, "", 1) + card("PSOLID", 2, 1)
    lines += card("PBAR", 3, 2, 100.0, 1000.0, 600.0, 1200.0, *[""] * 10, 0.5, 0.5) + card("PROD", 4, 2, 50.0)
    (tip,) = parts.cells["tip"]["vertex"].ravel() + 1
    lines += card("CONM2", 900, tip, "", 2e-3, *[""] * 4, 1.0, -0.1, 2.0, "", "", 2.5)
    root = parts.cells["root"]["vertex"].ravel() + 1
    lines += [f"SPC1,7,123456,{root[0]},THRU,{root[-1]}", "ENDDATA", ""]
    file = tmp_path / "mixed.bdf"
    file.write_text("\n".join(lines))
    mesh = mp.read_mesh(file, "mm", "t")
    assert frequencies(mesh, {}, "spc_7") == pytest.approx(expected, rel=TOLERANCE)


# --- Ansys --------------------------------------------------------------------------------------------------------


def test_cdb_brings_everything_itself(parts, expected, tmp_path):
    """In mm, t and s; MASS21 has no products of inertia, so that the pipeline file gives the tip."""
    away = (1000.0, float(parts.points[parts.cells["tip"]["vertex"][0, 0], 1]), 0.0)  # says where z of the post is
    lines = [*nblock([*parts.points.tolist(), away]), "ET,1,181", "ET,2,185", "ET,3,4", "ET,4,180", "ET,5,21"]
    lines += ["MP,EX,1,7e4", "MP,NUXY,1,.33", "MP,DENS,1,2.7e-9", "MP,EX,2,2.1e5", "MP,NUXY,2,.3", "MP,DENS,2,7.8e-9"]
    lines += ["SECTYPE,1,SHELL", "SECBLOCK,1", "2.0,1,0,5", "R,3,100,600,1000", "RMORE,0,1200,2,2", "R,4,50"]
    lines += ["R,5,2e-3,2e-3,2e-3"]
    kinds = {"plate": (1, 1), "block": (2, 1), "post": (3, 2), "tie": (4, 2), "tip": (5, 1)}
    first = 1
    for group, kind, conn in parts.blocks():
        if group != "root":
            rows = (conn + 1).tolist()
            rows = [[*row, row[-1]] for row in rows] if kind == "triangle" else rows
            rows = [[*row, len(parts.points) + 1] for row in rows] if group == "post" else rows
            number, material = kinds[group]
            lines += eblock(*rows, kind=number, material=material, real=number, section=number, first=first)
            first += len(rows)
    root = parts.cells["root"]["vertex"].ravel() + 1
    lines += ["CMBLOCK,root,NODE,2", "(8i10)", f"{root[0]:10d}{-root[-1]:10d}"]
    mesh = mp.read_mesh(deck(tmp_path, lines), "mm", "t")
    assert frequencies(mesh, {"type5_real5": SECTIONS["tip"]}) == pytest.approx(expected, rel=TOLERANCE)


# --- VTK ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("binary", [True, False], ids=["binary", "ascii"])
def test_vtu_with_an_integer_array(parts, expected, tmp_path, binary):
    blocks = [block for block in parts.blocks() if block[0] != "root"]
    numbers = {group: k for k, group in enumerate(parts.cells, 1)}
    data = {"part": [np.full(len(conn), numbers[group]) for group, _, conn in blocks]}
    file = tmp_path / "mixed.vtu"
    mesh = meshio.Mesh(parts.points, [(kind, conn) for _, kind, conn in blocks], cell_data=data)
    mesh.write(file, binary=binary)
    sections = {f"part_{numbers[group]}": section for group, section in SECTIONS.items()}
    assert frequencies(mp.read_mesh(file, "mm"), sections, None) == pytest.approx(expected, rel=TOLERANCE)


@pytest.mark.parametrize("writer", ["meshio", "vtk"])
def test_wedges_of_a_vtu_stand_upright(tmp_path, writer):
    """VTK and meshio number the nodes of a wedge in opposite senses; both files must give a positive volume."""
    points = np.array([[5.0, 7, 9], [6, 7, 9], [5, 8, 9], [5, 7, 10], [6, 7, 10], [5, 8, 10]])
    file = tmp_path / "wedge.vtu"
    if writer == "meshio":
        meshio.Mesh(points, [("wedge", np.arange(6)[None])]).write(file)
    else:
        pyvista = pytest.importorskip("pyvista")
        pyvista.UnstructuredGrid({pyvista.CellType.WEDGE: np.arange(6)[None]}, points).save(file)
    mesh = mp.read_mesh(file)
    a, b, c, *_, top = mesh.points[mesh.cells["wedge"][0]]
    assert np.dot(np.cross(b - a, c - a), top - a) > 0


@pytest.mark.parametrize("name", ["beam.msh", "bracket.msh"])
def test_a_byte_order_mark_is_passed_over(tmp_path, name):
    """Editors of Windows write one before the text."""
    good = Path(__file__).parents[3] / "meshes" / name
    (tmp_path / name).write_bytes(b"\xef\xbb\xbf" + good.read_bytes())
    found, expected = mp.read_mesh(tmp_path / name), mp.read_mesh(good)
    np.testing.assert_array_equal(found.points, expected.points)
    assert {kind: rows.tolist() for kind, rows in found.cells.items()} == {
        k: r.tolist() for k, r in expected.cells.items()
    }
    assert list(found.groups) == list(expected.groups)


def test_xdmf_with_its_arrays_in_a_file_beside_it(tmp_path):
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    meshio.Mesh(points, [("tetra", np.arange(4)[None])]).write(tmp_path / "a.xdmf")
    assert (tmp_path / "a.h5").exists()
    np.testing.assert_array_equal(mp.read_mesh(tmp_path / "a.xdmf").points, points)
