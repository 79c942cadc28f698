"""Sensors with a port of their own (not the board's), one package for each maker's protocol."""
