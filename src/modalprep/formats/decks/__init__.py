"""Whole systems as input of other multibody programs."""
