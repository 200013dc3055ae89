"""Pages in which a body, a mesh or a run is turned and moves; each is one file that loads nothing from elsewhere."""
