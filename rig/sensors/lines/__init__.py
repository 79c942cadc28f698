"""Devices that print samples as lines of text, on a serial port of their own."""
