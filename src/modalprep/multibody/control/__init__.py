"""Control on the linear equations of a system: regulators, estimators, truncation."""
