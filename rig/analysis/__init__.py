"""Observations → typed result: calibration, verdict, verification, alignment, on-board check; pure."""
