"""From a pipeline file to its modal body."""
