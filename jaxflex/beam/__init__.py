"""Beams: frequency equations, mode shapes, and what a link leaves to the energies."""
