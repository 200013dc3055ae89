"""The page of a run of a system: method, audits, extremes, plots, film, inputs, sign-off."""
