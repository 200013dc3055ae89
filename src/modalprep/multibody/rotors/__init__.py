"""Rotors: whirl about a steady rotation, Campbell diagrams, critical speeds."""
