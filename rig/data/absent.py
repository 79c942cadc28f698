"""Placeholders in results of measurements without an arm or without a board."""

NO_BOARD = "none"  # where every sensor has a port of its own
NO_ARM = "none"  # of readings recorded elsewhere
