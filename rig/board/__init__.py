"""The host's side of the board: identification, and calibrations stored on it."""
