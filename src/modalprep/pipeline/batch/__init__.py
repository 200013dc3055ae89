"""Many pipeline files in parallel."""
