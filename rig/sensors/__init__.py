"""Sensors with a port of their own, as opposed to the board's, one package for each maker's protocol."""
