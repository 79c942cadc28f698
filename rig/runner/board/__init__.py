"""The board during a run: its sensors set up, its own calibration, its corrections."""
