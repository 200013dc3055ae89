"""A loaded system at one state: accelerations, constraints, callbacks, impacts."""
