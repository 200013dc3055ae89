"""Linear algebra on matrices: factorisation, lowest modes, Rayleigh-Ritz."""
