"""Files that users touch: arm.toml and recordings."""
