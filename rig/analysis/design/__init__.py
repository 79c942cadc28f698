"""Predictions from a plan: uncertainties, detectable faults, the shortest run."""
