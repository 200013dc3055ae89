"""Nastran bulk data decks."""
