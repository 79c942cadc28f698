"""Sections about a sensor: its part, its source, its mounting, what the link carries."""
