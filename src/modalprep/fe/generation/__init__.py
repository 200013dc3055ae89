"""Meshes of parametric shapes, by gmsh."""
