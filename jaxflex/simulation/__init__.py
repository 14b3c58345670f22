"""Simulation: an arm, a controller and a reference, integrated by diffrax."""
