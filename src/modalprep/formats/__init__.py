"""Files: the modal file and simulation results."""
