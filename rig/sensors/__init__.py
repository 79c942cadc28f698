"""Sensors with a port of their own, beside the board's: each a room that knows its maker's protocol."""
