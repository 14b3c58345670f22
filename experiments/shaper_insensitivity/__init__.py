"""How far off may the mode be: insensitivity of every shaper, and what it costs in time."""
