"""Cyclic symmetry: modes by nodal diameter from one sector."""
