"""Time integration: step loop, methods, their selection, events."""
