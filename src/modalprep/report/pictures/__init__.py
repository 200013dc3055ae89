"""Pictures and films of meshes, modes and systems, drawn off screen."""
