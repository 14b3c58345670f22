"""Gradient tuning against methods that need no gradient, at equal simulations and at equal time."""
