"""CAD parts that gmsh's own kernel draws and writes."""

from math import pi

VOLUME = 8 * (80 * 40 - 10**2 * (1 - pi / 4) - pi * (4**2 + 6**2))  # of the plate, mm^3


def plate(occ):
    """Draw 80 x 40 x 8 with holes of radius 4 and 6 and a corner of radius 10."""
    holes = [(3, occ.addCylinder(x, 20, -1, 0, 0, 10, r)) for x, r in ((15, 4), (65, 6))]
    (body, *_), _ = occ.cut([(3, occ.addBox(0, 0, 0, 80, 40, 8))], holes)
    import gmsh

    occ.synchronize()
    edge = gmsh.model.getEntitiesInBoundingBox(79.9, 39.9, -1, 80.1, 40.1, 9, dim=1)
    occ.fillet([body[1]], [tag for _, tag in edge], [10.0])


def draw(folder, shape, name, suffixes=(".step", ".iges", ".brep")):
    import gmsh

    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        shape(gmsh.model.occ)
        gmsh.model.occ.synchronize()
        for suffix in suffixes:
            gmsh.write(str(folder / f"{name}{suffix}"))
    finally:
        gmsh.finalize()
