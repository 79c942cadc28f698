"""What a plan will reach before anything moves: uncertainties, detectable faults, the shortest run."""
