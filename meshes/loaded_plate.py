"""A plate of shells that carries a solid block on one half of its end: `python meshes/loaded_plate.py`."""

from pathlib import Path

import gmsh

# m
LENGTH, HALF = 1.2, 0.2  # of the plate along x, half of its width along y; it lies in the plane z = 0
FOOT = 0.2  # of the block: the corner from x = LENGTH - FOOT, y = 0
HEIGHT, LAYERS = 0.1, 2  # of the block, above the plate
SIZE = 0.1  # of an element


def draw():
    """Draw the plate in four rectangles, the block on one of them; all have whole elements."""
    geo = gmsh.model.geo
    xs, ys = (0.0, LENGTH - FOOT, LENGTH), (-HALF, 0.0, HALF)
    points = [[geo.addPoint(x, y, 0) for y in ys] for x in xs]
    along = [[geo.addLine(points[i][j], points[i + 1][j]) for j in range(3)] for i in range(2)]
    across = [[geo.addLine(points[i][j], points[i][j + 1]) for j in range(2)] for i in range(3)]
    faces = []
    for i in range(2):
        for line in along[i]:
            geo.mesh.setTransfiniteCurve(line, 1 + round((xs[i + 1] - xs[i]) / SIZE))
        for j in range(2):
            loop = geo.addCurveLoop([along[i][j], across[i + 1][j], -along[i][j + 1], -across[i][j]])
            faces.append(geo.addPlaneSurface([loop]))
            geo.mesh.setTransfiniteSurface(faces[-1])
            geo.mesh.setRecombine(2, faces[-1])
    for line in (line for column in across for line in column):
        geo.mesh.setTransfiniteCurve(line, 1 + round(HALF / SIZE))
    block = geo.extrude([(2, faces[3])], 0, 0, HEIGHT, numElements=[LAYERS], recombine=True)
    geo.synchronize()
    for dim, tags, name in (
        (2, faces, "plate"),
        (3, [tag for dim, tag in block if dim == 3], "block"),
        (1, across[0], "root"),
        (0, [points[2][0]], "free_corner"),
        (0, [points[2][2]], "loaded_corner"),
    ):
        gmsh.model.addPhysicalGroup(dim, tags, name=name)


if __name__ == "__main__":
    gmsh.initialize()
    gmsh.option.setNumber("General.Verbosity", 2)  # warnings and errors only
    draw()
    gmsh.model.mesh.generate(3)
    gmsh.write(str(Path(__file__).with_name("loaded-plate.msh")))  # 4.1 ASCII, gmsh's default
    gmsh.finalize()
