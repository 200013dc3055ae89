"""Stations: the large deflection of one body by frames of its parts (theory 4.10)."""
