"""Calibration estimators: pure functions from arrays to results, no input or output."""
