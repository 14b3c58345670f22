"""The arm of Ahmad et al. (2008) carried further: gravity, three links, feedback, shaping, tuning."""
