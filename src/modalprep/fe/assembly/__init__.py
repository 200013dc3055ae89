"""Assembly of a mesh and its properties to the finite-element model."""
