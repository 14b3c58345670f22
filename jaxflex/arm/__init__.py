"""The arm and its energies."""
