"""Multibody systems: joints, equations of motion, simulation."""
