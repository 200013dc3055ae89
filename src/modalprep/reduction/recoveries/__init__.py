"""What modes contribute to the recovered quantities of a model: choice of modes, convergence, errors."""
