"""Finite elements: meshes, properties, element families, interfaces, assembly; the only user of scikit-fem and gmsh."""
