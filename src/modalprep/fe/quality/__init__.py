"""Quality checks of meshes."""
