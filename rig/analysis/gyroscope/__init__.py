"""Gyroscopes: from averaged revolutions to a calibration, and its comparison with the board's and a reference's."""
