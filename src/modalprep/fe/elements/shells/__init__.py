"""Shells and their laminates."""
