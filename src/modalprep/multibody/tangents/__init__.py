"""Exact derivatives of the equations of motion."""
