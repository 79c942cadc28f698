"""Devices that send samples as lines of text, on a serial port of their own."""
