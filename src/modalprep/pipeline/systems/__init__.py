"""From a pipeline file to its multibody system."""
