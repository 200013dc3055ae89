"""Named time histories of a run."""
