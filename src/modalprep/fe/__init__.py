"""Finite elements: meshes, properties, families, interfaces; the only home of scikit-fem, meshio, gmsh."""
