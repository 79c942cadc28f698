"""Calibrations by hand: solved, judged, predicted, and compared with the board's own solution."""
