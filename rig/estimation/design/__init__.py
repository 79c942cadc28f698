"""Bounds and optimality of a design, before anything is measured."""
