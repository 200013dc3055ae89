"""What a user adds to the elements of a model: forms of scikit-fem, elastic foundations, mass on faces and lines."""
