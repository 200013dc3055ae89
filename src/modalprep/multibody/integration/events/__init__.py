"""Events: where their functions cross zero in a step, and what they change."""
