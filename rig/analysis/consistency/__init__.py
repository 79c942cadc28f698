"""Checks whether a recording is consistent with itself: fault modes, residual tests, and their limits."""
