"""Compiled closed loops and motion constraints: rows, responses to their multipliers, projection."""
