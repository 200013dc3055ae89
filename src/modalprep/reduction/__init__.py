"""Reduction of a model: Guyan, Craig-Bampton, truncation vectors, selection."""
