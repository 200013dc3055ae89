"""Division of a mesh into parts that follow each other from the root: theory 4.10."""
