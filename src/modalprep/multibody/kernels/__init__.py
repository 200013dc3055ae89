"""Compiled equations of motion: arrays only."""
