"""A flat L-shaped bracket with a bolt hole near each end: `python meshes/bracket.py` writes it as .msh and .step."""

from pathlib import Path

import gmsh

# mm
LENGTH_A = 80.0  # from bolt_a, at the origin, along x to the corner
LENGTH_B = 50.0  # from the corner along y to bolt_b
WIDTH = 24.0  # of both arms; their ends are round
THICKNESS = 8.0  # along z, half of it below z = 0
FILLET = 12.0  # radius of the inner corner
HOLE = 4.5  # radius, the clearance hole of an M8 bolt
SIZE, SIZE_AT_HOLES = 5.0, 2.6  # edge lengths of the elements

BOLTS = {"bolt_a": (0.0, 0.0), "bolt_b": (LENGTH_A, LENGTH_B)}


def outline():
    """Draw the outer contour in the plane z = -THICKNESS / 2 and return its loop."""
    half = WIDTH / 2
    left, right = LENGTH_A - half, LENGTH_A + half

    def point(x, y):
        return gmsh.model.occ.addPoint(x, y, -THICKNESS / 2)

    start = a_low = point(0, -half)
    corner = point(right, -half)
    b_right, b_end, b_left = point(right, LENGTH_B), point(LENGTH_A, LENGTH_B + half), point(left, LENGTH_B)
    fillet_b, fillet_centre, fillet_a = (
        point(left, half + FILLET),
        point(left - FILLET, half + FILLET),
        point(left - FILLET, half),
    )
    a_high, a_end = point(0, half), point(-half, 0)
    line, arc = gmsh.model.occ.addLine, gmsh.model.occ.addCircleArc
    return gmsh.model.occ.addCurveLoop(
        [
            line(start, corner),
            line(corner, b_right),
            arc(b_right, b_end, b_left, center=False),
            line(b_left, fillet_b),
            arc(fillet_b, fillet_centre, fillet_a),
            line(fillet_a, a_high),
            arc(a_high, a_end, a_low, center=False),
        ]
    )


def draw():
    """Extrude the contour less its holes, and name the groups."""
    occ = gmsh.model.occ
    holes = [occ.addCurveLoop([occ.addCircle(*bolt, -THICKNESS / 2, HOLE)]) for bolt in BOLTS.values()]
    face = occ.addPlaneSurface([outline(), *holes])
    body = [tag for dim, tag in occ.extrude([(2, face)], 0, 0, THICKNESS) if dim == 3]
    occ.synchronize()
    gmsh.model.addPhysicalGroup(3, body, name="body")
    for name, (x, y) in BOLTS.items():
        reach, top = HOLE + 0.01, THICKNESS / 2 + 0.01
        box = (x - reach, y - reach, -top, x + reach, y + reach, top)
        wall = [tag for _, tag in gmsh.model.getEntitiesInBoundingBox(*box, dim=2)]
        gmsh.model.addPhysicalGroup(2, wall, name=name)


def mesh():
    """Fill the volume with 10-node tetrahedra, finer at the holes, and bend them onto the curved walls."""
    field = gmsh.model.mesh.field
    walls = [
        tag for _, group in gmsh.model.getPhysicalGroups(2) for tag in gmsh.model.getEntitiesForPhysicalGroup(2, group)
    ]
    distance = field.add("Distance")
    field.setNumbers(distance, "SurfacesList", walls)
    size = field.add("Threshold")
    for key, value in {
        "InField": distance,
        "DistMin": 0.5,
        "DistMax": 2.0 * HOLE,
        "SizeMin": SIZE_AT_HOLES,
        "SizeMax": SIZE,
    }.items():
        field.setNumber(size, key, value)
    field.setAsBackgroundMesh(size)
    gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
    gmsh.option.setNumber("General.NumThreads", 1)  # with more, the mesh may differ from run to run
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.optimize("Netgen")
    gmsh.model.mesh.setOrder(2)
    gmsh.model.mesh.optimize("HighOrder")


if __name__ == "__main__":
    gmsh.initialize()
    gmsh.option.setNumber("General.Verbosity", 2)  # warnings and errors only
    draw()
    gmsh.write(str(Path(__file__).with_suffix(".step")))
    mesh()
    gmsh.write(str(Path(__file__).with_suffix(".msh")))  # 4.1 ASCII, gmsh's default
    gmsh.finalize()
