"""Frequencies, linearisation, and measures of how well a move went."""
