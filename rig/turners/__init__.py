"""Drivers of the devices that turn the sensors, one package for each maker's protocol."""
