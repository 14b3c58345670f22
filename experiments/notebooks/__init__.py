"""Notebooks, executed and stored with their outputs; `python -m experiments.notebooks` runs them again."""
