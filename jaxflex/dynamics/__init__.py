"""The equations of motion, derived from the energies by autodiff."""
