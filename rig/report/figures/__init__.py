"""Plots as files, with matplotlib."""
