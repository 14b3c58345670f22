"""The arm against a simulator that no one here wrote: Exudyn."""
