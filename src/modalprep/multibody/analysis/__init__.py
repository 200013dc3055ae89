"""Equilibrium, linear equations, vibration and inverse dynamics of a system."""
