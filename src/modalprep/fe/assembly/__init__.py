"""From a mesh and its properties to the finite-element model."""
