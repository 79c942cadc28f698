"""Predictions from a plan, before anything moves: uncertainties, detectable faults, the shortest run."""
