"""Mesh files and decks of other programs."""
