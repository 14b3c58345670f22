"""Residual vibration against move time, and how a tuned design fares on arms it was not tuned on."""
