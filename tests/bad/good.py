"""Good inputs, from each of which the catalogue makes many bad ones by one change."""

import shutil
from pathlib import Path

import meshio
import numpy as np
from scipy.io import mmwrite
from scipy.sparse import coo_matrix
from toml_beams import SLENDER

import modalprep as mp
from modalprep.examples import cantilever_model, uniform_beam

MESHES = Path(__file__).parents[2] / "meshes"
BEAM = (
    SLENDER.format(mesh="beam.msh")
    + """
[reduction]
modes = 3

[output]
pictures = "none"
"""
)
SOLID = """
[mesh]
file = "bracket.msh"
length_unit = "mm"

[materials.alloy]
E = 7e10
nu = 0.33
rho = 2700.0

[properties.body]
type = "solid"
material = "alloy"

[interfaces.bolt]
group = "bolt_a"

[reduction]
modes = 2

[output]
pictures = "none"
"""
HINGE = """
[joints.hinge]
type = "revolute"
child = "job.root"

[simulation]
t_end = 0.01
"""
SYSTEM = """
[bodies.arm]
file = "body.h5"

[bodies.bob]
mass = 2.0
inertia = [0.1, 0.1, 0.1]

[joints.hinge]
type = "revolute"
child = "arm.root"

[joints.wrist]
type = "revolute"
parent = "arm.tip"
child = "bob.root"

[forces.push]
at = "arm.tip"
force = [0, "sin(t)", 0]

[springs.rope]
between = ["ground", "bob.root"]
stiffness = 10.0
position = [10, 3, 0]

[environment]
gravity = [0, -9.81, 0]

[simulation]
t_end = 0.01
"""
SECTION = BEAM[BEAM.index("[properties") : BEAM.index("[interfaces")]
SHEET = '[properties.skin]\ntype = "shell"\nmaterial = "alloy"\nthickness = 0.01\n\n'
PLATE = (
    BEAM.replace("beam.msh", "plate.inp")
    .replace(SECTION, SHEET)
    .replace('group = "root"\nkind = "node"', 'group = "edge"\nkind = "rbe2"')
)
INP = """*HEADING
a plate of two squares
*NODE
1, 0, 0, 0
2, 1, 0, 0
3, 2, 0, 0
4, 0, 1, 0
5, 1, 1, 0
6, 2, 1, 0
*ELEMENT, TYPE=S4R, ELSET=skin
1, 1, 2, 5, 4
2, 2, 3, 6, 5
*NSET, NSET=edge
1, 4
*ELSET, ELSET=half, GENERATE
1, 2, 1
"""
DECK = """
[mesh]
file = "deck.bdf"

[interfaces.root]
node = 1

[reduction]
modes = 3

[output]
pictures = "none"
"""
BDF = """SOL 103
CEND
BEGIN BULK
GRID,1,,0.,0.,0.
GRID,2,,1.,0.,0.
GRID,3,,2.,0.,0.
CBAR,11,5,1,2,0.,0.,1.
CBAR,12,5,2,3,0.,0.,1.
PBAR,5,7,4.-4,8.-7,2.-7,5.-7
MAT1,7,7.+10,,.3,3000.
ENDDATA
"""
MATRICES = """
[matrices]
stiffness = "k.mtx"
mass = "m.mtx"
nodes = "nodes.csv"

[interfaces.root]
node = 1

[reduction]
modes = 3

[output]
pictures = "none"
"""
PIPELINES = {"job": BEAM, "system": SYSTEM, "solid": SOLID, "plate": PLATE, "deck": DECK, "matrices": MATRICES}


