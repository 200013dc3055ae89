"""The modal body: integrals, geometric stiffness, checks."""
