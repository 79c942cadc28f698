"""Whole simulated laboratories, and commands and runs on them."""
