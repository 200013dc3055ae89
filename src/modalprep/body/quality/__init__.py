"""What the modes of a body are called, and whether mesh, mass and units of a body are plausible."""
