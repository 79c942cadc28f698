"""From observations to typed results: calibration, verdict, verification, alignment, on-board check."""
