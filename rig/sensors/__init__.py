"""Sensors with a port of their own, one package for each maker's protocol."""
