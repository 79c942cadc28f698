"""Accelerometers and magnetometers in a constant reference, at rest in attitudes and in sweeps."""
