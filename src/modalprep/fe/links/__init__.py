"""Rigid and averaging links, and the interfaces of a body."""
