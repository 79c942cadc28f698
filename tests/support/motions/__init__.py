"""Computed readings of sensors that an arm, a servo or a table turns."""
