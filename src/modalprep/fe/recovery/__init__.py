"""Recovery of forces, moments, stress and accelerations from displacement and acceleration fields."""
