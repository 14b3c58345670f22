"""Table 1 by a simulated impact hammer."""
