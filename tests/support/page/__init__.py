"""Browsers, and pages of invented runs."""
