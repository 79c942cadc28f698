"""Accelerometers and magnetometers in a constant reference (gravity, a field), at rest in attitudes and in sweeps."""
