"""Element families, one file each."""
