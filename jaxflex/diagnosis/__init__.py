"""Where a model and its recordings disagree, and what is missing."""
