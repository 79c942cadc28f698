"""Gyroscopes: their calibration from averaged revolutions, and its comparison with the board and a reference."""
