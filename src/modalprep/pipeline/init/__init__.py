"""A first pipeline file for a mesh, a deck or a CAD file."""
