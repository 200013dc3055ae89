"""What a pipeline file asks of the responses of its body: spectra, notches, shock, fatigue."""
