"""Scenes as data for the viewer of pages, which WebGL draws."""
