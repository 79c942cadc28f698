"""Accelerometers and magnetometers, from readings of a constant reference: gravity, a magnetic field."""
