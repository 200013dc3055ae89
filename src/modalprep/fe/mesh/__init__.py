"""Meshes: points, cells, node sets, reference cells."""
