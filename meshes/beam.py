"""A beam of 40 line elements, 10 m along x, with named ends: `python meshes/beam.py` writes beam.msh."""

from pathlib import Path

import gmsh

LENGTH = 10.0  # m
ELEMENTS = 40


def build():
    """Draw the line, name its groups and mesh it."""
    root = gmsh.model.geo.addPoint(0, 0, 0)
    tip = gmsh.model.geo.addPoint(LENGTH, 0, 0)
    beam = gmsh.model.geo.addLine(root, tip)
    gmsh.model.geo.mesh.setTransfiniteCurve(beam, ELEMENTS + 1)
    gmsh.model.geo.synchronize()
    gmsh.model.addPhysicalGroup(1, [beam], name="beam")
    gmsh.model.addPhysicalGroup(0, [root], name="root")
    gmsh.model.addPhysicalGroup(0, [tip], name="tip")
    gmsh.model.mesh.generate(1)


if __name__ == "__main__":
    gmsh.initialize()
    gmsh.option.setNumber("General.Verbosity", 2)  # warnings and errors only
    build()
    gmsh.write(str(Path(__file__).with_suffix(".msh")))  # 4.1 ASCII, gmsh's default
    gmsh.finalize()
