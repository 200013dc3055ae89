"""The reference implementation: the equations of motion with whole matrices, in numpy."""
