"""Pipeline files: schema, running, systems."""
