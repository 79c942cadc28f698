"""Placeholders in results of measurements without an arm or without a board."""

NO_BOARD = "none"  # if every sensor has a port of its own
NO_ARM = "none"  # for readings recorded by another program
