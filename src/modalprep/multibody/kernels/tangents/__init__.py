"""Exact derivatives of the inverse dynamics of a tree, in compiled sweeps."""
