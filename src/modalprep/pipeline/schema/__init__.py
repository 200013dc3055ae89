"""Schema of pipeline files."""
