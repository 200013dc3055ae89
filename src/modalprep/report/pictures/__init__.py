"""Pictures and animations of meshes, modes and systems, drawn off screen."""
