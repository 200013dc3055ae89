"""Tables of responses, and of shock spectra and damage."""
