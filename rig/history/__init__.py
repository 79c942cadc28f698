"""The laboratory's memory: every finished run, what became of each sensor since, and of the rig itself."""
