"""Sensitivity of the stiffness and mass of a model to its properties (theory 1.7)."""
