"""What a user says of a system: no numba, and nothing of the solver."""
