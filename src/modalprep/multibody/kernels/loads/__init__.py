"""Compiled loads: force laws, gravity, masses that change."""
