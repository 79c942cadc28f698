"""Processes, waiting for them, and the system's limits on both."""
