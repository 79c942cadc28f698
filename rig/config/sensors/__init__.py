"""Sections about a sensor: its part, its source, its mounting, and the link's load."""
