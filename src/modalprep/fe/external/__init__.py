"""Finite-element models of matrices that other programs assembled."""
