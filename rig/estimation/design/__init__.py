"""Bounds and optimality of a planned measurement."""
