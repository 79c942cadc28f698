"""Calibrations by hand: solved, judged, predicted, and compared with what the board solved by itself."""
