"""Gyroscopes: from averaged revolutions to a calibration, and comparisons with the board's and a reference's."""
