"""What is wrong with a mesh."""