def write_good(folder: Path) -> Path:
    """Write all pipeline files of `PIPELINES`, each with the files that it names, and a result."""
    for name, text in PIPELINES.items():
        (folder / f"{name}.toml").write_text(text)
    for name in ("beam.msh", "bracket.msh"):
        shutil.copy(MESHES / name, folder)
    (folder / "plate.inp").write_text(INP)
    (folder / "deck.bdf").write_text(BDF)
    write_plate(folder / "plate.vtu")
    root = {"position": np.zeros(3), "axes": np.eye(3), "components": ("xx", "torsion"), "modes": np.ones((2, 2))}
    mp.write_body(uniform_beam(modes=2).with_(stress={"root": mp.body.StressModes(**root)}), folder / "body.h5")
    run = mp.Result(time=np.arange(3.0), channels={"a.angle": np.ones(3)}, status="done", message="")
    mp.write_result(run, folder / "run.h5")
    write_matrices(folder)
    return folder


def write_plate(path: Path) -> None:
    """Write the plate of `INP` as a file of VTK, its elements in the group skin_1."""
    points = np.array([(x, y, 0.0) for y in (0, 1) for x in (0, 1, 2)])
    quads = np.array([[0, 1, 4, 3], [1, 2, 5, 4]])
    meshio.write(path, meshio.Mesh(points, [("quad", quads)], cell_data={"skin": [np.array([1, 1])]}), binary=False)


def write_matrices(folder: Path) -> None:
    """Write stiffness, mass and nodes of a beam of four elements, in each of their files."""
    model = cantilever_model(4)
    for name, A in (("k", model.K), ("m", model.M)):
        mmwrite(folder / f"{name}.mtx", coo_matrix(A), precision=17, symmetry="symmetric")
    np.savetxt(folder / "nodes.csv", model.points, delimiter=",")
    np.savez(folder / "model.npz", K=model.K.toarray(), M=model.M.toarray(), nodes=model.points)


def write_lines(folder, points, lines):
    """Write beam.msh in format 2.2 (cell data, no cell sets): groups root (first node) and beam (all lines)."""
    cells = [("vertex", np.array([[0]])), ("line", np.array(lines))]
    numbers = [np.array([1]), np.full(len(lines), 2)]
    mesh = meshio.Mesh(
        np.array(points, dtype=float),
        cells,
        cell_data={"gmsh:physical": numbers, "gmsh:geometrical": numbers},
        field_data={"root": np.array([1, 0]), "beam": np.array([2, 1])},
    )
    meshio.gmsh.write(folder / "beam.msh", mesh, fmt_version="2.2", binary=False)


CORNERS = [(1, 1, 1), (2, 1, 1), (1, 2, 1), (1, 1, 2)]
TET = SOLID.replace("bracket.msh", "tet.msh").replace('length_unit = "mm"\n', "")


def write_tets(folder, corners, elements, held=(0, 1, 2), rod=()):
    """Write tet.msh: straight tetra10 (group body), held corners (bolt_a), a line from a corner (rod)."""
    points, middle, conn = [tuple(p) for p in corners], {}, []
    edges = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
    for e in elements:
        for a, b in edges:
            if frozenset((e[a], e[b])) not in middle:
                middle[frozenset((e[a], e[b]))] = len(points)
                points.append(tuple(np.mean([corners[e[a]], corners[e[b]]], axis=0)))
        conn.append([*e, *(middle[frozenset((e[a], e[b]))] for a, b in edges)])
    cells = [("tetra10", np.array(conn)), ("vertex", np.array(held)[:, None])]
    numbers = [np.full(len(conn), 1), np.full(len(held), 2)]
    if rod:
        cells.append(("line", np.array([[rod[0], len(points)]])))
        numbers.append(np.array([3]))
        points.append(rod[1])
    names = {"body": np.array([1, 3]), "bolt_a": np.array([2, 0]), "rod": np.array([3, 1])}
    data = {"gmsh:physical": numbers, "gmsh:geometrical": numbers}
    mesh = meshio.Mesh(np.array(points, dtype=float), cells, cell_data=data, field_data=names)
    meshio.gmsh.write(folder / "tet.msh", mesh, fmt_version="2.2", binary=False)
