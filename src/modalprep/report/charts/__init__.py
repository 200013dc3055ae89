"""Charts of matplotlib: their style, histories, effective masses, and their files."""
