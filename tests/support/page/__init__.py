"""Browsers, and pages of runs that nobody made."""
