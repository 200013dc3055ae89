"""Linear algebra on matrices: factorization, lowest modes, Rayleigh-Ritz."""
