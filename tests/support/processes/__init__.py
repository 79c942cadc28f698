"""Processes, waiting and what the system does to both."""
