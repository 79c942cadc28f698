"""Accelerometer readings of gravity, in dwells and in sweeps."""
