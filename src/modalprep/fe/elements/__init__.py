"""Element families, one a file."""
