"""Algebra on tuples, compiled into the kernels: no array, no slice, everything in registers."""
