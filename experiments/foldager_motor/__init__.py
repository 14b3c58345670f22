"""The DC motor alone, against its transfer functions."""
