"""What accelerometers read of gravity, in dwells and in sweeps."""
