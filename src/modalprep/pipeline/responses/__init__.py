"""Responses of the body of a pipeline file: spectra, notches, shock, fatigue."""
