"""Systems whose number of bodies changes."""
