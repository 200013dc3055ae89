"""A single free body in momenta and in efficient variables."""
